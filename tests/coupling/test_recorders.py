"""Arrays of recorders: each file is written by a library or by its published layout, and compared with the trace."""

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io
from command import ended

import hertzlink as hl
from coupling.signals.channels import Sampling
from coupling.signals.overview import overview

STEP, START = 5e-7, -1e-4
TIME = START + STEP * np.arange(1200)
VOLTS = np.round(2000.0 * sum(a * np.exp(-(((TIME - at) / 1.5e-5) ** 2)) for a, at in ((2, 1e-4), (1, 3.5e-4)))) / 1e3


def tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    stated = {"wf_increment": STEP, "wf_start_offset": START, "unit_string": "mV"}
    with nptdms.TdmsWriter(path) as file:
        file.write_segment([nptdms.ChannelObject("taps", "bead 7", 1e3 * VOLTS, stated)])


def picoscope(path: Path) -> None:
    scipy.io.savemat(path, {"A": VOLTS[:, None], "Tinterval": STEP, "Tstart": START, "Length": 1200})


def matlab_73(path: Path) -> None:
    """Layout: an HDF5 file behind a text of 512 bytes; arrays lie transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("t", TIME), ("force", VOLTS)):
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        note = file.create_dataset("note", data=np.frombuffer(b"struck by a rod of 4 mm", "u1").astype("u2")[:, None])
        note.attrs["MATLAB_class"] = np.bytes_("char")
    with open(path, "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, values in (("time", 1e6 * TIME), ("force", 1e3 * VOLTS)):
            file[f"run 1/{name}"] = values
            file[f"run 1/{name}"].attrs["units"] = "us" if name == "time" else "mV"


def workbook(path: Path) -> None:
    pytest.importorskip("openpyxl")
    pd.DataFrame({"Time (ms)": 1e3 * TIME, "Channel A (mV)": 1e3 * VOLTS}).to_excel(path, index=False)


FORMATS: dict[str, Callable[[Path], None]] = {
    "labview.tdms": tdms, "pico.mat": picoscope, "matlab73.mat": matlab_73, "hdf5.h5": hdf5, "workbook.xlsx": workbook,
    "arrays.npz": lambda path: np.savez(path, time=TIME, volts=VOLTS),
}  # fmt: skip


def read(path: Path, channel: int = 1, **given: Any) -> Any:
    return hl.read_signal(path, {7: channel}, **({"calibration": 1.0, "baseline": 0.0} | given))


@pytest.mark.parametrize("name", FORMATS)
def test_samples_and_times_are_those_that_were_written(tmp_path: Path, name: str) -> None:
    FORMATS[name](tmp_path / name)
    path = (tmp_path / name).rename(tmp_path / "recording")  # recognised by its content
    signal = read(path)
    np.testing.assert_allclose(signal.time, TIME, atol=1e-10)
    np.testing.assert_allclose(signal.sensor_force.sel(sensor=7), VOLTS, atol=1e-9)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(ValueError, match="recording") as refused:
        read(path)
    assert "\n" not in str(refused.value)


def test_channels_that_began_at_different_times(tmp_path: Path) -> None:
    """The second one is 100 µs later: by the time of day of a TDMS channel, by the times of a group of HDF5."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        for name, late in (("A", 0), ("B", 100)):
            began = np.datetime64("2026-11-28T10:00:00") + np.timedelta64(late, "us")
            stated = {"wf_increment": STEP, "wf_start_offset": 0.0, "wf_start_time": began}
            file.write_segment([nptdms.ChannelObject("taps", name, VOLTS, stated)])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"] = 2.0 * TIME  # the times of a group are nearer
        for name, late in (("A", 0.0), ("B", 1e-4)):
            file[f"{name}/time"], file[f"{name}/force"] = TIME + late, VOLTS
    for name in ("a.tdms", "a.h5"):
        with pytest.warns(hl.HertzlinkWarning, match="begin up to 100 µs apart"):
            signal = hl.read_signal(tmp_path / name, {7: 1, 13: 2}, calibration=1.0, baseline=0.0)
        first, second = (hl.reflections(signal, sensor).incident.arrival for sensor in (7, 13))
        assert second - first == pytest.approx(1e-4, abs=1e-9)


