"""The documentation site: the lines of its pages run, and the files that they name exist. CI builds it."""

import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import matplotlib
import pytest

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))


def blocks(name: str) -> list[str]:
    text = (DOCS / name).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def numbers(text: str) -> list[float]:
    return [float(one) for one in re.findall(r"-?\d+\.\d+", text)]


def shown(name: str) -> list[str]:
    """The output that a page shows for its lines."""
    return re.findall(r"^```text\n(.*?)^```", (DOCS / name).read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def run_all(lines: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All lines form one script, so that its functions can be sent to other processes, and named in a store."""
    monkeypatch.chdir(folder)
    matplotlib.use("Agg")
    exec(compile("\n".join(lines), "page.py", "exec"), {"__name__": "page"})


def test_the_first_three_steps_of_the_tutorial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    steps = blocks("tutorial.md")
    assert len(steps) == 7
    run_all(steps[:4], tmp_path, monkeypatch)
    expected = numbers("".join(shown("tutorial.md")[:3]))
    assert len(expected) == 9
    assert numbers(capsys.readouterr().out) == pytest.approx(expected, rel=5e-3)


@pytest.mark.thorough
def test_the_whole_tutorial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The edge is where it was put; its value and interval are those of the page, within a tenth of the interval."""
    run_all(blocks("tutorial.md"), tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    assert shown("tutorial.md")[3].strip() in printed
    found, said = (
        numbers(next(line for line in text.splitlines() if line.startswith("distance  ")))
        for text in (printed, shown("tutorial.md")[4])
    )
    assert found[:3] == pytest.approx(said[:3], abs=3e-5)
    assert found[1] < 0.06 < found[2]
    assert "the model explains the signal" in printed


@pytest.mark.parametrize(
    ("name", "which"), [("theory.md", slice(None)), ("coupling.md", slice(3)), ("python.md", slice(2, None))]
)
def test_the_lines_of_a_page_run(name: str, which: slice, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first blocks of python.md are run by test_examples.py; later ones of coupling.md are not scripts."""
    lines = blocks(name)[which]
    assert len(lines) >= 3
    run_all(lines, tmp_path, monkeypatch)


def test_the_question_of_the_first_trace_is_that_of_its_template() -> None:
    from hertzlink.cases import templates

    (question,) = re.findall(r"^```toml\n(.*?)^```", (DOCS / "first_trace.md").read_text(encoding="utf-8"), re.S | re.M)
    assert question in "".join(path.read_text("utf-8") for path in Path(templates.__file__).parent.glob("*.toml"))


@pytest.mark.thorough
def test_the_fit_of_the_first_trace(tmp_path: Path, command: Callable[..., str]) -> None:
    """Values and intervals are those of the page, within a tenth of the interval."""
    command("new", "identify")
    assert shown("first_trace.md")[0].splitlines()[2] in command("signal", "identify.csv")
    said, page = command("identify", "identify.toml", "identify.csv"), shown("first_trace.md")[1]
    assert page.partition("\nnote: ")[2] in said
    for name in ("structure.thickness", "structure.distance", "gain 13"):
        found, told = (numbers(next(line for line in text.splitlines() if name in line)) for text in (said, page))
        assert found[:3] == pytest.approx(told[:3], rel=1e-3)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_files_of_a_page_are_there(page: Path) -> None:
    """In the repository; on the site, links to examples lead to the gallery, which a build makes."""
    text = page.read_text(encoding="utf-8")
    for link in re.findall(r"\]\((?!https?:|#)([^)#]+)[^)]*\)", text):
        assert link.startswith(("gallery/", "reference/")) or (DOCS / link).exists(), link
    for file in re.findall(r"`((?:tests|benchmarks|examples|plates|hertzlink)/[\w/]+\.\w+)`", text):
        assert (ROOT / file).is_file(), file


def test_the_gallery_knows_its_examples(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "site"))
    import gallery_pages

    scripts = {path.stem for path in (ROOT / "examples").glob("*.py")}
    assert not set(gallery_pages.RUN) & set(gallery_pages.SLOW)
    assert set(gallery_pages.RUN) | set(gallery_pages.SLOW) == scripts
    gallery_pages.write(ROOT / "examples", tmp_path)
    for name in scripts:
        page = (tmp_path / f"{name}.py").read_text(encoding="utf-8")
        compile(page, name, "exec")
        stored = gallery_pages.STORED / f"{name}.png"
        assert (f"/site/stored/{name}.png" in page) == stored.is_file() == (name in gallery_pages.SLOW)


def test_stored_output_of_the_gallery_is_that_of_the_examples(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same numbers as those that the tests of the examples expect; each example has a picture of its own."""
    from test_examples import NUMBERS

    monkeypatch.syspath_prepend(str(DOCS / "site"))
    import gallery_pages

    for name in gallery_pages.SLOW:
        text = (gallery_pages.STORED / f"{name}.txt").read_text(encoding="utf-8")
        expected, tolerance = NUMBERS[f"{name}.py"]
        found = [float(number) for number in re.findall(r"(?<![\w.])\d+\.\d+", text)]
        assert found[: len(expected)] == pytest.approx(expected, rel=tolerance), name
    pictures = {path.read_bytes() for path in gallery_pages.STORED.glob("*.png")}
    assert len(pictures) == len(gallery_pages.SLOW)


def test_every_public_name_has_a_page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import hertzlink as hl
    from hertzlink._names import namespaces

    monkeypatch.syspath_prepend(str(DOCS / "site"))
    import reference_pages

    reference_pages.write(tmp_path / "reference")
    pages = {path.name.removesuffix(".rst") for path in (tmp_path / "reference").iterdir()}
    inner = {f"{space}.{name}" for space, names in namespaces().items() for name in names}
    assert pages == {"index", *hl.__all__, *inner} - set(namespaces())


def test_a_broken_link_of_a_built_site_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "site"))
    import links

    (tmp_path / "one.html").write_text('<a href="two.html#there">x</a><a href="https://elsewhere.org/nowhere">y</a>')
    (tmp_path / "two.html").write_text('<p id="there"><a href="one.html">x</a>')
    assert list(links.broken(tmp_path)) == []
    (tmp_path / "two.html").write_text('<p><a href="three.html">x</a>')
    assert sorted(links.broken(tmp_path)) == [
        "one.html: two.html#there has no such place",
        "two.html: three.html leads nowhere",
    ]


def test_what_is_cited_is_this_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {project['version']}\n" in citation
    assert f"\nlicense: {project['license']}\n" in citation
    assert f"version = {{{project['version']}}}" in (DOCS / "citing.md").read_text(encoding="utf-8")
