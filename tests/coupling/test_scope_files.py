"""Files as oscilloscopes write them: headers, units, decimal commas, encodings, saturated and coarse samples.

The forms follow what the makers' manuals describe; the numbers are our own.
"""

import re
from pathlib import Path

import numpy as np
import pytest

import hertzlink as hl
from coupling.results.binary_formats import refuse_binary

TIME = 1e-6 * np.arange(-100, 900)
VOLTS = 0.25 + sum(a * np.exp(-(((TIME - at) / 2e-5) ** 2)) for a, at in ((3.0, 1e-4), (1.2, 5e-4)))


def table(form: str, second: float = 1.0, volt: float = 1.0) -> list[str]:
    """One line for each sample."""
    return [form.format(t=t * second, v=v * volt) for t, v in zip(TIME, VOLTS, strict=True)]


def commas(lines: list[str]) -> list[str]:
    return [line.replace(".", ",") for line in lines]


def rigol() -> list[str]:
    return [f"{k},{v:.6e}," for k, v in enumerate(VOLTS)]


def tektronix() -> list[str]:
    keys = ["Record Length,1000", "Horizontal Units,s", "Vertical Units,mV"]
    return [f"{key},,{row}," for key, row in zip(keys + [","] * 1000, table("{t:.9f},{v:.6f}", 1, 1e3), strict=False)]


