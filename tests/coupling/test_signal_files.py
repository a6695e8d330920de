"""Texts as oscilloscopes write them: each is read as it was written, or refused with its line and the cure."""

import random
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import hertzlink as hl

TIME = 1e-6 * np.arange(-100, 900)
VOLTS = 0.25 + sum(a * np.exp(-(((TIME - at) / 2e-5) ** 2)) for a, at in ((3.0, 1e-4), (1.2, 5e-4)))


def table(form: str = "{t:.9f},{v:.6f}", second: float = 1.0, volt: float = 1.0) -> list[str]:
    """One line for each sample."""
    return [form.format(t=t * second, v=v * volt, k=k) for k, (t, v) in enumerate(zip(TIME, VOLTS, strict=True))]


def commas(lines: list[str]) -> list[str]:
    return [line.replace(".", ",") for line in lines]


def written(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_text("\n".join(lines) + end, encoding="utf-8")
    return path


FORMS: dict[str, tuple[list[str], int, int]] = {
    "plain": (["time (s),channel 1 (V)", *table()], 0, 1),
    "no head": (table("{t:.8e},{v:.8e}"), 0, 1),
    "pico": (["Time,Channel A", "(ms),(mV)", "", *table("{t:.8f},{v:.4f}", 1e3, 1e3)], 0, 1),
    "pico, German": (["Zeit;Kanal A", "(µs);(V)", "", *commas(table("{t:.8f};{v:.6f}", 1e6))], 0, 1),
    "keysight": (["x-axis,1", "second,Volt", *table("{t:+.8E},{v:+.6E}")], 0, 1),
    "tektronix": (['"Model","MSO"', '"Vertical Units","mV"', "", "TIME,CH1", *table(volt=1e3)], 0, 1),
    "keys beside the samples": (
        [f"{'Vertical Units,mV' if k == 1 else ','},{row}," for k, row in enumerate(table(volt=1e3))],
        2, 3,
    ),
    "lecroy": (
        ["LECROYWR,1,Waveform", "Segments,1,SegmentSize,1000", "#1,24-Nov-2020 10:23,0", "Time,Ampl", *table()], 0, 1,
    ),
    "tabs and decimal commas": (["Time [ms]\tA [V]", *commas(table("{t:.8f}\t{v:.6f}", 1e3))], 0, 1),
    "quotes and decimal commas": (['"t (s)";"U (V)"', *commas(table('"{t:.8f}";"{v:.6f}"'))], 0, 1),
    "a date above": (["Datum;28.11.2026", "t (s);U (V)", *commas(table("{t:.8f};{v:.6f}"))], 0, 1),
    "trailing commas": (["time,CH1,", *table("{t:.8f},{v:.6f},")], 0, 1),
    "t/µs": (["t/µs,CH1/mV", *table("{t:.8f},{v:.6f}", 1e6, 1e3)], 0, 1),
    "in": (["in s,C1 in mV", *table(volt=1e3)], 0, 1),
    "_us": (["time_us,CH1_uV", *table("{t:.8f},{v:.6f}", 1e6, 1e6)], 0, 1),
    "usec": (["TIME (USEC),CH1 (VOLT)", *table("{t:.8f},{v:.6f}", 1e6)], 0, 1),
    "last word": (["Time ms,Channel A", *table("{t:.8f},{v:.6f}", 1e3)], 0, 1),
    "blanks": (["# Time (us)  CH1 (mV)", *table("{t:.8f}  {v:.6f}", 1e6, 1e3)], 0, 1),
    "kV": (["Time (s),CH1 (kV) filtered", *table("{t:.9f},{v:.8f}", 1, 1e-3)], 0, 1),
    "typeset minus": ([row.replace("-", "−") for row in table()], 0, 1),
    "a counter and a time": (["Sample,Time (s),CH1 (V)", *table("{k},{t:.9f},{v:.6f}")], 1, 2),
    "LabVIEW": (["LabVIEW Measurement", "X_Columns\tMulti", "***End_of_Header***", "X_Value\tVoltage\tComment",
                 *table("{t:.9f}\t{v:.6f}")], 0, 1),
    "blank lines and the end of DOS": (
        ["time (s),CH1 (V)", *(f"{row}\r" for row in table()), "\x1a"], 0, 1,
    ),
    "bars": (["Time (s)|CH1 (V)", *table("{t:.9f}|{v:.6f}")], 0, 1),
}  # fmt: skip


@pytest.mark.parametrize(
    ("form", "encoding"),
    [*((form, "utf-8") for form in FORMS), *(("pico, German", e) for e in ("latin-1", "utf-16", "utf-8-sig"))],
)
def test_forms(tmp_path: Path, form: str, encoding: str) -> None:
    lines, time_column, column = FORMS[form]
    path = tmp_path / "scope.csv"
    path.write_bytes("\r\n".join([*lines, ""]).encode(encoding))
    for given in (None, time_column):
        data = hl.read_signal(path, {7: column}, time_column=given, calibration=10.0)
        assert data.time.values == pytest.approx(TIME, abs=1e-9)
        assert data.sensor_force.sel(sensor=7).values == pytest.approx(10.0 * (VOLTS - 0.25), abs=2e-3)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("Time (s),CH1 (pC)", "gives 'pC' for column 1, which is not a unit of a voltage or a force.*; give unit="),
        ("Time (s),CH1_mA", "gives 'mA' for column 1"),
        ("Time (s),CH1 dBV", "gives 'dBV' for column 1"),
        ("Time (s),CH1 (counts)", "gives 'counts' for column 1"),
        ("Time (s),CH1 (V) (mV)", r"gives 'CH1 \(V\) \(mV\)' for column 1"),
        ("s,A", "gives 'A' for column 1"),
        ("Vertical Units,A\nTIME,CH1", "gives 'A' for column 1"),
        ("Vertical Units,V\nTIME,CH1 (mV)", "gives .*mV.* and .*V.* for column 1"),
        ("XUnits: second\nYUnits: Ampere\nData:", "gives 'Ampere' for column 1"),
        ("time (s),Force, N", "gives 'time .*, Force, N' for column 1"),
        ("Time (10^-6 s),CH1 (V)", r"gives '10\^-6 s' for the times of column 1, .* a time.*; give time_unit="),
        ("t*1000 (s),U (V)", r"gives 't\*1000 \(s\)' for the times of column 1"),
    ],
)  # fmt: skip
def test_units_that_are_not_understood(tmp_path: Path, head: str, said: str) -> None:
    """They are refused unless the user gives a unit, which overrides them."""
    path = written(tmp_path / "scope.csv", [head, *table()])
    with pytest.raises(ValueError, match=f"scope.csv: {said}"):
        hl.read_signal(path, {7: 1}, calibration=10.0)
    with pytest.warns(hl.HertzlinkWarning, match="is used"):
        data = hl.read_signal(path, {7: 1}, calibration=10.0, unit="V", time_unit="s")
    assert hl.reflections(data, 7).incident.amplitude == pytest.approx(30.0, abs=0.01)


