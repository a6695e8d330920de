"""Files as oscilloscopes write them: headers, units, decimal commas, encodings, saturated and coarse samples.

The forms follow what the makers' manuals describe; the numbers are our own.
"""

from pathlib import Path

import numpy as np
import pytest

import hertzlink as hl

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
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-16", "utf-16-le", "utf-8-sig"])
def test_forms(tmp_path: Path, form: str, encoding: str) -> None:
    lines, time_column, column = FORMS[form]
    path = tmp_path / "scope.csv"
    path.write_bytes("\r\n".join([*lines, ""]).encode(encoding))
    data = hl.read_signal(path, {7: column}, time_column=time_column, calibration=10.0)
    assert data.time.values == pytest.approx(TIME, abs=1e-9)
    assert data.sensor_force.sel(sensor=7).values == pytest.approx(10.0 * (VOLTS - 0.25), abs=2e-3)
    assert float(hl.amplitude_ratio(data, 7)) == pytest.approx(0.4, abs=1e-3)


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
        with pytest.raises(ValueError, match=r"sensor 7: .* samples of the peak at .* µs are clipped"):
            measure(data, 7)


def test_all_samples_saturated(tmp_path: Path) -> None:
    path = tmp_path / "over.csv"
    path.write_text("\n".join([*(f"{t},OVER" for t in TIME), ""]))
    with pytest.raises(ValueError, match="only 0 of 1000 samples are within the scope's range"):
        hl.read_signal(path, {7: 1}, calibration=1.0)


def test_clipped_samples_matter_only_at_the_peaks_that_are_needed() -> None:
    data = hl.as_signal(TIME, {7: VOLTS - 0.25})
    with pytest.raises(ValueError, match="samples of the peak at 500 µs are clipped"):
        hl.amplitude_ratio(data.where(abs(data.time - 4.9e-4) > 5e-6), 7)
    elsewhere = data.where(abs(data.time - 3e-4) > 5e-6)
    assert float(hl.amplitude_ratio(elsewhere, 7)) == pytest.approx(float(hl.amplitude_ratio(data, 7)), abs=1e-4)