def test_what_a_file_does_not_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"force": VOLTS})
    assert float(np.diff(read(path, unit="N", calibration=None, interval=STEP).time)[0]) == pytest.approx(STEP)
    for given, message in (
        ({}, r"a\.mat: holds no times of its samples; give interval="),
        ({"channel": 2}, r"has channels 1 \(force\) …, counted from 1, and no channel 2"),
        ({"time_column": 0}, "time_column = 0: is for text"),
    ):
        with pytest.raises(ValueError, match=message):
            read(path, **given)
    scipy.io.savemat(path, {"tap": {"A": VOLTS, "t": TIME}})
    with pytest.raises(ValueError, match="without arrays of 16 or more numbers"):
        read(path)
    monkeypatch.setitem(sys.modules, "nptdms", None)
    (tmp_path / "a.tdms").write_bytes(b"TDSm\x0e\x00\x00\x00")
    with pytest.raises(ValueError, match=r"a\.tdms: is a TDMS file .* pip install 'hertzlink\[recorders\]'"):
        read(tmp_path / "a.tdms")


def test_no_file_leads_elsewhere(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "link.h5", "w") as file:
        file["force"] = h5py.ExternalLink("secret.h5", "/secret")
    np.savez(tmp_path / "objects.npz", a=np.array([{}] * 20, dtype=object))
    for name, said in (("link.h5", "links to another"), ("objects.npz", "cannot be")):
        with pytest.raises(ValueError, match=said):
            read(tmp_path / name)


def test_the_command_shows_range_clipping_hum_and_noise(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = 1e-6 * np.arange(80_000)
    pulse = 1.2 * np.exp(-(((time - 6e-2) / 1e-4) ** 2))
    noise = np.random.default_rng(1).normal(0.0, 0.002, time.size)
    volts = np.minimum(np.round(pulse + noise + 0.02 * np.sin(2 * np.pi * 50.0 * time), 3), 1.0)
    scipy.io.savemat(tmp_path / "hum.mat", {"A": volts, "Tinterval": 1e-6, "Tstart": 0.0})
    assert ended("signal", str(tmp_path / "hum.mat"), "--picture", str(tmp_path / "a.png")) == 0
    lines = capsys.readouterr().out.split("\n")
    assert lines[0] == "a file of MATLAB (.mat), 80000 samples, one every 1 µs, from 0 s to 80 ms"
    assert re.match(r"1 +A +-2\d(\.\d)? mV +1 V +1 mV +1[34]\.\d mV  50 Hz (19\.9|20|20\.1) mV$", lines[2])
    assert f"{int((volts == 1.0).sum())} samples are clipped" in lines[3]
    assert lines[4].endswith("as much as white noise would: hum or drift")
    scipy.io.savemat(tmp_path / "turned.mat", {"A": noise - pulse, "Tinterval": 1e-6, "Tstart": 0.0})
    assert overview(tmp_path / "turned.mat", Sampling()).looks[0].lead > 0.02
    assert (tmp_path / "a.png").stat().st_size > 5_000
    # A lead of zeros has neither noise nor hum; the end of a long name shows, and no line is longer than 80.
    name = "Kraft der ersten Kugel vor der Wand, 13"
    silent = np.where(time < 5e-2, 0.0, pulse) + 1e-80 * noise
    np.savetxt(tmp_path / "zero.csv", np.c_[time, silent], "%.6g", ";", header=f"Zeit / s;{name} / mV", comments="")
    assert ended("signal", str(tmp_path / "zero.csv"), "--picture", str(tmp_path / "a.png")) == 0
    lines = capsys.readouterr().out.split("\n")
    assert re.match(r"1 +Kraft.*… 13 / mV +0 V +1.2 mV +0 V +0 V +none$", lines[2])
    assert len(lines[2]) <= 80
    assert "scatters" not in "".join(lines)
    for columns, given, said in (
        ([1e3 * time, volts], [], "too coarse for contacts of beads"),
        ([time, -volts], [], "column 1: the waves are negative"),
        ([time, 0.0 * time], [], "column 1: is constant, 0 V"),
        ([time, volts], ["--interval", "1 us"], "hertzlink: --interval: "),
        ([volts], [], 'give --interval "0.5 us"'),
    ):
        np.savetxt(tmp_path / "a.csv", np.transpose(columns)[::16], delimiter=",")
        ended("signal", str(tmp_path / "a.csv"), "--picture", str(tmp_path / "a.png"), *given)
        assert said in "".join(capsys.readouterr())