FORMS: dict[str, tuple[list[str], int, int]] = {
    "pico": (["Time,Channel A", "(ms),(mV)", "", *table("{t:.8f},{v:.4f}", 1e3, 1e3)], 0, 1),
    "pico, German": (["Zeit;Kanal A", "(µs);(V)", "", *commas(table("{t:.8f};{v:.6f}", 1e6))], 0, 1),
    "keysight": (["x-axis,1", "second,Volt", *table("{t:+.8E},{v:+.6E}")], 0, 1),
    "rigol": (["X,CH1,Start,Increment,", "Sequence,VOLT,-1.000000e-04,1.000000e-06", *rigol()], 0, 1),
    "tektronix, keys beside the data": (tektronix(), 3, 4),
    "tektronix": (['"Model","MSO"', '"Horizontal Units","s"', "", "TIME,CH1", *table("{t:.9f},{v:.6f}")], 0, 1),
    "lecroy": (
        ["LECROYWR,1,Waveform", "Segments,1,SegmentSize,1000", "Segment,TrigTime,TimeSinceSegment1",
         "#1,24-Nov-2020 10:23:11,0", "Time,Ampl", *table("{t:.9f},{v:.6f}")],
        0, 1,
    ),
    "tabs and decimal commas": (["Time [ms]\tA [V]", *commas(table("{t:.8f}\t{v:.6f}", 1e3))], 0, 1),
    "quotes and decimal commas": (['"t (s)","U (V)"', *commas(table('"{t:.8f}";"{v:.6f}"'))], 0, 1),
    "quotes, commas and decimal commas": (
        [line.replace(";", ",") for line in ['"t (s)";"U (V)"', *commas(table('"{t:.8f}";"{v:.6f}"'))]], 0, 1,
    ),
    "trailing commas": (["time,CH1,", *table("{t:.8f},{v:.6f},")], 0, 1),
    "t/µs": (["t/µs,CH1/mV", *table("{t:.8f},{v:.6f}", 1e6, 1e3)], 0, 1),
    "in": (["in s,C1 in mV", *table("{t:.8e},{v:.6f}", 1, 1e3)], 0, 1),
    "_us": (["time_us,CH1_uV", *table("{t:.8f},{v:.6f}", 1e6, 1e6)], 0, 1),
    "usec": (["TIME (USEC),CH1 (VOLT)", *table("{t:.8f},{v:.6f}", 1e6)], 0, 1),
    "msec": (["Zeit (msec);Kanal A [mVolt]", *commas(table("{t:.8f};{v:.6f}", 1e3, 1e3))], 0, 1),
    "min": (["Time (min),CH1 (V)", *table("{t:.12e},{v:.6f}", 1 / 60.0)], 0, 1),
    "last word": (["Time ms,Channel A", *table("{t:.8f},{v:.6f}", 1e3)], 0, 1),
    "blanks": (["# Time (us)  CH1 (mV)", *table("{t:.8f}  {v:.6f}", 1e6, 1e3)], 0, 1),
    "kV": (["Time (s),CH1 (kV) filtered", *table("{t:.9f},{v:.8f}", 1, 1e-3)], 0, 1),
    "comma before units": (["time, s,CH1, mV,CH2, mV", *table("{t:.9f},{v:.6f},0", 1, 1e3)], 0, 1),
    "typeset minus": ([row.replace("-", "−") for row in table("{t:.9f},{v:.6f}")], 0, 1),
    "decimal commas that double the columns": (["Zeit (µs),Kanal 1 (V)", *commas(table("{t:.1f},{v:.6f}", 1e6))], 0, 1),
    "thousands": (['"t (us)","ch (mV)"', *table('"{t:,.1f}","{v:,.1f}"', 1e6, 1e3)], 0, 1),
    "thousands with blanks": (
        ["t (us);ch (mV)", *commas([row.replace(",", " ") for row in table("{t:.1f};{v:,.1f}", 1e6, 1e3)])],
        0, 1,
    ),
    "exponents of Fortran": ([row.replace("e", "D") for row in table("{t:.6e} {v:.9e}")], 0, 1),
    "a counter and a time": (
        ["Sample,Time (s),CH1 (V)", *(f"{k},{row}" for k, row in enumerate(table("{t:.9f},{v:.6f}")))], 1, 2,
    ),
    "LabVIEW": (["LabVIEW Measurement", "X_Columns\tMulti", "***End_of_Header***", "X_Value\tVoltage\tComment",
                 *table("{t:.9f}\t{v:.6f}")], 0, 1),
    "interval stands alone": (["time,CH1", "Sample Interval,1e-6", *table("{t:.2f},{v:.6f}", 1e6)], 0, 1),
    "keys of each channel": (
        ["Sample Interval,0.000001", "Vertical Units,CH1:mV,CH2:V", "Source,CH1,CH2", "Time,CH1,CH2",
         *table("{t:.9f},{v:.6f},0", 1, 1e3)],
        0, 1,
    ),
    "keys with colons": (["Points:  1000", "XUnits:  second", "YUnits:  mVolt", "Data:",
                          *table("{t:.8E}, {v:.5E}", 1, 1e3)], 0, 1),
    "names that are units, too": (["t / ms,U / mV", *table("{t:.8f},{v:.6f}", 1e3, 1e3)], 0, 1),
    "blanks and names that are units": (["  Time (ms)   U (mV)", *table("  {t:.8f}   {v:.6f}", 1e3, 1e3)], 0, 1),
    "units within words": (["timeUs,mV CH1", *table("{t:.8f},{v:.6f}", 1e6, 1e3)], 0, 1),
    "a point before the unit": (["time.us,CH1.mV", *table("{t:.8f},{v:.6f}", 1e6, 1e3)], 0, 1),
    "a title above few whole numbers": (["Taps", "t (ms),U (mV)", *table("{t:.4g},{v:.4f}", 1e3, 1e3)], 0, 1),
    "bars": (["Time (s)|CH1 (V)", *table("{t:.9f}|{v:.6f}")], 0, 1),
}  # fmt: skip


@pytest.mark.parametrize(
    ("form", "encoding"),
    [
        *((form, "utf-8") for form in FORMS),
        *(("pico, German", encoding) for encoding in ("latin-1", "utf-16", "utf-16-le", "utf-8-sig")),
    ],
)
def test_forms(tmp_path: Path, form: str, encoding: str) -> None:
    lines, time_column, column = FORMS[form]
    path = tmp_path / "scope.csv"
    path.write_bytes("\r\n".join([*lines, ""]).encode(encoding))
    data = hl.read_signal(path, {7: column}, time_column=time_column, calibration=10.0)
    assert data.time.values.tolist() == hl.read_signal(path, {7: column}, calibration=10.0).time.values.tolist()
    assert data.time.values == pytest.approx(TIME, abs=1e-9)
    assert data.sensor_force.sel(sensor=7).values == pytest.approx(10.0 * (VOLTS - 0.25), abs=2e-3)
    assert float(hl.amplitude_ratio(data, 7)) == pytest.approx(0.4, abs=1e-3)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("place", [6001, 12_000])