def test_the_unit_that_is_given_wins(tmp_path: Path) -> None:
    """The file is in ms, but its header says s."""
    path = written(tmp_path / "scope.csv", ["time (s),U (V)", *table(second=1e3)])
    with pytest.warns(hl.HertzlinkWarning, match="gives 's' for the times of column 1; 'ms' is used"):
        data = hl.read_signal(path, {7: 1}, time_unit="ms", calibration=10.0)
    assert data.time.values == pytest.approx(TIME, abs=1e-9)


@pytest.mark.parametrize(
    "head",
    ["x,Channel A", "t,a", "Date/Time,min", "Rate (Sa/s),1000000\nTime (s),CH1 (V)", "Speed: 1 MS/s\nt (s),CH1 (V)"],
)
def test_words_that_are_no_units(tmp_path: Path, head: str) -> None:
    data = hl.read_signal(written(tmp_path / "scope.csv", [head, *table()]), {7: 1}, calibration=10.0)
    assert hl.reflections(data, 7).incident.amplitude == pytest.approx(30.0, abs=0.01)


@pytest.mark.parametrize(
    ("lines", "column"),
    [
        (table("{v:.6f}"), 0),
        (["CH1,Start,Increment", "Volt,-1e-4,1e-6", *table("{v:.6f},")], 0),
        (["Sample Rate: 1 MSa/s", "CH1 (V)", *table("{v:.6f}")], 0),
        (["Samples\t1000\t1000", "Delta_X\t1E-6\t1E-6", "X_Value\tA\tB", *table("\t{v:.6f}\t0")], 1),
    ],
)  # fmt: skip
def test_files_without_times(tmp_path: Path, lines: list[str], column: int) -> None:
    """A line of the header is not a sample, although it holds numbers."""
    path = written(tmp_path / "values.csv", lines)
    with pytest.raises(ValueError, match=r"values.csv: holds no times .*; give interval=, s, such as 5e-7"):
        hl.read_signal(path, {7: column}, calibration=10.0)
    data = hl.read_signal(path, {7: column}, calibration=10.0, interval=1e-6, start=-1e-4)
    assert data.time.values == pytest.approx(TIME, abs=1e-12)
    assert data.sensor_force.sel(sensor=7).values == pytest.approx(10.0 * (VOLTS - 0.25), abs=2e-3)


