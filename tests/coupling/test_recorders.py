"""Files of recorders: each is written here by its published layout or by another library, and compared with the trace.

The samples are whole counts of a digitiser, so that every format holds them exactly. `hl.read_signal` reads volts.
"""

import re
import struct
import sys
import wave
from collections.abc import Callable
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import h5py
import numpy as np
import pytest
import scipy.io

import hertzlink as hl
from hertzlink import cli

STEP, START, VOLT = 5e-7, -1e-4, 2.0**-12
TIME = START + STEP * np.arange(1200)
COUNTS = np.round(sum(a * np.exp(-(((TIME - at) / 1.5e-5) ** 2)) for a, at in ((8000, 1e-4), (3000, 3.5e-4)))).astype(
    "i2"
)
VOLTS = VOLT * COUNTS


def tektronix_isf(path: Path) -> None:
    """Layout: programmer manual of the TDS series, WFMPre and CURVe."""
    head = (
        f':WFMPRE:BYT_NR 2;BIT_NR 16;ENCDG BIN;BN_FMT RI;BYT_OR MSB;NR_PT 1200;WFID "Ch1";PT_FMT Y;XINCR {STEP};'
        f'PT_OFF 0;XZERO {START};XUNIT "s";YMULT {VOLT / 2};YZERO 0.5;YOFF 1024.0E0;YUNIT "V";:CURVE #42400'
    )
    # (count - YOFF) * YMULT + YZERO is the voltage.
    path.write_bytes(head.encode() + (2 * COUNTS + 1024 - int(1.0 / VOLT)).astype(">i2").tobytes())


def lecroy_trc(path: Path, segments: int = 1) -> None:
    """Layout: template LECROY_2_3 of the remote control manual."""
    desc = bytearray(346)
    desc[:8], desc[16:26] = b"WAVEDESC", b"LECROY_2_3"
    data, times = np.tile(COUNTS, segments), 16 * segments * (segments > 1)
    for place, form, value in (
        (32, "h", 1), (34, "h", 1), (36, "i", 346), (48, "i", times), (60, "i", 2 * data.size), (116, "i", data.size),
        (144, "i", segments), (156, "f", VOLT), (160, "f", 0.0), (176, "f", STEP), (180, "d", START),
    ):  # fmt: skip
        struct.pack_into("<" + form, desc, place, value)
    desc[76:84], desc[196:197], desc[244:245] = b"LECROY64", b"V", b"S"
    path.write_bytes(b"#9000002768" + bytes(desc) + bytes(times) + data.astype("<i2").tobytes())


def keysight_bin(path: Path, cookie: bytes = b"AG10", sign: int = 1) -> None:
    """Layout: appendix on binary data of the InfiniiVision 2000 X-Series guide. Rigol's origins have another sign."""
    wave_header = struct.pack(
        "<5If3d2I16s16s24s16sdI", 140, 1, 1, 1200, 0, 6e-4, sign * START, STEP, sign * START, 2, 1,
        b"27 NOV 2026", b"10:00:00", b"MSO-X 2024A:MY1", b"1", 0.0, 0,
    )  # fmt: skip
    data = VOLTS.astype("<f4").tobytes()
    body = wave_header + struct.pack("<IHHI", 12, 1, 4, len(data)) + data
    path.write_bytes(cookie + struct.pack("<II", 12 + len(body), 1) + body)