def test_lost_byte_of_utf_16(tmp_path: Path, encoding: str, place: int) -> None:
    content = "\r\n".join([*FORMS["pico, German"][0], ""]).encode(encoding)
    path = tmp_path / "scope.csv"
    path.write_bytes(content[:place] + content[place + 1 :])
    with pytest.raises(ValueError, match="is text in UTF-16 that lost or gained a byte; export it again, as UTF-8"):
        hl.read_signal(path, {7: 1}, calibration=10.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"time_unit": "s"}, "time_unit = 's', but the header gives 'ms' for column 0"),
        ({"unit": "V"}, "unit = 'V', but the header gives 'mV' for column 1"),
    ],
)
def test_units_that_contradict_the_header(tmp_path: Path, given: dict, message: str) -> None:
    path = tmp_path / "pico.csv"
    path.write_text("\n".join([*FORMS["pico"][0], ""]))
    with pytest.raises(ValueError, match=message) as caught:
        hl.read_signal(path, {7: 1}, calibration=1.0, **given)
    assert "\n" not in str(caught.value)
    agreeing = hl.read_signal(path, {7: 1}, calibration=1.0, time_unit="ms", unit="mV")
    assert agreeing.identical(agreeing)


@pytest.mark.parametrize("word", ["inf", "OVER", "∞", "Infinity", "+inf"])
def test_saturated_samples(tmp_path: Path, word: str) -> None:
    """Above 1 V: the incident peak is unknown, and measures that need it refuse; a reflected wave below is not."""
    high = VOLTS > 2.0
    lines = [row.split(",")[0] + f",{word}" if over else row for row, over in zip(table("{t},{v}"), high, strict=True)]
    path = tmp_path / "over.csv"
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    with pytest.warns(hl.HertzlinkWarning, match=f"sensor 7: {high.sum()} samples are beyond the scope's range"):
        data = hl.read_signal(path, {7: 1}, calibration=1.0)
    assert np.array_equal(np.isnan(data.sensor_force.sel(sensor=7)), high)
    for measure in (hl.amplitude_ratio, hl.reflections, hl.time_of_flight):
        with pytest.raises(ValueError, match=r"sensor 7: the peak at .* µs has .* clipped samples?"):
            measure(data, 7)


def test_all_samples_saturated(tmp_path: Path) -> None:
    path = tmp_path / "over.csv"
    path.write_text("\n".join([*(f"{t},OVER" for t in TIME), ""]))
    with pytest.raises(ValueError, match="has numbers in column 0 only"):
        hl.read_signal(path, {7: 1}, calibration=1.0)


def test_clipped_samples_matter_only_at_the_peaks_that_are_needed() -> None:
    data = hl.as_signal(TIME, {7: VOLTS - 0.25})
    with pytest.raises(ValueError, match=r"the peak at 500 µs has .* clipped samples?"):
        hl.amplitude_ratio(data.where(abs(data.time - 4.9e-4) > 5e-6), 7)
    elsewhere = data.where(abs(data.time - 3e-4) > 5e-6)
    assert float(hl.amplitude_ratio(elsewhere, 7)) == pytest.approx(float(hl.amplitude_ratio(data, 7)), abs=1e-4)