@pytest.mark.parametrize("shift", [0.0, 4e-5, 1.25e-6])
def test_a_time_column_for_each_sensor(tmp_path: Path, shift: float) -> None:
    lines = [f"{t:.9f},{v:.7f},{t + shift:.9f},{v:.7f}" for t, v in zip(TIME, VOLTS, strict=True)]
    data = hl.read_signal(written(tmp_path / "two.csv", lines), {7: 1, 13: 3}, calibration=10.0)
    first, second = (hl.reflections(data, sensor).incident for sensor in (7, 13))
    assert second.arrival - first.arrival == pytest.approx(shift, abs=1e-9)


@pytest.mark.parametrize(
    "form",
    [
        "10:23:11.{micro:06d}", "11:59:59.{micro:06d} AM", "1:59:59.{micro:06d} PM", "1709287871.{micro:06d}",
        "2026-03-01T10:23:11.{micro:06d}+01:00", "28.11.2026 10:23:11.{micro:06d}", "11/28/2026 10:23:11.{micro:06d}",
    ],
)  # fmt: skip
def test_times_of_day_count_from_the_first_sample(tmp_path: Path, form: str) -> None:
    lines = [f"{form.format(micro=k + 5)};{v:.6f}" for k, v in enumerate(VOLTS)]
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "Parsing dates")
        data = hl.read_signal(written(tmp_path / "clock.csv", lines), {7: 1}, calibration=10.0)
    assert data.time.values == pytest.approx(1e-6 * np.arange(1000), abs=1e-7)
    assert float(data.time[-1] - data.time[0]) == pytest.approx(999e-6, abs=1e-8)


@pytest.mark.parametrize(("digits", "step"), [(6, 5e-7), (7, 1.5e-7), (5, 1e-6)])
def test_stamps_with_too_few_digits(tmp_path: Path, digits: int, step: float) -> None:
    time = step * np.arange(2000)
    force = np.exp(-(((time - 1e-4) / 2e-5) ** 2))
    lines = [f"{t:.{digits}f},{v:.6f}" for t, v in zip(time, force, strict=True)]
    with pytest.warns(hl.HertzlinkWarning, match="times differ by up to .* from even sampling, .* which is used"):
        data = hl.read_signal(written(tmp_path / "coarse.csv", lines), {7: 1}, calibration=10.0)
    assert float(data.time[1] - data.time[0]) == pytest.approx(step, rel=2e-3)


@pytest.mark.parametrize("word", ["9.9E+37", "-1.#IND", "OVER", "****", "", "nan", "#N/A", "inf", "∞"])
def test_samples_beyond_the_range(tmp_path: Path, word: str) -> None:
    """The incident peak is unknown, and measures that need it refuse."""
    high = VOLTS > 2.0
    lines = [f"{t},{word}" if over else f"{t},{v}" for t, v, over in zip(TIME, VOLTS, high, strict=True)]
    with pytest.warns(hl.HertzlinkWarning, match=f"sensor 7: {high.sum()} samples are lost or beyond the scope"):
        data = hl.read_signal(written(tmp_path / "over.csv", lines), {7: 1}, calibration=1.0)
    assert np.array_equal(np.isnan(data.sensor_force.sel(sensor=7)), high)
    with pytest.raises(ValueError, match=r"sensor 7: the peak at .* µs has .* clipped samples?"):
        hl.amplitude_ratio(data, 7)


