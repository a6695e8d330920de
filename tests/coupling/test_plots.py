"""Plots of results: what is drawn, with its units and words; not pixels."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib import pyplot
from matplotlib.axes import Axes

import hertzlink as hl
from coupling.inference.identification import Identification

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
WALL = hl.half_space(hl.STEEL_440C)


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    backend = matplotlib.get_backend()
    pyplot.switch_backend("Agg")
    yield
    pyplot.close("all")
    pyplot.switch_backend(backend)


def words(ax: Axes) -> list[str]:
    legend = ax.get_legend()
    return [] if legend is None else [" ".join(text.get_text().split()) for text in legend.get_texts()]


def line(ax: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    (found,) = [one for one in ax.lines if str(one.get_label()).startswith(label)]
    return np.asarray(found.get_xdata(), dtype=float), np.asarray(found.get_ydata(), dtype=float)


@cache
def run() -> xr.Dataset:
    chain = hl.Chain([BEAD] * 14, BEAD, 0.3, dissipation=hl.LinearDashpot(5.0))
    rod = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.5e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.5e-3)], elements=20)
    return hl.CoSimulation(chain, rod).run(until=8e-4)


@cache
def found() -> Identification:
    def build(modulus: float, speed: float) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, speed), hl.half_space(hl.Material(modulus, 0.3, 2000.0)))

    tap = build(3e9, 0.3).run(5e-4)
    noise = np.random.default_rng(1).normal(0.0, 0.2, (2, tap.time.size))
    forces = {n: hl.sensor_force(tap, n).values + one for n, one in zip((4, 6), noise, strict=True)}
    ranges = {"modulus": (1e9, 10e9), "speed": (0.2, 0.4)}
    guess = {"modulus": 3e9, "speed": 0.3}
    return hl.identify(hl.as_signal(tap.time, forces), build, noise=0.2, nuisances=["gain"], guess=guess, **ranges)


def sweep(until: float = 5e-4) -> xr.Dataset:
    def against(modulus: float, preload: float) -> hl.CoSimulation:
        chain = hl.Chain([BEAD] * 14, BEAD, 0.1, preload=preload)
        return hl.CoSimulation(chain, hl.half_space(hl.Material(modulus, 0.3, 2000.0)))

    return hl.sweep(against, until=until, jobs=1, modulus=[1e8, 2e10, 2e11], preload=[1.0, 5.0])


def signal() -> xr.Dataset:
    return hl.as_signal(np.arange(50) * 1e-6, {1: np.sin(np.arange(50) / 16.0)})


def test_traces_show_force_and_waves_in_words() -> None:
    ax, waves = hl.plots.traces(run(), [7, 7]), hl.reflections(run(), 7)
    time, force = line(ax, "force at bead 7")
    np.testing.assert_allclose(time, 1e6 * run().time)
    np.testing.assert_allclose(force, hl.sensor_force(run(), 7))
    for name, wave in (("incident", waves.incident), ("primary", waves.primary)):
        assert np.ravel(line(ax, f"{name} wave")).tolist() == pytest.approx([1e6 * wave.arrival, wave.amplitude])
    tof = 1e6 * waves.primary.time_of_flight
    assert f"AR = {waves.primary.amplitude_ratio:.4f}, TOF = {tof:.2f} µs" in next(
        w for w in words(ax) if "primary" in w
    )
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time (µs)", "force (N)")


def test_forces_of_a_preloaded_chain_are_above_the_preload() -> None:
    held = hl.CoSimulation(hl.Chain([BEAD] * 14, BEAD, 0.1, preload=1.0), hl.half_space(hl.PTFE))
    assert hl.plots.traces(held.run(1e-4)).get_ylabel() == "force above the preload (N)"


def test_a_missing_wave_is_named_with_its_reason() -> None:
    short = run().sel(time=slice(None, 3e-4))
    ax = hl.plots.traces(short, [7, 9])
    reason = hl.reflections(short, 7).primary.reason
    # Python needs seconds, a reader does not.
    until = re.search(r"until = (\S+) \((.*)\)", reason)
    assert until is not None
    assert float(until[1]) == pytest.approx(1e-6 * float(until[2].removesuffix(" µs")))
    assert f"bead 7, primary wave: none; {reason.replace(until[0], f'until = {until[2]}')}" in words(ax)
    assert line(ax, "bead 7, primary wave")[0].size == 0


def test_a_signal_shows_all_its_sensors_and_names_a_clipped_peak() -> None:
    signal = hl.as_signal(run().time, {n: hl.sensor_force(run(), n) for n in (6, 8)})
    force = signal.sensor_force
    signal["sensor_force"] = force.where((force.sensor != 8) | (force < 0.8 * force.max("time")))
    ax = hl.plots.traces(signal)
    assert {"force at bead 6", "force at bead 8"} <= set(words(ax))
    assert any(one.startswith("bead 8, no AR and TOF: run: sensor 8") and "clipped" in one for one in words(ax))


def test_map_keeps_the_peaks_of_long_records_and_shows_weak_echoes() -> None:
    ax = hl.plots.contact_map(run())
    mesh = ax.collections[0]
    shown = np.asarray(mesh.get_array())
    assert shown.shape[0] == run().sizes["contact"]
    assert shown.shape[1] <= 1200 < run().sizes["time"]
    np.testing.assert_allclose(shown.max(axis=1), run().contact_force.max("time"))
    assert ax.get_ylim()[0] > ax.get_ylim()[1]  # the structure is below
    assert [one.get_ylabel() for one in ax.get_figure().axes[1:]] == ["contact force (N)"]
    # A hundredth of the greatest force, a weak echo, takes a tenth of the scale.
    assert mesh.norm(0.01 * float(run().contact_force.max())) == pytest.approx(0.1)


def test_energies_add_up_to_the_impact_energy() -> None:
    ax = hl.plots.energy(run())
    assert ax.get_ylabel() == "energy (µJ)"
    parts = [line(ax, one)[1] for one in ("motion", "contacts", "lost in the chain", "in the structure")]
    _, total = line(ax, "sum")
    np.testing.assert_allclose(sum(parts), total, atol=1e-9)
    np.testing.assert_allclose(total, 1e6 * 0.5 * BEAD.mass * 0.3**2, rtol=1e-4)


def test_swept_values_have_units_and_missing_ones_a_reason() -> None:
    runs = sweep()
    ratio = hl.amplitude_ratio(runs, 7)
    assert ratio.isnull().any()
    ax = hl.plots.swept(runs, 7)
    assert ax.get_xlabel() == "modulus (GPa)"
    assert ax.get_ylabel() == "amplitude ratio AR"
    for preload in (1.0, 5.0):
        x, y = line(ax, f"preload {preload:g} N")
        np.testing.assert_allclose(x, [0.1, 20.0, 200.0])
        np.testing.assert_array_equal(y, ratio.sel(preload=preload))
    crosses = [one for one in ax.lines if one.get_marker() == "x"]
    assert sum(len(one.get_xdata()) for one in crosses) == int(ratio.isnull().sum())
    assert any("the record ends at 500 µs" in one for one in words(ax))
    assert "TOF (µs)" in hl.plots.swept(runs, 7, "time_of_flight", over="preload").get_ylabel()


def test_swept_takes_measured_values_and_names() -> None:
    data = xr.Dataset({"secondary_amplitude_ratio": ("wall", [np.nan, 0.3])}, {"wall": ["steel", "PTFE"]})
    ax = hl.plots.swept(data, wave="secondary")
    assert [one.get_text() for one in ax.get_xticklabels()] == ["steel", "PTFE"]
    np.testing.assert_array_equal(line(ax, "secondary wave")[1], [np.nan, 0.3])
    assert ax.get_legend().get_title().get_text() == ""  # not the words of the curve again
    assert "no secondary wave: no such wave was found (1 point)" in words(ax)


@pytest.mark.parametrize(
    ("name", "attrs", "label"),
    [
        ("layer_youngs_modulus", {}, "layer Young's modulus (GPa)"),
        ("poisson_ratio", {}, "Poisson's ratio"),
        ("x", {"units": "m", "long_name": "distance from the edge"}, "distance from the edge (Gm)"),
    ],
)
def test_labels_of_axes_are_words(name: str, attrs: dict[str, str], label: str) -> None:
    data = xr.Dataset({"amplitude_ratio": (name, [0.9, 0.5]), "secondary_amplitude_ratio": (name, [0.1, 0.2])})
    data = data.assign_coords({name: (name, [1e9, 2e9], attrs)})
    ax = hl.plots.swept(data)
    assert ax.get_xlabel() == label
    assert ax.get_ylim()[1] > 1.05 * 0.9  # the highest marker is not cut
    np.testing.assert_array_equal(line(hl.plots.swept(data, wave="secondary"), "secondary wave")[1], [0.1, 0.2])


def test_a_legend_of_many_kinds_of_beads_and_layers_is_short_and_inside_its_figure() -> None:
    long = hl.Material(2e11, 0.3, 7800.0, "steel of the second batch, tempered twice, ground and polished by hand")
    beads = [hl.Sphere(1e-3 * size, long if size == 3 else hl.STEEL_440C) for size in range(2, 20)]
    rod = hl.rod([hl.Layer(hl.PTFE, 1e-3 * length, 9.5e-3) for length in range(1, 9)], elements=1)
    ax = hl.plots.setup(hl.CoSimulation(hl.Chain(beads, BEAD, 0.1), rod))
    assert {"12 other kinds of beads", "PTFE, 36 mm long in 8 layers"} <= set(words(ax))
    assert len(words(ax)) == 10
    figure: Any = ax.get_figure()
    figure.canvas.draw()
    box = ax.get_legend().get_window_extent()
    assert box.y0 >= 0.0
    assert box.x1 <= figure.bbox.width


def test_setup_of_chains_on_a_plate_shows_it_once_from_the_front() -> None:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    plate = hl.kirchhoff_plate(0.3, 0.2, 3e-3, hl.PTFE, hl.Supports(left="clamped"), cells=(4, 4))
    both = plate.at([0.1, 0.2], [0.1, 0.1])
    ax = hl.plots.setup(hl.CoSimulation([hl.Chain([bead] * 12, bead, 0.1)] * 2, both))
    edges = [one for one in ax.lines if one.get_linewidth() in (0.9, 3.0) and len(one.get_ydata()) == 2]
    assert len(edges) == 4
    places = {"contact of chain 0 at (100, 100) mm", "contact of chain 1 at (200, 100) mm"}
    assert places | {"edge: clamped", "edge: free"} <= set(words(ax))
    named = [one for one in ax.texts if one.get_text().startswith("chain ")]
    left = ax.get_xlim()[0]
    assert len(named) == 2
    assert all(one.get_ha() == "left" and one.get_position()[0] >= left for one in named)


def test_setup_of_a_rod_is_to_scale() -> None:
    ax = hl.plots.setup(run())
    layers = [one for one in ax.patches if type(one).__name__ == "Rectangle"]
    assert [one.get_width() for one in layers[:2]] == pytest.approx([6.35, 25.4])
    assert [one.get_height() for one in layers[:2]] == pytest.approx([19.0, 19.0])
    beads = [one for one in ax.patches if type(one).__name__ == "Ellipse"]
    assert len(beads) == 15  # with the striker
    assert max(one.center[0] + 0.5 * one.width for one in beads) == pytest.approx(0.0)
    assert {"14 × sphere, 9.52 mm, steel 440C", "base: fixed", "PTFE, 25.4 mm long, radius 9.5 mm"} <= set(words(ax))
    assert ax.get_aspect() == 1.0


def test_setup_before_and_after_a_run_is_the_same() -> None:
    coupled = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3), WALL)
    assert words(hl.plots.setup(coupled)) == words(hl.plots.setup(coupled.run(until=2e-5)))


def test_setup_shows_outline_supports_and_contact() -> None:
    chain = hl.Chain([BEAD] * 60, BEAD, 0.3)
    supports = hl.Supports(left="clamped", top="simple")
    plate = hl.kirchhoff_plate(0.1, 0.08, 2e-3, hl.ALUMINIUM_6061, supports, cells=(5, 4))
    ax = hl.plots.setup(hl.CoSimulation(chain, plate.at(0.05, 0.02)))
    said = words(ax)
    assert {"edge: clamped", "edge: simple", "edge: free", "contact at (50, 20) mm"} <= set(said)
    panel = hl.Outline([(0, 0), (0.3, 0), (0, 0.2)], holes=[[(0.05, 0.05), (0.08, 0.05), (0.05, 0.08)]])
    ax = hl.plots.setup(
        hl.CoSimulation(chain, hl.mindlin_panel(panel, 2e-3, hl.PTFE, {}, highest_frequency=1e4).at(0.1, 0.05))
    )
    assert any(one.startswith("right: seen along the chain, 300 × 200 mm") for one in words(ax))


class LongBall(hl.Sphere):
    """A ball whose length says nothing of its shape."""

    length, axis = 0.02, "across"


STRUCTURES: dict[str, tuple[Callable[[], Any], str]] = {
    "nothing": (lambda: None, "the last bead faces nothing"),
    "half-space": (lambda: WALL, "half-space of steel 440C"),
    "half-plane": (
        lambda: hl.half_plane(2e-3, hl.PTFE, "clamped", 0.03, until=1e-4, highest_frequency=2e4),
        "edge: clamped, 30 mm from the contact",
    ),
    "beam": (
        lambda: hl.beam(0.3, 20.0, 0.8, hl.STEEL_440C, 0.1),
        "beam of steel 440C, 300 mm long, ends simple, struck at 100 mm; thickness of a rectangular section",
    ),
    "laminate": (
        lambda: hl.infinite_plate(None, hl.Laminate([hl.Ply(hl.PTFE, 1e-3), hl.Ply(hl.MATERIALS["nylon"], 2e-3)])),
        "infinite plate, 3 mm of PTFE, nylon",
    ),
    "infinite plate": (lambda: hl.infinite_plate(2e-3, hl.PTFE), "contact; the plate continues beyond the picture"),
    "own": (
        lambda: hl.Structure([[1.0]], [[1e7]], None, [1.0], 0.0, hl.Surface(hl.PTFE)),
        "structure, whose size is not known",
    ),
}


@pytest.mark.parametrize("name", STRUCTURES)
def test_setup_of_each_structure_says_what_it_is(name: str) -> None:
    build, said = STRUCTURES[name]
    shapes = [hl.HollowSphere(5e-3, 4e-3, hl.PTFE), hl.Cylinder(2e-3, 8e-3, hl.PTFE), LongBall(5e-3, hl.PTFE)]
    chain = hl.Chain([BEAD, *shapes], BEAD, 0.3)
    shown = words(hl.plots.setup(hl.CoSimulation(chain, build())))
    assert said in shown
    # A user's bead has the name of its class.
    assert "1 × long ball, 10 mm, PTFE" in shown
    assert "1 × hollow sphere, 10 mm, wall 1 mm, PTFE" in shown
    assert "1 × cylinder, 4 mm × 8 mm, PTFE" in shown


def test_setup_draws_a_bead_of_ones_own_by_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Discs 9 mm thick, 31 mm wide: twenty are 180 mm long, also of a class added to the package or without fields."""

    @dataclass(frozen=True)
    class Disc(hl.Bead):
        radius: float
        thickness: float

        mass = 0.05
        surface = hl.Surface(hl.STEEL_316, 20.0)

        @property
        def size(self) -> float:
            return self.thickness

    plain = SimpleNamespace(mass=0.05, size=9e-3, surface=Disc.surface)
    added: Any = type("Added", (Disc,), {})
    monkeypatch.setattr("particles.bead.SHAPES", (added,))
    for disc, tall in ((Disc(15.5e-3, 9e-3), 31.0), (added(15.5e-3, 9e-3), 31.0), (plain, 9.0)):
        ax = hl.plots.setup(hl.CoSimulation(hl.Chain([disc] * 20, None, 0.1), WALL))
        beads = [one for one in ax.patches if type(one).__name__ == "Ellipse"]
        assert min(one.center[0] - 0.5 * one.width for one in beads) == pytest.approx(-180.0)
        assert [one.height for one in beads] == pytest.approx([tall] * 20)