@pytest.mark.parametrize(
    ("header", "given", "message"),
    [
        ("Time (s),CH1 (pC)", {}, "the header gives 'pC' for column 1, which is no unit of a voltage or a force"),
        ("Time (s),CH1 [A]", {}, "gives 'A' for column 1"),
        ("Time (s),CH1_mA", {}, "gives 'mA' for column 1"),
        ("Time (s),CH1 (g)", {}, "gives 'g' for column 1"),
        ("Time (s),CH1 dBV", {}, "gives 'dBV' for column 1"),
        ("Time (s),CH1 (counts)", {}, "gives 'counts' for column 1"),
        ("Time (s),CH1 (s)", {}, "gives 's' for column 1"),
        ("Time (s),CH1 (V) (mV)", {}, r"gives 'CH1 \(V\) \(mV\)' for column 1"),
        ("Time (10^-6 s),CH1 (V)", {}, "gives '10\\^-6 s' for column 0, which is no unit of a time; give time_unit="),
        ("Frequency (Hz),CH1 (V)", {}, "gives 'Hz' for column 0"),
        ("s,A", {}, "gives 'A' for column 1"),
        ("Vertical Units,A\nTIME,CH1", {}, "gives 'A' for column 1"),
        ("Vertical Units,V\nTIME,CH1 (mV)", {}, "gives .*mV.* and .*V.* for column 1"),
        ("Time (s),CH1 (bead 7)", {}, "gives 'bead 7' for column 1, .*; give unit="),
        ("Time (s),CH1 (pC)", {"unit": "V"}, "gives 'pC' for column 1"),
        ("XUnits: second\nYUnits: Ampere\nData:", {}, "gives 'Ampere' for column 1"),
        ("Units: ms mV\nTime,CH1", {}, "gives 'ms mV' for column 1"),
        ("t*1000 (s),U (V)", {}, r"gives 't\*1000 \(s\)' for column 0"),
        ("Time x1e-6 s,U (V)", {}, "gives 'Time x1e-6 s' for column 0"),
    ],
)
def test_units_that_are_refused(tmp_path: Path, header: str, given: dict, message: str) -> None:
    path = tmp_path / "scope.csv"
    path.write_text("\n".join([header, *table("{t:.9f},{v:.6f}"), ""]))
    with pytest.raises(ValueError, match=message):
        hl.read_signal(path, {7: 1}, calibration=10.0, **given)


@pytest.mark.parametrize(
    ("header", "given"),
    [
        ("Time (scaled),CH1 (bead 7)", {"time_unit": "s", "unit": "V"}),
        ("x,Channel A", {}),
        ("t,a", {}),
        ("Date/Time,min", {}),
        ("time,CH1/CH2", {"unit": "volts", "time_unit": "sec"}),
        ("Abtastrate,1 MSa/s\nTime (s),CH1 (V)", {}),
        ("Rate (Sa/s),1000000\nTime (s),CH1 (V)", {}),
        ("Speed: 1 MS/s\nTime (s),CH1 (V)", {}),
    ],
)
def test_words_that_are_no_units(tmp_path: Path, header: str, given: dict) -> None:
    path = tmp_path / "scope.csv"
    path.write_text("\n".join([header, *table("{t:.9f},{v:.6f}"), ""]))
    data = hl.read_signal(path, {7: 1}, calibration=10.0, **given)
    assert hl.reflections(data, 7).incident.amplitude == pytest.approx(30.0, abs=0.01)