def changed(number: int, text: str | None) -> list[str]:
    """A good file in which one line, counted from 1, is replaced or left out."""
    lines = ["TIME,CH1,CH2", *table("{t:.9f},{v:.6f},{v:.6f}")]
    return [*lines[: number - 1], *([] if text is None else [text]), *lines[number:]]


@pytest.mark.parametrize(
    ("lines", "said", "lost"),
    [
        (changed(102, "0.000000000,#OVERFLOW,0.1"), "1 sample is lost .*: '#OVERFLOW', the first after line 101", 1),
        (changed(102, "0.000000000"), "1 sample is lost .*: 'an empty cell', the first after line 101", 1),
        (changed(102, None), "1 sample is lost .* and NaN, the first after line 101", 1),
        (changed(102, "# a remark"), "1 line that is not a sample was left out: line 102 '# a remark'", 1),
        ([*changed(1, "t,a,b"), ",,", "# end"], "2 lines that are not samples were left out: line 1002", 0),
    ],
)
def test_a_damaged_line_is_named(tmp_path: Path, lines: list[str], said: str, lost: int) -> None:
    with pytest.warns(hl.HertzlinkWarning, match=said):
        data = hl.read_signal(written(tmp_path / "scope.csv", lines), {7: 1}, calibration=1.0)
    assert int(np.isnan(data.sensor_force).sum()) == lost
    assert data.time.values == pytest.approx(TIME, abs=1e-12)
    assert re.search(said, data.reading)


@pytest.mark.parametrize("last", ["0.000899,", "0.000899,3.1e-", "0.00089", "0.000899,0."])
def test_a_last_line_that_is_cut_off(tmp_path: Path, last: str) -> None:
    path = written(tmp_path / "scope.csv", [*table()[:-1], last], end="")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert hl.read_signal(path, {7: 1}, calibration=20.0).time.size == 999
    assert hl.read_signal(written(path, table(), end=""), {7: 1}, calibration=20.0).time.size == 1000


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([], "holds 0 lines, must hold 16 samples or more"),
        (table()[:7], "holds 7 lines"),
        (["text of any kind"] * 50, "must hold a line for each sample, with numbers in columns 1"),
        (["0,001;0,5"] * 50, "holds no times of its samples"),
        ([f"{k}e-6,1.0,2.0" for k in range(50)], "sensor 7: the signal is constant, 20 N"),
        ([f"0.1,{k}e-6,2.0" for k in range(50)], "are the columns swapped"),
        ([f"{k + (k > 25) * 0.4 * (k - 25)}e-6,{k % 7}" for k in range(50)], "holds no times of its samples"),
        ([*table()[:400], *table()[500:]], "line 401: time 400 µs after 299 µs: a gap; .* is 1 µs; write one"),
        ([*table()[:400], *table()[300:]], "line 401: time 200 µs after 299 µs, must increase"),
        ([*table(), *table()], "line 1001: .* write one file for each segment or tap"),
        ([*table()[:400], table()[399], *table()[400:]], "line 401: time 299 µs after 299 µs, must increase"),
        ([*table()[:400], *["text"] * 30, *table()[400:]], "line 401: 'text' must hold 2 columns, with numbers in"),
        (["No,V", *(f"{k},{k % 7}" for k in range(99))], "the times count the samples.*; give time_unit="),
        ([row for row in table() for _ in (0, 1)], "each time appears twice; export the trace without peak detection"),
        (['"t","U"', *(f'{k}e-6,"{k % 7 + 1},{100 + k}"' for k in range(99))], r"'1,1\d\d' may be 1\.1\d\d or 11\d\d"),
        (["Zeit (µs),Kanal 1 (V)", *commas(table("{t:.1f},{v:.6f}", 1e6))], "commas seem to separate both columns"),
        ([f"0,{k:04};{'8.894' if k % 3 else '950'}" for k in range(99)], "'8.894' may be 8.894 or 8894, beside .* ','"),
        ([f"0.{k:04};{'9.5' if k % 3 else '12,5'}" for k in range(99)], "'0.0000' may be .*, beside numbers with ','"),
        (["t (s),U (V)", *table()[::-1]], "column 0 decreases from line to line; if it is the time, it must increase"),
        ([row if k % 3 == 0 else row.split(",")[0] + ",***" for k, row in enumerate(table())], "only 334 of 1000"),
        ([*table(), "1," * 60_000], "has a line of 60001 columns"),
    ],
)  # fmt: skip
def test_what_is_no_record_is_refused(tmp_path: Path, lines: list[str], said: str) -> None:
    path = written(tmp_path / "scope.csv", lines)
    with pytest.raises(ValueError, match=said) as caught:
        hl.read_signal(path, {7: 1}, calibration=20.0)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"PK\x03\x04....", "a zip archive"), (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(99), "a binary file"),
        (bytes(range(32)) * 9, "a binary file"), (b"RIFF\x24\x50\0\0WAVEfmt " + bytes(99), "a binary file"),
    ],
)  # fmt: skip
def test_binary_files_are_refused_with_the_way_out(tmp_path: Path, content: bytes, said: str) -> None:
    (tmp_path / "trace").write_bytes(content)
    with pytest.raises(ValueError, match=f"trace: is {said}.*; export the trace as CSV"):
        hl.read_signal(tmp_path / "trace", {7: 1}, calibration=1.0)


