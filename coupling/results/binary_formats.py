"""Files that are no tables of text: their formats by how they begin, and what reads each, or the way to a text."""

import re
from pathlib import Path

EXPORT = "export the trace as CSV in the scope's software"
UNPACK = "unpack it first"
PICTURE = "it shows the screen and holds no samples; export the trace as CSV"
TABLE = "save the sheet as CSV (text)"
ARRAYS = "and give time (s) and force (N) to hertzlink.as_signal"


class Reader(str):
    """The name of a function of `recorder_files` that reads a format."""


SCOPE, YOKOGAWA, TDMS, MATLAB, HDF5, SOUND, UNIVERSAL, WORKBOOK, PARQUET = map(
    Reader, ("scope", "yokogawa", "tdms", "matlab", "hdf5", "sound", "universal", "workbook", "parquet")
)

SIGNATURES: tuple[tuple[int, bytes, str, str], ...] = (
    (0, b"\xd0\xcf\x11\xe0", "a workbook of old Excel (.xls)", TABLE),
    (0, b"PK", "a zip archive", UNPACK),
    (0, b"\x1f\x8b", "compressed by gzip", UNPACK),
    (0, b"BZh", "compressed by bzip2", UNPACK),
    (0, b"\xfd7zXZ", "compressed by xz", UNPACK),
    (0, b"7z\xbc\xaf", "a 7z archive", UNPACK),
    (0, b"Rar!", "a rar archive", UNPACK),
    (0, b"\x28\xb5\x2f\xfd", "compressed by zstd", UNPACK),
    (0, b"MATLAB 7.3", "a file of MATLAB 7.3 (HDF5)", HDF5),
    (0, b"MATLAB 5.0", "a file of MATLAB (.mat)", MATLAB),
    (0, b"\x89HDF", "an HDF5 file", HDF5),
    (512, b"\x89HDF", "an HDF5 file", HDF5),
    (0, b"CDF\x01", "a netCDF file", f"read it with xarray, {ARRAYS}"),
    (0, b"CDF\x02", "a netCDF file", f"read it with xarray, {ARRAYS}"),
    (0, b"CDF\x05", "a netCDF file", f"read it with xarray, {ARRAYS}"),
    (8, b"WAVE", "a sound file (.wav)", SOUND),
    (8, b"WEBP", "a picture (.webp)", PICTURE),
    (0, b"RIFF", "a RIFF file", EXPORT),
    (0, b"TDSm", "a TDMS file of LabVIEW", TDMS),
    (0, b"\x93NUMPY", "an array of numpy", f"load it with numpy.load, {ARRAYS}"),
    (2, b":WFM#", "a waveform of Tektronix (.wfm)", SCOPE),
    (3, b"WFM#", "a waveform of Tektronix (.wfm)", SCOPE),
    (0, b"LLWFM", "a waveform of Tektronix (.wfm)", SCOPE),
    (0, b"\xa5\xa5", "a waveform of Rigol (.wfm)", SCOPE),
    (0, b"\xa1\xa5\x00\x00", "a waveform of Rigol (.wfm)", SCOPE),
    (0, b"\x01\xff\xff\xff", "a waveform of Rigol (.wfm)", SCOPE),
    (0, b"AG10", "a binary waveform of Keysight (.bin)", SCOPE),
    (0, b"AG01", "a binary waveform of Keysight (.bin)", SCOPE),
    (0, b"AG03", "a binary waveform of Keysight (.bin)", SCOPE),
    (0, b"RG01", "a binary waveform of Rigol (.bin)", SCOPE),
    (0, b"RG03", "a binary waveform of Rigol (.bin)", SCOPE),
    (0, b"\4\0\0\0\0\x10\0\0", "a binary waveform of Siglent (.bin)", SCOPE),
    (0, b"PAR1", "a Parquet file", PARQUET),
    (0, b"SQLite format", "a database of SQLite", EXPORT),
    (0, b"\x89PNG", "a picture (.png)", PICTURE),
    (0, b"\xff\xd8\xff", "a picture (.jpg)", PICTURE),
    (0, b"GIF8", "a picture (.gif)", PICTURE),
    (0, b"BM", "a picture (.bmp)", PICTURE),
    (0, b"II*\x00", "a picture (.tif)", PICTURE),
    (4, b"ftyp", "a picture or a film (.heic, .mp4)", PICTURE),
    (0, b"%PDF", "a PDF file", PICTURE),
    (257, b"ustar", "a tar archive", UNPACK),
    (0, b"\x04\x22\x4d\x18", "compressed by lz4", UNPACK),
    (0, b"ARROW1", "a Feather file of Arrow", f"read it with pandas, {ARRAYS}"),
    (0, b"SIMPLE  =", "a FITS file", f"read it with astropy, {ARRAYS}"),
    (0, b"OggS", "a sound file (.ogg)", EXPORT),
    (0, b"fLaC", "a sound file (.flac)", EXPORT),
)  # fmt: skip
"""Place and bytes at the beginning, what the file is, and the way out."""

