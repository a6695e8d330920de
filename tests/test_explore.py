"""The page of `hertzlink explore`: the numbers of the case, and nothing for those who do not know its token."""

import json
import os
import re
import shutil
import signal
import subprocess
import threading
import tomllib
import urllib.request
from collections.abc import Iterator
from decimal import Decimal
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pytest
from command import ended

import hertzlink as hl
from hertzlink.cases.case import read
from hertzlink.cases.tasks import task_of
from hertzlink.explore.answers import MOST_POINTS, Explorer, modes_for, thinned
from hertzlink.explore.server import Server
from hertzlink.explore.sliders import sliders_of, start_of

CASE = """
run.until = "0.4 ms"
measure.sensor = 6

[chain]
beads = 12
bead = { shape = "sphere", diameter = "4.76 mm", material = "steel 440C" }
striker = "bead"
impact_speed = "0.31 m/s"

[structure]
STRUCTURE
"""

EDGE = """kind = "half_plane"
thickness = "2.29 mm"
material = "aluminium 6061"
edge = "clamped"
distance = 0.02
"""

ROD = """kind = "rod"
layers = [{ material = "PTFE", length = "25.4 mm", diameter = "19.05 mm" }]
"""

PLATE = """kind = "kirchhoff_plate"
length = "80 mm"
width = "60 mm"
thickness = "3 mm"
material = "aluminium 6061"
supports = { left = "clamped" }
at = ["20 mm", "30 mm"]
"""


SWEEP = """
[sweep]
"structure.layers[0].material" = ["PTFE", "brass 360"]
"structure.layers[0].length" = ["1 in", "2 in"]
"chain.beads" = [12, 14]
"chain.gravity" = [9.81]
"""