@pytest.mark.parametrize(
    ("lines", "given"),
    [
        (table("{v:.6f}"), {"interval": 1e-6, "start": -1e-4}),
        (table("{v:.6f},"), {"interval": 1e-6, "start": -1e-4}),
        (["CH1,Start,Increment", "Volt,-1e-4,1e-6", *table("{v:.6f},")], {}),
        (["XInc;1e-6", "XZero;-1e-4", "CH1 (V)", *commas(table("{v:.6f};"))], {}),
        (["HResolution,1.0e-06", "HOffset,-1.0e-04", "CH1", *table("{v:.6f}")], {}),
        (["Sample Rate: 1 MSa/s", "CH1 (V)", *table("{v:.6f}")], {"start": -1e-4}),
        (["Sampling interval (us),1", "CH1 (V)", *table("{v:.6f}")], {"start": -1e-4}),
        (["Sample Interval,1,us", "CH1 (V)", *table("{v:.6f}")], {"start": -1e-4}),
        (["Delta_X\t0.000001", "X0\t-0.0001", "***End_of_Header***", "Voltage", *table("{v:.6f}")], {}),
        (["#size=1000", "CH1 (V),CH2 (V)", *table("{v:.5f},{v:.5f}")], {"interval": 1e-6, "start": -1e-4}),
        (
            ["XInc:  1E-6", "XOrg:  -1E-4", "index,U (V)", *(f"{k},{v:.6f}" for k, v in enumerate(VOLTS, 1))],
            {"column": 1},
        ),
        (
            ["Time interval :,1us", "index,U (V)", *(f"{k},{v:.6f}" for k, v in enumerate(VOLTS, 1))],
            {"column": 1, "start": -1e-4},
        ),
        (['"HResolution",1.0e-06', '"HOffset",-1.0e-04', '"VUnit","V"', *table(",{v:.6E}")], {"column": 1}),
        (
            [
                "Samples\t1000\t1000",
                "X0\t-1E-4\t-1E-4",
                "Delta_X\t1E-6\t1E-6",
                "***End_of_Header***",
                "X_Value\tA\tB",
                *table("\t{v:.6f}\t0"),
            ],
            {"column": 1},
        ),
        (["X0\t-1,0E-4\t-1,0E-4", "Delta_X\t1E-6\t1E-6", "A\tB", *commas(table("\t{v:.6f}\t0"))], {"column": 1}),
    ],
)
def test_files_without_times(tmp_path: Path, lines: list[str], given: dict) -> None:
    path = tmp_path / "values.csv"
    path.write_text("\n".join([*lines, ""]))
    given = dict(given)
    data = hl.read_signal(path, {7: given.pop("column", 0)}, calibration=10.0, **given)
    assert data.time.values == pytest.approx(TIME, abs=1e-12)
    assert data.sensor_force.sel(sensor=7).values == pytest.approx(10.0 * (VOLTS - 0.25), abs=2e-3)


def test_no_times_and_no_interval(tmp_path: Path) -> None:
    path = tmp_path / "values.csv"
    path.write_text("\n".join([*table("{v:.6f}"), ""]))
    with pytest.raises(ValueError, match=r"values.csv: holds no column of times, and no interval .*; give interval="):
        hl.read_signal(path, {7: 0}, calibration=10.0)


@pytest.mark.parametrize(
    ("head", "fault"),
    [
        (["CH1,Start,Increment", "Volt,-1e-4,1e-6e"], "Increment = '1e-6e' is no interval"),
        (["CH1,Start,Increment", "Volt,-1e-4,"], "Increment = '' is no interval"),
        (["Sample Rate: 2 MFoo", "CH1"], "Sample Rate = '2 MFoo' is no interval"),
        (["Sample Interval,1,furlong", "CH1"], "Sample Interval = '1 furlong' is no interval"),
        (["Sampling interval (kg),1", "CH1"], r"Sampling interval \(kg\) = '1' is no interval"),
        (["Sample Interval,none", "CH1"], "Sample Interval = 'none' is no interval"),
        (["XInc,-1e-6", "CH1"], "XInc = '-1e-6' is no interval"),
        (
            ["XInc,1e-6", "Sample Rate,2e6", "CH1"],
            "XInc = '1e-6' and Sample Rate = '2e6' are different intervals between samples",
        ),
    ],
)
@pytest.mark.parametrize("counter", [False, True])
def test_an_interval_that_is_not_understood(tmp_path: Path, head: list[str], fault: str, counter: bool) -> None:
    path = tmp_path / "interval.csv"
    path.write_text("\n".join([*head, *(f"{k},{v:.6f}" if counter else f"{v:.6f}" for k, v in enumerate(VOLTS)), ""]))
    with pytest.raises(ValueError, match=rf"interval.csv: the header's {fault}.*; give interval=, s, such as 5e-7"):
        hl.read_signal(path, {7: int(counter)}, calibration=10.0)