def rohde_schwarz_bin(path: Path) -> None:
    """Layout: "Data export" of the RTP manual, 16 bits, with 38 samples that lead in, an offset and a position."""
    levels, lead = 64768, 38
    values = {
        "SignalFormat": "eRS_SIGNAL_FORMAT_INT16BIT", "TraceType": "eRS_TRACE_TYPE_NORMAL", "NumberOfAcquisitions": 1,
        "SignalHardwareRecordLength": 1200 + lead, "RecordLength": 1200, "LeadingSettlingSamples": lead,
        "MultiChannelExport": "eRS_ONOFF_OFF", "Source": "eRS_SIGNAL_SOURCE_CH1_TR1", "XStart": START,
        "XStop": START + 1200 * STEP, "NofQuantisationLevels": levels, "VerticalScale": VOLT * levels / 10,
        "VerticalOffset": 0.25, "VerticalPosition": 1.25,
    }  # fmt: skip
    props = "".join(f'<Prop Name="{name}" Value="{value}" StepFactor="10"/>' for name, value in values.items())
    path.write_text(f'<?xml version="1.0"?>\n<Database SaveItemType="Data"><Group>{props}</Group></Database>')
    raw = np.pad(COUNTS - round(0.25 / VOLT) + levels // 8, (lead, 0)).astype("<i2").tobytes()
    path.with_name("recording.Wfm.bin").write_bytes(struct.pack("<II", 1, 1200 + lead) + raw)


def siglent_bin(path: Path) -> None:
    """Layout: "How to Extract Data from the Binary File of SIGLENT Oscilloscope", format 4.0; signs as SDS814X HD have
    them (SPEC.md of vindavs/siglent-bin). Channel 2, with a probe of 16 and an offset of 64 steps."""
    head, step = bytearray(4096), 1e3 * VOLT / 16.0  # mV
    units = (0, 1, 1, 0, 1, 0, 1), (0, 0, 1, 0, 1, 1, 1)  # V and s
    for place, form, *values in (
        (0, "2i", 4, 4096), (12, "i", 1), (0x40, "d8i", 7680 * step, 7, *units[0]),
        (0xE0, "d8i", 64 * step, 7, *units[0]), (0x19C, "d8i", -2e8 * START, 5, *units[1]), (0x1EC, "i", 1200),
        (0x1F0, "d8i", 1e-3 / STEP, 9, *units[1]), (0x24C, "d", 16.0), (0x264, "B", 1), (0x26C, "i", 10),
        (0x274, "i", 7680),
    ):  # fmt: skip
        struct.pack_into("<" + form, head, place, *values)
    path.write_bytes(bytes(head) + (COUNTS.astype(int) + 32768 + 64).astype("<u2").tobytes())


def yokogawa_hdr(path: Path, blocks: int = 1) -> None:
    """Layout: IM 707713-61E and the header of a WE7273; two groups, of which the second one holds the trace."""
    lines = ["//YOKOGAWA ASCII FILE FORMAT", "", "$PublicInfo", "FormatVersion     1.01", "Model             WE7273"]
    lines += ["Endian            Big", "DataFormat        Block", "GroupNumber       2", "TraceTotalNumber  3"]
    lines += ["DataOffset        16", ""]
    for group, names in ((1, ["CH1"]), (2, ["CH2", "CH3"])):
        columns = {
            "TraceName": names, "BlockSize": [1200], "VResolution": [1e3 * VOLT], "VOffset": [-250.0],
            "VDataType": ["IS2"], "VUnit": ["mV"], "VPlusOverData": [32767], "VMinusOverData": [-32768],
            "HResolution": [STEP], "HOffset": [START], "HUnit": ["s"], "Date": ["2026/11/27"], "Time": ["10:00:00"],
        }  # fmt: skip
        lines += [f"$Group{group}", f"TraceNumber       {len(names)}", f"BlockNumber       {blocks}"]
        lines += [
            f"{key:18}" + "".join(f"{v!s:20}" for v in (len(names) * v)[-len(names) :]) for key, v in columns.items()
        ]
    path.write_text("\n".join([*lines, "", "$PrivateInfo", "RefFileNumber     0", ""]))
    block = (COUNTS + round(0.25 / VOLT)).astype(">i2").tobytes()
    other = bytes(2400)
    path.with_name("recording.wvf").write_bytes(bytes(16) + blocks * other + (blocks - 1) * 2 * other + other + block)


def labview_tdms(path: Path) -> None:
    """Layout: "TDMS File Format Internal Structure" of NI: a segment of one channel, its properties and raw data."""

    def text(words: str) -> bytes:
        return struct.pack("<I", len(words)) + words.encode()

    properties = [("wf_increment", 10, struct.pack("<d", STEP)), ("wf_start_offset", 10, struct.pack("<d", START))]
    properties.append(("unit_string", 32, text("mV")))
    index = struct.pack("<IIIQ", 20, 10, 1, 1200)  # a vector of doubles
    objects = struct.pack("<I", 3) + text("/") + struct.pack("<II", 0xFFFFFFFF, 0)
    objects += text("/'taps'") + struct.pack("<II", 0xFFFFFFFF, 0)
    objects += text("/'taps'/'bead 7'") + index + struct.pack("<I", len(properties))
    objects += b"".join(text(name) + struct.pack("<I", kind) + value for name, kind, value in properties)
    data = (1e3 * VOLTS).astype("<f8").tobytes()
    lead_in = b"TDSm" + struct.pack("<IIQQ", 2 | 4 | 8, 4713, len(objects) + len(data), len(objects))
    path.write_bytes(lead_in + objects + data)


def picoscope_mat(path: Path) -> None:
    """Layout: "MAT-File Format" of MathWorks, level 5; of PicoScope the names."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    content = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x0100, b"IM")
    for name, values in (("A", VOLTS), ("Tinterval", [STEP]), ("Tstart", [START]), ("Length", [1200])):
        data = np.asarray(values, "<f8")
        parts = (
            (6, struct.pack("<II", 6, 0)),
            (5, struct.pack("<ii", data.size, 1)),
            (1, name.encode()),
            (9, data.tobytes()),
        )
        content += element(14, b"".join(element(*part) for part in parts))
    path.write_bytes(content)


def matlab_73(path: Path) -> None:
    """Layout: an HDF5 file behind a text of 512 bytes; arrays lie transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("t", TIME), ("force", VOLTS)):
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        file.create_dataset("note", data=np.frombuffer(b"struck by a rod of 4 mm", "u1").astype("u2")[:, None]).attrs[
            "MATLAB_class"
        ] = np.bytes_("char")
    with open(path, "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        values = file.create_dataset("run 1/force", data=1e3 * VOLTS)
        values.attrs.update({"units": "mV", "sample_rate": 1.0 / STEP, "t0": START})


def sound(path: Path) -> None:
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 4, 2_000_000, 1200, "NONE", ""))
        file.writeframes((COUNTS.astype("<i4") << 18).tobytes())