def explorer_of(folder: Path, structure: str, more: str = "") -> Explorer:
    """The explorer of a case."""
    file = folder / "case.toml"
    file.write_text(CASE.replace("STRUCTURE", structure) + more)
    task = task_of(read(file, ())[0])
    start = start_of(task)
    return Explorer(start, sliders_of(task, start))


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server in a thread."""
    with Server(explorer_of(tmp_path_factory.mktemp("case"), EDGE), "an <edge>", ["a & note"]) as made:
        thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def asked(server: Server, place: str = "/answer", token: str | None = None, **values: str) -> tuple[int, Any]:
    """Status and text of an answer; with a dot in a name as two underscores."""
    given = {name.replace("__", "."): text for name, text in values.items()}
    query = urlencode(given | {"token": server.token if token is None else token})
    return got(server, f"{place}?{query}")


def got(server: Server, place: str, method: str = "GET", **headers: str) -> tuple[int, Any]:
    connection = HTTPConnection(*server.server_address[:2], timeout=60)  # type: ignore[misc]
    connection.request(method, place, headers=headers)
    reply = connection.getresponse()
    text = reply.read().decode()
    connection.close()
    return reply.status, json.loads(text) if reply.headers.get_content_type() == "application/json" else text


def test_answers_are_those_of_the_same_run_in_python(server: Server) -> None:
    status, answer = asked(
        server, structure__distance="33.3", structure__thickness="1.5", chain__impact_speed="0.4", measure__sensor="7"
    )
    assert status == 200, answer
    bead = hl.Sphere(2.38e-3, hl.STEEL_440C)
    plate = hl.half_plane(1.5e-3, hl.ALUMINIUM_6061, "clamped", 33.3e-3, until=4e-4)
    run = hl.CoSimulation(hl.Chain([bead] * 12, bead, impact_speed=0.4), plate).run(until=4e-4)
    waves = hl.reflections(run, sensor=7)
    shown = answer["waves"]["primary"]
    assert shown["amplitude_ratio"] == waves.primary.amplitude_ratio
    assert shown["time_of_flight"] == waves.primary.time_of_flight
    assert answer["waves"]["incident"] == {"amplitude": waves.incident.amplitude, "arrival": waves.incident.arrival}
    force = hl.sensor_force(run, 7)
    assert (
        dict(zip(answer["time"], answer["force"], strict=True)).items()
        <= dict(zip(force.time.values.tolist(), force.values.tolist(), strict=True)).items()
    )
    said = " ".join(answer["warnings"])
    assert "yield" in said
    assert 'kind = "jackson_green"' in said  # as a case file has it
    assert "hl." not in said


def test_the_curve_has_few_points_and_stays_the_same(server: Server) -> None:
    force = hl.sensor_force(server.explorer.case.run(), 6)
    assert force.size > 2 * MOST_POINTS
    times, values = thinned(force)
    assert times.size <= MOST_POINTS
    assert values.max() == force.max()
    off = np.abs(np.interp(force.time.values, times, values) - force.values).max()
    assert off < 2e-3 * float(force.max())
    assert thinned(force[:100])[1].size == 100
    assert thinned(0.0 * force)[1].max() == 0.0


def test_the_first_values_are_those_of_the_case(server: Server) -> None:
    waves = hl.reflections(server.explorer.case.run(), sensor=6)
    status, answer = asked(server)
    assert status == 200
    assert answer["waves"]["primary"]["amplitude_ratio"] == waves.primary.amplitude_ratio
    starts = {one["name"]: one["start"] for one in (slider.for_page() for slider in server.explorer.sliders)}
    assert starts == {
        "structure.distance": "20", "structure.thickness": "2.29", "structure.material.youngs_modulus": "68.9",
        "chain.impact_speed": "0.31", "measure.sensor": "6",
    }  # fmt: skip
    status, again = asked(server, **{name.replace(".", "__"): text for name, text in starts.items()})
    assert again["waves"] == answer["waves"]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"structure__distance": "99"}, "distance: 99 mm is outside of 5 to 60 mm"),
        ({"structure__distance": ""}, "distance: '' is not a number; give one from 5 to 60 mm"),
        ({"structure__distance": "nan"}, "'nan' is not a number"),
        ({"structure__distance": "__import__('os')"}, "is not a number"),
        ({"structure__distance": "9" * 5000}, "is not a number"),
        ({"chain__impact_speed": "0"}, "impact speed: 0 m/s is outside of 0.078 to 0.93 m/s"),
        ({"measure__sensor": "2.5"}, "sensor: '2.5' is not a whole number; give one from 1 to 12"),
        ({"measure__sensor": "13"}, "sensor: 13 is outside of 1 to 12"),
        ({"run__until": "1"}, "'run.until': there is no such slider"),
    ],
)
def test_wrong_values_give_a_message(server: Server, values: dict[str, str], message: str) -> None:
    status, answer = asked(server, **values)
    assert status == 400
    assert message in answer["error"]
    assert asked(server)[0] == 200


@pytest.mark.parametrize("error", [FloatingPointError("too fast"), RuntimeError("no\nanswer"), MemoryError()])
def test_a_failing_run_gives_a_message(server: Server, error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(self: Explorer, values: dict[str, str]) -> dict[str, Any]:
        raise error

    with monkeypatch.context() as changed:
        changed.setattr(Explorer, "answer", fails)
        status, answer = asked(server)
    assert status == 422
    assert answer["error"] == f"the run failed: {' '.join(str(error).split()) or 'MemoryError'}"
    assert asked(server)[0] == 200


@pytest.mark.parametrize("place", ["/", "/answer", "/page.js", "/../../etc/passwd"])
def test_nothing_without_the_token(server: Server, place: str) -> None:
    assert server.server_address[0] == "127.0.0.1"
    assert got(server, place)[0] == 403
    for token in ("", "x", server.token[:-1], "é"):
        assert asked(server, place, token)[0] == 403


def test_other_hosts_and_methods_are_refused(server: Server) -> None:
    place, port = f"/?token={server.token}", server.server_address[1]
    assert got(server, place, Host=f"localhost:{port}")[0] == 200
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", ""):
        assert got(server, place, Host=host)[0] == 403
    assert got(server, place, "POST")[0] == 501
    assert asked(server, "/page.js")[0] == 404
    assert got(server, place + "&a=1" * 200)[0] == 400


def test_the_page_gets_a_sketch_and_a_case_at_its_values(server: Server) -> None:
    code, sketch = asked(server, "/sketch", structure__thickness="3")
    assert code == 200
    assert "3 mm of aluminium 6061" in sketch["svg"]
    assert "<script" not in sketch["svg"]
    code, case = asked(server, "/case", structure__thickness="3")
    assert code == 200
    assert tomllib.loads(case["case"])["structure"]["thickness"] == "3 mm"
    assert asked(server, "/case", structure__thickness="1000")[0] == 400


def test_the_page_loads_nothing_and_escapes_its_words(server: Server) -> None:
    with urllib.request.urlopen(server.address) as reply:
        page, policy = reply.read().decode(), reply.headers["Content-Security-Policy"]
    nonce = re.search(r"script-src 'nonce-([^']+)'", policy)
    assert nonce is not None
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    assert re.findall(r"<(?:script|style) nonce=\"([^\"]+)\"", page) == [nonce[1]] * 3
    assert not re.search(r"(src|href)=\"(?!data:,)", page)
    assert "<h1>an &lt;edge&gt;</h1>" in page
    assert "a &amp; note" in page
    assert "eval(" not in page
    with urllib.request.urlopen(server.address) as reply:
        assert nonce[1] not in reply.headers["Content-Security-Policy"]


BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

MOVE = """
const range = document.querySelector('input[type=range][aria-label^="thickness"]');
range.value = 1.5;
range.dispatchEvent(new Event("input"));
"""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_a_slider_that_is_moved_in_a_browser_shows_another_ar(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    page, shown = server.page, []

    def moved(nonce: str) -> str:
        return page(nonce).replace("</body>", f'<script nonce="{nonce}">{MOVE}</script></body>')

    command = [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000", "--dump-dom"]
    for body in (page, moved):
        monkeypatch.setattr(server, "page", body)
        done = subprocess.run([*command, server.address], capture_output=True, text=True, timeout=120, check=True)
        (ratio,) = re.findall(r'<th scope="row">primary</th><td>([\d.]+)</td>', done.stdout)
        shown.append(float(ratio))
    expected = [asked(server, structure__thickness=text)[1]["waves"]["primary"] for text in ("2.29", "1.5")]
    assert shown == [pytest.approx(wave["amplitude_ratio"], abs=6e-5) for wave in expected]
    assert abs(shown[1] - shown[0]) > 0.01


def test_axes_of_a_sweep_are_the_sliders(tmp_path: Path) -> None:
    explorer = explorer_of(tmp_path, ROD, SWEEP)
    assert [(one.label, one.unit, str(one.low), str(one.high)) for one in explorer.sliders[1:]] == [
        ("layer 1 length", "in", "1", "2"), ("beads", "", "12", "14"),
        ("impact speed", "m/s", "0.078", "0.930"), ("sensor", "", "1", "12"),
    ]  # fmt: skip
    assert list(explorer.sliders[0].choices) == ["PTFE", "brass 360"]
    layer = "structure.layers[0]"
    changed = explorer.changed({f"{layer}.material": "brass 360", f"{layer}.length": "1.25", "chain.beads": "13"})
    layers = ("structure", "layers", 0)
    found = [changed.value(path) for path in (("chain", "beads"), ("chain", "gravity"), (*layers, "length"))]
    assert found == [13, 9.81, 1.25 * 0.0254]
    assert changed.value((*layers, "material")) == hl.BRASS_360
    with pytest.raises(ValueError, match=r"layer 1 material: 'glass' is not a choice; take one of PTFE, brass 360"):
        explorer.changed({f"{layer}.material": "glass"})


def test_moduli_of_layers_have_sliders(tmp_path: Path) -> None:
    explorer = explorer_of(tmp_path, ROD)
    assert [one.label for one in explorer.sliders[:2]] == ["layer 1 length", "layer 1 Young's modulus"]
    assert explorer.sliders[1].unit == "GPa"
    assert explorer.sliders[1].start == Decimal(repr(hl.PTFE.youngs_modulus)) / 10**9
    name = explorer.sliders[1].name
    soft, hard = (explorer.answer({name: text})["waves"]["primary"]["time_of_flight"] for text in ("0.5", "4"))
    assert soft > hard
    plate = explorer_of(tmp_path, PLATE.replace("80 mm", "80.04 mm").replace("20 mm", "60 mm"))
    assert plate.sliders[0].high == Decimal(80)  # on the plate


def test_a_basis_serves_plates_at_all_values(tmp_path: Path) -> None:
    explorer = explorer_of(tmp_path, PLATE)
    assert [one.label for one in explorer.sliders] == [
        "distance from the left edge", "thickness", "impact speed", "sensor"
    ]  # fmt: skip
    values = {"structure.at[0]": "14.5", "structure.thickness": "2.6"}
    own = explorer.answer(values)["waves"]["primary"]
    explorer.modes = modes_for(explorer.case, explorer.sliders)
    for ends in ("low", "high"):
        for i, name in enumerate(values):
            explorer.answer({name: f"{getattr(explorer.sliders[i], ends):f}"})
    shared = explorer.answer(values)["waves"]["primary"]
    assert shared != own
    assert shared["amplitude_ratio"] == pytest.approx(own["amplitude_ratio"], abs=2e-3)
    assert shared["time_of_flight"] == pytest.approx(own["time_of_flight"], abs=2e-7)


def test_the_page_says_what_the_modes_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "case.toml").write_text(CASE.replace("STRUCTURE", PLATE))
    pages = []

    def serve(server: Server) -> None:
        pages.append((server.explorer.modes, server.page("nonce")))
        raise KeyboardInterrupt

    monkeypatch.setattr(Server, "serve_forever", serve)
    assert not ended("explore", str(tmp_path / "case.toml"), "--no-browser")
    note = "All plates come from one set of modes"
    assert note in capsys.readouterr().out
    assert pages[0][0] is not None
    assert note in pages[0][1]


def test_ctrl_c_ends_it_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "case.toml").write_text(CASE.replace("STRUCTURE", EDGE))
    pages = []

    def browser(address: str) -> None:
        with urllib.request.urlopen(address) as reply:  # it serves
            pages.append(reply.read().decode())
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("webbrowser.open", browser)
    # A shell starts jobs in the background with this signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        code = ended("explore", str(tmp_path / "case.toml"), "--set", "structure.thickness=2 mm")
    finally:
        signal.signal(signal.SIGINT, before)
    said = capsys.readouterr()
    assert not code
    assert re.fullmatch(r"open http://127\.0\.0\.1:\d+/\?token=[\w-]{32}\nCtrl-C ends it\nended\n", said.out)
    assert said.err == ""
    assert '"start": "2"' in pages[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [("structure.thickness=-1 mm", "structure.thickness: "), ("measure.sensor=13", "measure.sensor: 13 is not a bead")],
)
def test_a_wrong_case_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: str, message: str
) -> None:
    (tmp_path / "case.toml").write_text(CASE.replace("STRUCTURE", EDGE))
    code = ended("explore", str(tmp_path / "case.toml"), "--no-browser", "--set", change)
    said = capsys.readouterr()
    assert code == 2
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""


def test_a_port_in_use_is_named(server: Server, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "case.toml").write_text(CASE.replace("STRUCTURE", EDGE))
    port = str(server.server_address[1])
    code = ended("explore", str(tmp_path / "case.toml"), "--no-browser", "--port", port)
    assert code == 2
    assert f"--port {port}: cannot be used" in capsys.readouterr().err