@pytest.mark.parametrize(("head", "said"), [("5e-7", "500 ns"), ("none", "'none' is no interval")])
def test_an_interval_that_differs_from_the_argument(tmp_path: Path, head: str, said: str) -> None:
    path = tmp_path / "interval.csv"
    path.write_text("\n".join([f"Sample Interval,{head}", "CH1", *table("{v:.6f}"), ""]))
    with pytest.warns(hl.HertzlinkWarning, match=said):
        data = hl.read_signal(path, {7: 0}, calibration=10.0, interval=1e-6)
    assert float(data.time[1]) == pytest.approx(1e-6)


@pytest.mark.parametrize("shift", [0.0, 4e-5, 1.25e-6])
def test_a_time_column_for_each_sensor(tmp_path: Path, shift: float) -> None:
    path = tmp_path / "two.csv"
    path.write_text("".join(f"{t:.9f},{v:.7f},{t + shift:.9f},{v:.7f}\n" for t, v in zip(TIME, VOLTS, strict=True)))
    data = hl.read_signal(path, {7: 1, 13: 3}, calibration=10.0)
    first, second = (hl.reflections(data, sensor).incident for sensor in (7, 13))
    assert second.arrival - first.arrival == pytest.approx(shift, abs=1e-9)
    assert second.amplitude == pytest.approx(first.amplitude, rel=1e-3)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (table("{t:.5f},{v:.6f}"), "stamps of time resolve 10 µs, and .* apart: even sampling is taken"),
        (
            [f"{1709287871 + t:.6f},{v}" for t, v in zip(TIME, VOLTS, strict=True)],
            "count from the first .* 1709287870.9",
        ),
        ([f"10:23:{11 + t:.6f},{v}" for t, v in zip(TIME, VOLTS, strict=True)], ""),
        ([f"11:59:{59.9995 + t:.6f} AM,{v}" for t, v in zip(TIME[:400], VOLTS[:400], strict=True)], ""),
        ([f"2024-03-01T10:23:{11 + t:.6f}+01:00,{v}" for t, v in zip(TIME, VOLTS, strict=True)], ""),
        (
            [f"{t},{50.0 * v:.0f}" for t, v in zip(TIME, VOLTS, strict=True)],
            "whole numbers of V; are they a digitiser's counts",
        ),
        ([f"{t},{v + e}" for t, v in zip(TIME, VOLTS, strict=True) for e in (-0.1, 0.1)], "each time stands twice"),
        (
            ["Sample Interval,1e-6", *table("{t:.9f},{v:.6f}", 1e3)],
            "the time is read in ms, from the header's interval",
        ),
        (["Sample Interval,5e-7", *table("{t:.9f},{v:.6f}")], r"interval of 500 ns \(.*\), but the times are 1 µs"),
        (
            ["Sample Interval,auto", *table("{t:.9f},{v:.6f}")],
            "header's Sample Interval = 'auto' is no interval that is",
        ),
        (
            ["Sample Interval,1e-6", "Sample Rate,2 MHz", *table("{t:.9f},{v:.6f}")],
            r"interval of 500 ns \(Sample Rate\), but the times are 1 µs",
        ),
        (
            ["X,CH1,Start,Increment", "Sequence,Volt,-1z-4,1e-6", *(f"{k},{v}" for k, v in enumerate(VOLTS))],
            "header's Start = '-1z-4' is not taken: the record begins at 0 s",
        ),
        (
            [
                "XZero,1e-3",
                "X,CH1,Start,Increment",
                "Sequence,Volt,-1e-4,1e-6",
                *(f"{k},{v}" for k, v in enumerate(VOLTS)),
            ],
            "header's Start = '-1e-4' is not taken: the record begins at 1 ms",
        ),
        (
            [f"{t},{v:.6f}" if abs(t) > 3e-6 else f"{t}," for t, v in zip(TIME, VOLTS, strict=True)],
            "7 samples are beyond",
        ),
        ([f"{t},{-v}" for t, v in zip(TIME, VOLTS, strict=True)], "the waves of all sensors are negative"),
        (table("{t:.9f},{v:.6f}", 1e3), r"width of a wave = 0.0.*: is read as 0.0.* s, .* mean \S+ µs or ms"),
        (table("{t:.9f},{v:.6f}", 1, 1e5), r"greatest force = 3e\+06: is read as 3e\+06 N, .* mean \S+ mN or mV"),
    ],
)
def test_what_is_said(tmp_path: Path, lines: list[str], said: str, recwarn: pytest.WarningsRecorder) -> None:
    path = tmp_path / "said.csv"
    path.write_text("\n".join([*lines, ""]))
    data = hl.read_signal(path, {7: 1}, calibration=10.0)
    assert np.diff(data.time.values) == pytest.approx(float(data.time[1] - data.time[0]), abs=1e-9)
    assert re.search(said, data.reading)
    assert "\n".join(str(one.message).removeprefix(f"{path}: ") for one in recwarn) == data.reading