HEADS: tuple[tuple[bytes, str, Reader], ...] = (
    (rb"WAVEDESC\0", "a binary waveform of LeCroy (.trc)", SCOPE),
    (rb":?CURVE? ?#\d", "a binary waveform of Tektronix (.isf)", SCOPE),
    (rb"-1\s*\n\s*58b", "a universal file (UFF 58)", UNIVERSAL),
    (rb"NR_PT:.*YMU:", "a waveform of Yokogawa (.wfm)", SCOPE),
)
"""What stands near the beginning of waveforms that start as text."""

IN_ARCHIVES: tuple[tuple[bytes, str, str], ...] = (
    (b"xl/", "an Excel workbook (.xlsx)", WORKBOOK),
    (b"opendocument.spreadsheet", "a sheet of LibreOffice (.ods)", TABLE),
    (b".npy", "arrays of numpy (.npz)", f"load them with numpy.load, {ARRAYS}"),
    (b"word/", "a document of Word (.docx)", EXPORT),
)
"""What a zip archive is that holds files of these names."""

MARKUP: tuple[tuple[str, str, str], ...] = (
    (r"-1\s*\n\s{1,6}(58|151|164)\s*\n", "a universal file (UFF 58)", UNIVERSAL),
    (r"[^\0]*\$publicinfo", "a header of Yokogawa (.hdr)", YOKOGAWA),
    (r"(<\?xml.*?\?>\s*)<database\b.*saveitemtype=\"data\"", "a waveform of Rohde & Schwarz (.bin)", SCOPE),
    (r"(<\?xml.*?\?>\s*|<!--.*?-->\s*|<!doctype svg.*?>\s*)*<(\w+:)?svg\b", "a picture (.svg)", PICTURE),
    (r"(<\?xml.*?\?>\s*|<!--.*?-->\s*)*<(!doctype html|html|head|body)\b", "a web page (HTML)", "save the file itself"),
    (r"<\?xml|<!doctype|<!--|<[a-z][\w:.-]*(\s[^<>]*)?>.*</", "an XML file", EXPORT),
    (r"\{\s*[\"}]|\[\s*([\[{\"]|-?\d[\d.e+-]*\s*,)", "a JSON file", f"read it with json, {ARRAYS}"),
    (r"\{\\rtf", "a document (.rtf)", EXPORT),
    (r"%!ps", "a picture (PostScript)", PICTURE),
)
"""How texts begin that are no tables, in small letters."""

SUFFIXES = (".trc", ".wfm", ".isf", ".bin", ".wdf", ".psdata", ".spe", ".dat", ".sgy")

WITH_SIGNATURE = {
    ".h5": "HDF5 file", ".hdf5": "HDF5 file", ".tdms": "TDMS file of LabVIEW", ".wav": "sound file",
    ".parquet": "Parquet file", ".xlsx": "Excel workbook",
}  # fmt: skip
"""Files that begin as SIGNATURES says, unless they are damaged."""

HEAD = 2048

FEWEST_CONTROLS = 0.02
"""Text has no control characters but line ends and tabs; this part of them makes a binary file."""

TEXT_CONTROLS = b"\t\n\r\f\x1a"


def refuse_binary(path: Path, content: bytes) -> None:
    """Raise a ValueError that names the format of a file that is no table of text, and the way out."""
    if format_ := format_of(path, content):
        raise ValueError(f"{path}: is {format_[0]}, not a text of samples; {format_[1]}")


def format_of(path: Path, content: bytes) -> tuple[str, str] | None:
    """Return what a file is that is no table of text, and its Reader, or the way out; None for a text."""
    head = content[:HEAD]
    for name_inside, name, out in IN_ARCHIVES if head[:4] == b"PK\x03\x04" else ():
        if name_inside in content:
            return name, out
    for place, start, name, out in SIGNATURES:
        # Letters and digits, such as BM, PK or AG10, may begin a text, which has no zeros beside them.
        may_be_text = start.isalnum() and b"\0" not in head[:16] and _is_text(head)
        if head[place : place + len(start)] == start and not may_be_text:
            return name, out
    for words, name, out in HEADS:
        if re.search(words, head, re.DOTALL):
            return name, out
    if not _is_text(head) and path.suffix.lower() == ".wvf":
        return "a file of samples of Yokogawa (.wvf)", "read the .hdr of the same name"
    if not _is_text(head) and path.suffix.lower() == ".mat":
        return "a file of MATLAB 4 (.mat)", MATLAB  # which has no signature
    if not _is_text(head) and (ending := WITH_SIGNATURE.get(path.suffix.lower())):
        return f"a damaged {ending}, or none in spite of its ending", EXPORT
    if not _is_text(head):
        kind = f" ({path.suffix})" if path.suffix.lower() in SUFFIXES else ""
        return f"a binary file{kind}", SCOPE if kind else EXPORT
    # By its first letters; UTF-16 counts as its letters.
    text = head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n").lower().decode("latin-1")
    return next(((name, out) for start, name, out in MARKUP if re.match(start, text, re.DOTALL)), None)


def _is_text(head: bytes) -> bool:
    """Return whether bytes may be text: UTF-16 with its many zeros too."""
    if not head or head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    even, odd = head[::2], head[1::2]
    if max(even.count(0), odd.count(0)) > 0.6 * len(odd) and min(even.count(0), odd.count(0)) < 0.1 * len(even):
        return True
    controls = sum(byte < 32 and byte not in TEXT_CONTROLS for byte in head)
    return controls <= FEWEST_CONTROLS * len(head)