def test_fit_and_residual_are_those_of_the_result() -> None:
    for given in (found(), found().to_dataset()):
        ax = hl.plots.identified(given, sensor=6)
        np.testing.assert_array_equal(line(ax, "measured at bead 6")[1], found().data.measured.sel(sensor=6))
        np.testing.assert_array_equal(line(ax, "fitted")[1], found().data.fitted.sel(sensor=6))
    ax = hl.plots.identified(found(), "residual")
    at = found().data.sel(sensor=4)
    np.testing.assert_allclose(line(ax, "residual at bead 4")[1], at.residual / at.noise)


def test_intervals_are_halves_in_percent() -> None:
    ax = hl.plots.identified(found(), "intervals")
    ends = [bar.get_x() + bar.get_width() for bar in ax.patches]
    assert ends == pytest.approx([100.0 * one.error / abs(one.value) for one in found().unknowns.values()])
    labels = [one.get_text() for one in ax.get_yticklabels()]
    assert labels[0].startswith("modulus\n3")
    low, high = found()["modulus"].interval
    assert labels[0].endswith(f"{low:.4g} to {high:.4g}, identified")
    blind = found().to_dataset()
    blind["verdict"] = blind.verdict.where(blind.unknown != "modulus", "blind")
    label = hl.plots.identified(blind, "intervals").get_yticklabels()[0].get_text()
    assert label == f"modulus\n{low:.4g} to {high:.4g}, blind"