def test_text_that_is_too_large_is_refused(tmp_path: Path) -> None:
    (tmp_path / "blank.csv").write_bytes(b"\n" * 60_000_000)
    with pytest.raises(ValueError, match="is a text of more than"):
        hl.read_signal(tmp_path / "blank.csv", {7: 1}, calibration=1.0)


@pytest.mark.thorough
def test_damaged_files_are_read_with_a_word_or_refused_in_one_line(tmp_path: Path) -> None:
    """Bytes, lines and cells are changed at random: another peak without a warning, or a raw error, is a fault."""
    drawn, path = random.Random(3), tmp_path / "scope.csv"
    for _ in range(60):
        lines = "\n".join(FORMS[drawn.choice(["plain", "pico, German", "keysight"])][0]).encode().split(b"\n")
        place = drawn.randrange(3, len(lines))
        words = [b"nan", b"OVER", b"1e5", b"", b"\xff\x00", b"# end", b'"', b";,", b"-", *lines[place - 3 : place]]
        if drawn.random() < 0.5:
            lines[place] = lines[place][: drawn.randrange(len(lines[place]) + 1)] + drawn.choice(words)
        else:
            lines[place : place + drawn.choice([0, 1, 5])] = [drawn.choice(words)]
        path.write_bytes(b"\n".join([*lines, b""]))
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                top, refused = float(hl.read_signal(path, {7: 1}, calibration=10.0).sensor_force.max()), ""
            except ValueError as error:
                refused = str(error)
        assert refused.startswith(str(path)) if refused else said or top == pytest.approx(30.0, rel=0.01)
        assert "\n" not in refused


def test_every_doubt_is_said(tmp_path: Path) -> None:
    rows = {
        "whole numbers of V; are they a digitiser's counts": table("{t:.6f},{v:.0f}", volt=50.0),
        "the waves of all sensors are negative": table(volt=-1.0),
        r"width of a wave = 0.0.*: is read as 0.0.* s": table(second=1e3),
        r"greatest force = 3e\+06: is read as 3e\+06 N": table(volt=1e5),
    }  # fmt: skip
    for said, lines in rows.items():
        with pytest.warns(hl.HertzlinkWarning, match=said):
            data = hl.read_signal(written(tmp_path / "said.csv", lines), {7: 1}, calibration=10.0)
        assert re.search(said, data.reading)
    counts = written(tmp_path / "scope.csv", table("{t:.6f},{v:.0f}", volt=50.0))  # steps of 1 mV are no counts
    assert "whole numbers" not in hl.read_signal(counts, {7: 1}, calibration=10.0, unit="mV").reading
