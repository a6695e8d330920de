"""Files that are no text: their formats by the first bytes, and how to get a text or an array from each."""

from pathlib import Path

EXPORT = "export the trace as CSV in the scope's software"
UNPACK = "unpack it first"
PICTURE = "it shows the screen and holds no samples; export the trace as CSV"
TABLE = "save the sheet as CSV (text)"
ARRAYS = "and give time (s) and force (N) to hertzlink.as_signal"
HDF5 = f"read it with h5py or xarray, {ARRAYS}"

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
    (0, b"MATLAB 5.0", "a file of MATLAB (.mat)", f"read it with scipy.io.loadmat, {ARRAYS}"),
    (0, b"\x89HDF", "an HDF5 file", HDF5),
    (512, b"\x89HDF", "an HDF5 file", HDF5),
    (0, b"CDF\x01", "a netCDF file", HDF5),
    (0, b"CDF\x02", "a netCDF file", HDF5),
    (0, b"CDF\x05", "a netCDF file", HDF5),
    (8, b"WAVE", "a sound file (.wav)", f"read it with scipy.io.wavfile, {ARRAYS}"),
    (0, b"RIFF", "a RIFF file", EXPORT),
    (0, b"TDSm", "a TDMS file of LabVIEW", "export it as CSV, or read it with the package npTDMS"),
    (0, b"\x93NUMPY", "an array of numpy", f"load it with numpy.load, {ARRAYS}"),
    (2, b":WFM#", "a waveform of Tektronix (.wfm)", EXPORT),
    (0, b"\xa5\xa5", "a waveform of Rigol (.wfm)", EXPORT),
    (0, b"AG10", "a binary waveform of Keysight (.bin)", EXPORT),
    (0, b"AG01", "a binary waveform of Keysight (.bin)", EXPORT),
    (0, b"AG03", "a binary waveform of Keysight (.bin)", EXPORT),
    (0, b"RG01", "a binary waveform of Rigol (.bin)", EXPORT),
    (0, b"RG03", "a binary waveform of Rigol (.bin)", EXPORT),
    (0, b"PAR1", "a Parquet file", f"read it with pandas, {ARRAYS}"),
    (0, b"SQLite format", "a database of SQLite", EXPORT),
    (0, b"\x89PNG", "a picture (.png)", PICTURE),
    (0, b"\xff\xd8\xff", "a picture (.jpg)", PICTURE),
    (0, b"GIF8", "a picture (.gif)", PICTURE),
    (0, b"BM", "a picture (.bmp)", PICTURE),
    (0, b"II*\x00", "a picture (.tif)", PICTURE),
    (0, b"%PDF", "a PDF file", PICTURE),
)  # fmt: skip
"""Place and bytes at the beginning, what the file is, and the way out."""

HEADS: tuple[tuple[bytes, str], ...] = (
    (b"WAVEDESC", "a binary waveform of LeCroy (.trc)"),
    (b":CURV", "a binary waveform of Tektronix (.isf)"),
    (b"BYT_N", "a binary waveform of Tektronix (.isf)"),
    (b"BYT_NR", "a binary waveform of Tektronix (.isf)"),
)
"""Words near the beginning of waveforms that start as text."""

SUFFIXES = (".trc", ".wfm", ".isf", ".bin", ".tdms", ".wdf", ".psdata", ".mat", ".wav", ".spe", ".dat", ".h5", ".sgy")

HEAD = 2048

FEWEST_CONTROLS = 0.02
"""Text has no control characters but line ends and tabs; this part of them makes a binary file."""

TEXT_CONTROLS = b"\t\n\r\f\x1a"


def refuse_binary(path: Path, content: bytes) -> None:
    """A ValueError that names the format of a file that is no text, and the way out."""
    if found := _named(path, content[:HEAD], content):
        raise ValueError(f"{path}: is {found[0]}, not text; {found[1]}")


def _named(path: Path, head: bytes, content: bytes) -> tuple[str, str] | None:
    if head[:2] == b"PK" and b"xl/" in content:
        return "an Excel workbook (.xlsx)", TABLE
    for place, start, name, out in SIGNATURES:
        # Letters and digits, such as BM, PK or AG10, may begin a text.
        if head[place : place + len(start)] == start and not (start.isalnum() and _is_text(head)):
            return name, out
    if not _is_text(head):
        for word, name in HEADS:
            if word in head:
                return name, EXPORT
        kind = f" ({path.suffix})" if path.suffix.lower() in SUFFIXES else ""
        return f"a binary file{kind}", EXPORT
    return None


def _is_text(head: bytes) -> bool:
    """Whether bytes may be text: UTF-16 with its many zeros too."""
    if not head or head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    even, odd = head[::2], head[1::2]
    if max(even.count(0), odd.count(0)) > 0.6 * len(odd) and min(even.count(0), odd.count(0)) < 0.1 * len(even):
        return True
    controls = sum(byte < 32 and byte not in TEXT_CONTROLS for byte in head)
    return controls <= FEWEST_CONTROLS * len(head)