def test_correlations_are_written_in_the_matrix() -> None:
    ax = hl.plots.identified(found(), "correlation")
    np.testing.assert_array_equal(ax.images[0].get_array(), found().correlation)
    assert len(ax.texts) == found().correlation.size


def test_given_axes_are_used_and_keep_their_size() -> None:
    figure, ax = pyplot.subplots(figsize=(5.0, 3.0))
    for draw, given in (("traces", run()), ("setup", run()), ("energy", run()), ("identified", found())):
        assert getattr(hl.plots, draw)(given, ax=ax) is ax
    assert tuple(figure.get_size_inches()) == (5.0, 3.0)


BAD: list[tuple[str, Callable[[], Any], str]] = [
    ("no dataset", lambda: hl.plots.traces(5), "run = 5"),
    ("no sensor", lambda: hl.plots.traces(run(), 99), "sensor = 99"),
    ("no sensors", lambda: hl.plots.traces(run(), []), "sensors = "),
    ("text", lambda: hl.plots.traces(run(), "7"), "sensors = '7'"),
    ("trace of a sweep", lambda: hl.plots.traces(sweep(2e-5), 7), "modulus"),
    ("no axes", lambda: hl.plots.energy(run(), ax="here"), "ax = 'here'"),
    ("map of a signal", lambda: hl.plots.contact_map(signal()), "signal"),
    ("map of a sweep", lambda: hl.plots.contact_map(sweep(2e-5)), "modulus"),
    ("energy of a signal", lambda: hl.plots.energy(signal()), "signal"),
    ("energy of a sweep", lambda: hl.plots.energy(sweep(2e-5)), "modulus"),
    ("one run swept", lambda: hl.plots.swept(run(), 7), "none; must have one or two"),
    ("which sensor", lambda: hl.plots.swept(sweep(2e-5)), "sensor = None"),
    ("no sensor", lambda: hl.plots.swept(sweep(2e-5), np.array([])), "sensor = "),
    ("measure", lambda: hl.plots.swept(sweep(2e-5), 7, "ar"), "measure = 'ar'"),
    ("over", lambda: hl.plots.swept(sweep(2e-5), 7, over="length"), "over = 'length'"),
    ("wave", lambda: hl.plots.swept(sweep(2e-5), 7, wave="fourth"), "wave = 'fourth'"),
    ("set-up of a signal", lambda: hl.plots.setup(signal()), "run: must be a CoSimulation, or the Dataset"),
    ("set-up of a chain", lambda: hl.plots.setup(BEAD), "must be a CoSimulation"),
    ("fit of a run", lambda: hl.plots.identified(run()), "must be the result of identify"),
    ("fit elsewhere", lambda: hl.plots.identified(found(), sensor=5), "sensor = 5"),
    ("class", lambda: hl.plots.identified(Identification, "intervals"), "must be the result of identify"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "message"), [one[1:] for one in BAD], ids=[one[0] for one in BAD])
def test_bad_input_is_named(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message.replace("(", r"\(")):
        call()
    assert pyplot.get_fignums() == [], "a figure that nobody uses is left"