def universal_58(path: Path) -> None:
    """Layout: data set 58 of the universal file formats of SDRC, formatted."""
    lines = [f"{-1:6d}", f"{58:6d}", "bead 7", "NONE", "27-Nov-26", "NONE", "NONE"]
    lines.append(f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{7:10d}{3:4d} {'NONE':10s}{0:10d}{0:4d}")
    lines.append(f"{4:10d}{1200:10d}{1:10d}{START:13.5e}{STEP:13.5e}{0.0:13.5e}")
    axes = ((17, "Time", "s"), (1, "Voltage", "V"), (0, "NONE", "NONE"), (0, "NONE", "NONE"))
    lines += [f"{code:10d}{0:5d}{0:5d}{0:5d} {name:20s} {unit:20s}" for code, name, unit in axes]
    lines += ["".join(f"{v:20.11e}" for v in VOLTS[k : k + 4]) for k in range(0, 1200, 4)]
    path.write_text("\n".join([*lines, f"{-1:6d}", ""]))


def workbook(path: Path) -> None:
    """Layout: ECMA-376, of the parts that a workbook of one sheet must have."""
    office, types = "http://schemas.openxmlformats.org", "application/vnd.openxmlformats"
    main, kinds = f"{office}/spreadsheetml/2006/main", f"{office}/officeDocument/2006/relationships"
    rows = (
        '<row><c t="inlineStr"><is><t>Time (ms)</t></is></c><c t="inlineStr"><is><t>Channel A (mV)</t></is></c></row>'
    )
    rows += "".join(
        f"<row><c><v>{1e3 * t}</v></c><c><v>{1e3 * v}</v></c></row>" for t, v in zip(TIME, VOLTS, strict=True)
    )

    def related(kind: str, target: str) -> str:
        one = f'<Relationship Id="r" Type="{kinds}/{kind}" Target="{target}"/>'
        return f'<Relationships xmlns="{office}/package/2006/relationships">{one}</Relationships>'

    def typed(part: str, kind: str) -> str:
        return f'<Override PartName="{part}" ContentType="{types}-officedocument.spreadsheetml.{kind}+xml"/>'

    parts = {
        "[Content_Types].xml": f'<Types xmlns="{office}/package/2006/content-types">'
        f'<Default Extension="rels" ContentType="{types}-package.relationships+xml"/>'
        f"{typed('/xl/workbook.xml', 'sheet.main')}{typed('/xl/sheet.xml', 'worksheet')}</Types>",
        "_rels/.rels": related("officeDocument", "xl/workbook.xml"),
        "xl/_rels/workbook.xml.rels": related("worksheet", "sheet.xml"),
        "xl/workbook.xml": f'<workbook xmlns="{main}" xmlns:r="{kinds}"><sheets>'
        '<sheet name="a" sheetId="1" r:id="r"/></sheets></workbook>',
        "xl/sheet.xml": f'<worksheet xmlns="{main}"><sheetData>{rows}</sheetData></worksheet>',
    }
    with ZipFile(path, "w") as file:
        for name, content in parts.items():
            file.writestr(name, content)


def parquet(path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet

    pyarrow.parquet.write_table(arrow.table({"time (us)": 1e6 * TIME, "A (mV)": 1e3 * VOLTS}), path)


def tektronix_wfm(path: Path) -> None:
    """By the library of Tektronix; `pip install --no-deps tm_data_types bidict`, since it asks for an older numba."""
    tm = pytest.importorskip("tm_data_types")
    trace = tm.AnalogWaveform()
    trace.y_axis_values, trace.y_axis_spacing, trace.y_axis_offset = tm.RawSample(COUNTS - 1024), VOLT, 1024 * VOLT
    trace.x_axis_spacing, trace.trigger_index, trace.source_name = STEP, -START / STEP, "CH1"
    tm.write_file(str(path), trace)


FORMATS: dict[str, tuple[Callable[[Path], None], str]] = {
    "tektronix.isf": (tektronix_isf, "RigolWFM"),
    "tektronix.wfm": (tektronix_wfm, "RigolWFM"),
    "lecroy.trc": (lecroy_trc, "RigolWFM"),
    "keysight.bin": (keysight_bin, "RigolWFM"),
    "rigol.bin": (partial(keysight_bin, cookie=b"RG01", sign=-1), "RigolWFM"),
    "rohde_schwarz.bin": (rohde_schwarz_bin, "RigolWFM"),
    "siglent.bin": (siglent_bin, "RigolWFM"),
    "yokogawa.hdr": (yokogawa_hdr, "RigolWFM"),
    "labview.tdms": (labview_tdms, "nptdms"),
    "pico.mat": (picoscope_mat, "scipy"),
    "matlab73.mat": (matlab_73, "h5py"),
    "hdf5.h5": (hdf5, "h5py"),
    "sound.wav": (sound, "scipy"),
    "universal.uff": (universal_58, "pyuff"),
    "workbook.xlsx": (workbook, "openpyxl"),
    "table.parquet": (parquet, "pyarrow"),
}
"""How each is written, and the library that reads it."""


@pytest.mark.parametrize("name", FORMATS)
def test_a_recording_holds_the_samples_and_times_that_were_written(tmp_path: Path, name: str) -> None:
    write, library = FORMATS[name]
    pytest.importorskip(library)
    write(tmp_path / name)
    plain = (tmp_path / name).rename(tmp_path / "recording")  # formats are recognised by content
    is_sound = name == "sound.wav"  # which begins at 0, and whose full scale is 1
    channel = 3 if name == "yokogawa.hdr" else 1
    signal = hl.read_signal(plain, {7: channel}, calibration=20.0 if is_sound else 10.0, baseline=0.0)
    np.testing.assert_allclose(signal.time, TIME - START * is_sound, atol=1e-10)
    np.testing.assert_allclose(signal.sensor_force.sel(sensor=7), 10.0 * VOLTS, atol=1e-6)


def test_segments_of_a_sequence(tmp_path: Path) -> None:
    pytest.importorskip("RigolWFM")
    lecroy_trc(tmp_path / "taps.trc", segments=3)
    with pytest.raises(ValueError, match=r"taps\.trc: holds 3 segments, .* segment=1 to 3"):
        hl.read_signal(tmp_path / "taps.trc", {7: 1}, calibration=1.0)
    signal = hl.read_signal(tmp_path / "taps.trc", {7: 1}, calibration=1.0, segment=3, baseline=0.0)
    np.testing.assert_allclose(signal.sensor_force.sel(sensor=7), VOLTS, atol=1e-6)


def test_blocks_of_yokogawa_are_segments(tmp_path: Path) -> None:
    pytest.importorskip("RigolWFM")
    yokogawa_hdr(tmp_path / "recording.hdr", blocks=2)
    with pytest.raises(ValueError, match="holds 2 segments"):
        hl.read_signal(tmp_path / "recording.hdr", {7: 3}, calibration=1.0)
    signal = hl.read_signal(tmp_path / "recording.hdr", {7: 3}, calibration=1.0, segment=2, baseline=0.0)
    np.testing.assert_allclose(signal.sensor_force.sel(sensor=7), VOLTS, atol=1e-6)
    with pytest.raises(ValueError, match=r"is a file of samples of Yokogawa .*; read the \.hdr of the same name"):
        hl.read_signal(tmp_path / "recording.wvf", {7: 3}, calibration=1.0)
    (tmp_path / "recording.wvf").unlink()
    with pytest.raises(ValueError, match=r"recording\.hdr: .*its samples, a \.wvf of the same name, are not beside it"):
        hl.read_signal(tmp_path / "recording.hdr", {7: 3}, calibration=1.0, segment=2)


@pytest.mark.thorough
@pytest.mark.parametrize("name", FORMATS)
def test_a_damaged_recording_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    write, library = FORMATS[name]
    pytest.importorskip(library)
    write(tmp_path / name)
    path = tmp_path / name
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(
        ValueError, match=rf"{name}.* (cannot be read|must hold|has no|no numbers|unpack it)"
    ) as refused:
        hl.read_signal(path, {7: 1}, calibration=1.0)
    assert "\n" not in str(refused.value)


def test_without_the_extra_a_message_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nptdms", None)
    (tmp_path / "a.tdms").write_bytes(b"TDSm\x0e\x00\x00\x00")
    with pytest.raises(ValueError, match=r"a\.tdms: is a TDMS file .* pip install 'hertzlink\[recorders\]'"):
        hl.read_signal(tmp_path / "a.tdms", {7: 1}, calibration=1.0)


def test_channels_times_and_units_that_a_file_does_not_have(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"force": VOLTS})
    with pytest.raises(ValueError, match=r"a\.mat: states no times and no interval; give interval="):
        hl.read_signal(path, {7: 1}, calibration=1.0)
    signal = hl.read_signal(path, {7: 1}, unit="N", interval=STEP)
    assert float(signal.time[1] - signal.time[0]) == pytest.approx(STEP)
    with pytest.raises(ValueError, match=r"has channels 1 \(force\), counted from 1, and no channel 2"):
        hl.read_signal(path, {7: 2}, unit="N", interval=STEP)
    with pytest.raises(ValueError, match="time_column = 0: is for text"):
        hl.read_signal(path, {7: 1}, unit="N", time_column=0)


def read_volts(path: Path, channel: int = 1, **given: Any) -> Any:
    return hl.read_signal(path, {7: channel}, **(given or {"calibration": 1.0, "baseline": 0.0}))


def same_as_written(signal: Any, volts: Any = VOLTS, start: float = START) -> None:
    np.testing.assert_allclose(signal.time, TIME - START + start, atol=1e-10)
    np.testing.assert_allclose(signal.sensor_force.sel(sensor=7), volts, atol=1e-6)


def test_a_matrix_of_time_and_samples(tmp_path: Path) -> None:
    """Its first row counts no zeros of a unit "0", nor is it a force where the interval is an argument."""
    rows = np.array([TIME, VOLTS, 2.0 * VOLTS])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["data"] = rows
    scipy.io.savemat(tmp_path / "a.mat", {"data": rows.T})
    for name in ("a.h5", "a.mat"):
        with pytest.warns(hl.HertzlinkWarning, match=r"data\[0\] increases evenly, and is taken as the time"):
            signals = read_volts(tmp_path / name, 2), read_volts(tmp_path / name, unit="N", interval=STEP, baseline=0.0)
        same_as_written(signals[0], 2.0 * VOLTS)
        same_as_written(signals[1], start=0.0)
    scipy.io.savemat(tmp_path / "b.mat", {"data": np.array([np.arange(1200.0), VOLTS]), "Tinterval": STEP})
    with pytest.warns(hl.HertzlinkWarning, match=r"data\[0\] increases evenly, as a time does, or a counter"):
        same_as_written(read_volts(tmp_path / "b.mat", 2), start=0.0)


def test_the_path_of_a_dataset_is_no_unit(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/t"] = TIME
        for name in ("A", "F", "mV"):
            file[f"run/{name}"] = VOLTS
    for channel in (1, 2, 3):
        same_as_written(read_volts(tmp_path / "a.h5", channel))


def test_a_sound_of_eight_bits(tmp_path: Path) -> None:
    """It has few bytes that no text has; the full scale is 128 of its counts."""
    counts = (COUNTS // 64 + 128).astype("u1")
    scipy.io.wavfile.write(tmp_path / "a.wav", round(1.0 / STEP), counts)
    same_as_written(read_volts(tmp_path / "a.wav"), counts / 128.0 - 1.0, 0.0)


@pytest.mark.parametrize("start", [0.0, START])
def test_dates_and_durations_are_times(tmp_path: Path, start: float) -> None:
    arrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet

    clock = np.round(1e9 * (TIME - START + start)).astype("m8[ns]")
    clock = clock if start else np.datetime64("2026-01-01T00:00:00", "ns") + clock
    pyarrow.parquet.write_table(arrow.table({"clock": clock, "A (mV)": 1e3 * VOLTS}), tmp_path / "a.parquet")
    same_as_written(read_volts(tmp_path / "a.parquet"), start=start)


def test_decimal_numbers_of_a_parquet_file_are_samples(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet

    exact = arrow.array([Decimal(int(count)) / 4 for count in COUNTS], arrow.decimal128(12, 2))
    pyarrow.parquet.write_table(arrow.table({"time": TIME, "other": VOLTS, "A": exact}), tmp_path / "a.parquet")
    same_as_written(read_volts(tmp_path / "a.parquet", 2), COUNTS / 4)


def test_channels_that_are_read_between_their_samples_are_named(tmp_path: Path) -> None:
    tdms = pytest.importorskip("nptdms")
    with tdms.TdmsWriter(tmp_path / "a.tdms") as file:
        for name, start in (("A", 0.0), ("B", 0.3 * STEP)):
            stated = {"wf_increment": STEP, "wf_start_offset": start}
            file.write_segment([tdms.ChannelObject("taps", name, VOLTS, stated)])
    with pytest.warns(hl.HertzlinkWarning, match="all hold are read, of sensor 8 by straight lines between samples"):
        hl.read_signal(tmp_path / "a.tdms", {7: 1, 8: 2}, calibration=1.0)


def test_no_more_memory_than_a_file_states(tmp_path: Path) -> None:
    """A few bytes of HDF5 that stand for 8 TB are refused before they are laid out."""
    path = tmp_path / "huge.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("force", shape=(10**12,), chunks=(10**6,), dtype="f8", compression="gzip")
    with pytest.raises(ValueError, match=r"huge\.h5: is an HDF5 file that cannot be read \(/force holds 10+ numbers"):
        hl.read_signal(path, {7: 1}, calibration=1.0)


def test_the_command_shows_range_clipping_hum_and_noise(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = 1e-6 * np.arange(80_000)
    pulse = 1.2 * np.exp(-(((time - 6e-2) / 1e-4) ** 2))
    noise = np.random.default_rng(1).normal(0.0, 0.002, time.size)
    volts = np.minimum(np.round(pulse + noise + 0.02 * np.sin(2 * np.pi * 50.0 * time), 3), 1.0)
    scipy.io.savemat(tmp_path / "hum.mat", {"A": volts, "Tinterval": 1e-6, "Tstart": 0.0})
    with pytest.raises(SystemExit) as ended:
        cli.main(["signal", str(tmp_path / "hum.mat"), "--picture", str(tmp_path / "a.png")])
    assert not ended.value.code
    lines = capsys.readouterr().out.split("\n")
    assert lines[0] == "a file of MATLAB (.mat), 80000 samples, one every 1 µs, from 0 s to 80 ms"
    assert re.match(r" +1  A +-2\d(\.\d)? mV +1 V +1 mV +1[34]\.\d mV  50 Hz (19\.9|20|20\.1) mV$", lines[2])
    clipped = int((volts == 1.0).sum())
    assert f"{clipped} samples are clipped" in lines[4]
    assert max(map(len, lines[:-2])) <= 80
    assert lines[5].endswith("as much as white noise would: hum or drift")
    assert (tmp_path / "a.png").stat().st_size > 5_000


def test_the_command_shows_several_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    """Also those after a bad one; pictures of files of the same name have different ones."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "b").mkdir()
    for name in ("C1.mat", "C2.mat", "b/C2.mat"):
        picoscope_mat(tmp_path / name)
    sound(tmp_path / "C2.wav")
    here = tmp_path.name
    for names, pictures in (
        (["C1.mat", "none.mat", "C2.mat"], ["C1", "C2"]),
        (["C2.mat", "C2.wav"], ["C2.mat", "C2.wav"]),
        (["C2.mat", "b/C2.mat"], [f"{here}-C2.mat", "b-C2.mat"]),
    ):
        with pytest.raises(SystemExit) as ended:
            cli.main(["signal", *names])
        assert (ended.value.code or 0) == 2 * ("none.mat" in names)
        said = capsys.readouterr()
        assert [f"\n{name}: a " in f"\n{said.out}" for name in names] == [name != "none.mat" for name in names]
        assert ("none.mat: there is no such file" in said.err) == ("none.mat" in names)
        assert {path.name for path in tmp_path.glob("*.png")} == {f"{name}-signal.png" for name in pictures}
        for path in tmp_path.glob("*.png"):
            path.unlink()


def test_the_command_shows_the_sampling_of_each_channel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tdms = pytest.importorskip("nptdms")
    monkeypatch.chdir(tmp_path)
    with tdms.TdmsWriter("a.tdms") as file:
        for name, every in (("A", 1), ("B", 2)):
            file.write_segment([tdms.ChannelObject("taps", name, VOLTS[::every], {"wf_increment": every * STEP})])
    with pytest.raises(SystemExit):
        cli.main(["signal", "a.tdms"])
    assert capsys.readouterr().out.count("600 samples, one every 1 µs") == 1


@pytest.mark.parametrize(("name", "said"), [
    ("a.h5", "is a damaged HDF5 file, or none in spite of its ending"),
    ("a.tdms", "is a damaged TDMS file of LabVIEW"),
    ("a.wav", "is a damaged sound file"),
    ("a.mat", r"is a file of MATLAB 4 \(.mat\) that cannot be read"),
    ("a.bin", r"a\.bin: is a binary file \(.bin\) that .* \(it is damaged, cut off, or is none of Keysight .*\)"),
    ("rigol.wfm", r"rigol\.wfm: is a waveform of Rigol .* be read \(it is damaged, cut off, or only begins as one\)"),
    ("keysight.bin", r"waveform of Keysight .*, or only begins as one\); export the trace as CSV in the rec"),
])  # fmt: skip
def test_rubbish_is_named_by_its_ending(tmp_path: Path, name: str, said: str) -> None:
    if name.endswith(("bin", "wfm")):
        pytest.importorskip("RigolWFM")
    signature = {"rigol.wfm": b"\x01\xff\xff\xff", "keysight.bin": b"AG10"}.get(name, b"")
    (tmp_path / name).write_bytes(signature + np.random.default_rng(1).bytes(4000))
    with pytest.raises(ValueError, match=said):
        read_volts(tmp_path / name)


def test_matlab_4_and_structs(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"A": VOLTS, "Tinterval": STEP, "Tstart": START}, format="4")
    same_as_written(read_volts(tmp_path / "a.mat"))
    scipy.io.savemat(tmp_path / "b.mat", {"tap": {"A": VOLTS, "t": TIME}})
    with pytest.raises(ValueError, match="tap is a struct; save its fields"):
        read_volts(tmp_path / "b.mat")