@pytest.mark.parametrize("word", ["9.9E+37", "-1.#IND", "OL", "****", "", "nan", "#N/A", "1.#INF", "---"])
def test_words_in_place_of_numbers(tmp_path: Path, word: str) -> None:
    lines = [f"{t},{word}" if v > 2.0 else f"{t},{v}" for t, v in zip(TIME, VOLTS, strict=True)]
    path = tmp_path / "over.csv"
    path.write_text("\n".join([*lines, ""]))
    with pytest.warns(
        hl.HertzlinkWarning, match=f"sensor 7: {(VOLTS > 2.0).sum()} samples are beyond the scope's range"
    ):
        data = hl.read_signal(path, {7: 1}, calibration=1.0)
    assert np.array_equal(np.isnan(data.sensor_force.sel(sensor=7)), VOLTS > 2.0)


@pytest.mark.parametrize(
    ("form", "joint", "said"),
    [
        ("{t:.9f},{v:.6f}", ",", "1 line is no sample, and was left out: line 502"),
        ("{v:.6f},", "", "1 sample is beyond .* from line 502 on"),
        ("{v:.6f},{v:.6f},", "", "1 sample is beyond .* from line 502 on"),
    ],
)
def test_a_line_break_that_is_lost_is_seen(tmp_path: Path, form: str, joint: str, said: str) -> None:
    rows = table(form)
    path = tmp_path / "joined.csv"
    path.write_text("\n".join(["XInc,1e-6", *rows[:500], rows[500] + joint + rows[501], *rows[502:], ""]))
    with pytest.warns(hl.HertzlinkWarning, match=said):
        hl.read_signal(path, {7: int("t" in form)}, calibration=10.0)


def test_rows_without_values_at_the_ends(tmp_path: Path) -> None:
    lines = table("{t:.9f},{v:.6f}")
    lines[:5] = [row.split(",")[0] + "," for row in lines[:5]]
    lines[-3:] = [row.split(",")[0] + ",," for row in lines[-3:]]
    path = tmp_path / "ends.csv"
    path.write_text("\n".join([*lines, ""]))
    with pytest.warns(hl.HertzlinkWarning, match="samples without values, the first 5 and the last 3,"):
        data = hl.read_signal(path, {7: 1}, calibration=1.0)
    assert data.time.values == pytest.approx(TIME[5:-3], abs=1e-9)


def test_segments_of_a_sequence_are_taps(tmp_path: Path) -> None:
    path = tmp_path / "sequence.csv"
    noise = np.random.default_rng(1).normal(0.0, 0.05, (4, TIME.size))
    path.write_text(
        "Segments,4,SegmentSize,1000\nTime,Ampl\n"
        + "".join(f"{t:.9f},{v + e:.6f}\n" for row in noise for t, v, e in zip(TIME, VOLTS, row, strict=True))
    )
    taps = [hl.read_signal(path, {7: 1}, calibration=10.0, segment=k) for k in range(1, 5)]
    assert not np.array_equal(taps[0].sensor_force, taps[1].sensor_force)
    mean = hl.average_taps(taps)
    assert float(mean.noise.sel(sensor=7)) == pytest.approx(0.25, rel=0.1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"PK\x03\x04....", "a zip archive, not a text of samples; unpack it first"),
        (b"\x1f\x8b\x08....", "compressed by gzip, not a text of samples; unpack it first"),
        (b"\x89PNG\r\n", r"a picture \(.png\), not a text of samples; it shows the screen"),
        (
            b'<?xml version="1.0"?>\n<!-- by hand -->\n<svg width="4"/>',
            r"a picture \(.svg\), not a text of samples; it shows",
        ),
        (b'\xef\xbb\xbf<svg xmlns="x"><path d="M 0 1"/></svg>', r"a picture \(.svg\), not"),
        (b"<!DOCTYPE html>\n<html><table><tr><td>1</td></tr></table>", r"a web page \(HTML\), not"),
        ("<?xml version='1.0'?><trace><t>0</t></trace>".encode("utf-16"), "an XML file, not"),
        (b"<Waveform rate='1'>\n0.0,1.0\n</Waveform>", "an XML file, not"),
        (b'{"time": [0, 1], "force": [0, 2]}', "a JSON file, not a text of samples; read it with json"),
        (b"[[0.0, 1.0], [1e-6, 2.0]]", "a JSON file, not"),
        (b"{\\rtf1\\ansi 0,1}", r"a document \(.rtf\), not"),
        (
            b"PK\x03\x04..mimetypeapplication/vnd.oasis.opendocument.spreadsheet",
            r"a sheet of LibreOffice \(.ods\), not",
        ),
        (b"PK\x03\x04..arr_0.npy", r"arrays of numpy \(.npz\), not a text of samples; load"),
        (b"RIFF\x00\x00\x00\x00WEBPVP8", r"a picture \(.webp\), not"),
        (bytes(range(32)) * 9, r"a binary file, not a text of samples; export the trace as CSV"),
    ],
)
def test_binary_files_are_named(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "trace"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"trace: is {message}"):
        hl.read_signal(path, {7: 1}, calibration=1.0)


@pytest.mark.parametrize(
    "text", ["[Header]\nrate 1\n0,1", "[1] 5 6", "<Trace 1>\n0 1", "< 5 V\n0 1", "{0} 1", "[0 1", ""]
)
def test_a_text_with_brackets_is_no_markup(text: str) -> None:
    refuse_binary(Path("scope.csv"), text.encode())


@pytest.mark.parametrize("word", ["AG10", "BM", "PK", "Channel WAVE", "Time CH WAVE"])
def test_a_text_may_begin_as_a_binary_format_does(tmp_path: Path, word: str) -> None:
    path = tmp_path / "scope.csv"
    path.write_text("\n".join([f"{word},x", "Time (s),CH1 (V)", *table("{t:.9f},{v:.6f}")]))
    assert float(hl.amplitude_ratio(hl.read_signal(path, {7: 1}, calibration=10.0), 7)) == pytest.approx(0.4, abs=1e-3)


@pytest.mark.parametrize(("unit", "size"), [("s", 1.0), ("ms", 1e3), ("us", 1e6)])
def test_times_in_messages_have_the_unit_of_the_header(tmp_path: Path, unit: str, size: float) -> None:
    path = tmp_path / "scope.csv"
    rows = [f"{size * round(t, 5):.9g},{v:.6f}" for t, v in zip(TIME, VOLTS, strict=True)]
    path.write_text("\n".join([f"Time ({unit}),CH1 (V)", *rows]))
    with pytest.warns(hl.HertzlinkWarning, match="stamps of time resolve 10 µs, and samples are 999.8 ns apart"):
        hl.read_signal(path, {7: 1}, calibration=10.0)
    path.write_text("\n".join([f"Time ({unit}),CH1 (V)", *(f"{-size * t:.9g},0.1" for t in TIME)]))
    with pytest.raises(ValueError, match="line 3: time 99 µs after 100 µs, must increase"):
        hl.read_signal(path, {7: 1}, calibration=10.0)


def test_lost_lines_of_a_counter_are_seen(tmp_path: Path) -> None:
    lines = FORMS["rigol"][0]
    path = tmp_path / "rigol.csv"
    path.write_text("\n".join([*lines[:500], *lines[557:], ""]))
    with pytest.raises(ValueError, match=r"line 501: time 555 after 497: a gap"):
        hl.read_signal(path, {7: 1}, calibration=10.0)
