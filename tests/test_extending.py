"""The manual of extensions: each example is one file, and runs as it stands."""

import re
import runpy
from pathlib import Path

import matplotlib
import pytest

PAGE = (Path(__file__).parent.parent / "docs" / "extending.md").read_text(encoding="utf-8")
EXAMPLES = dict(re.findall(r"^## (.+?)\n.*?^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE))


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_extension_is_one_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")
    script = tmp_path / "extension.py"
    script.write_text(EXAMPLES[name], encoding="utf-8")
    runpy.run_path(str(script))


def test_every_kind_has_an_example() -> None:
    kinds = re.findall(r"^\| (an? .+?) \|", PAGE, re.MULTILINE)
    assert len(kinds) == 11
    assert {kind[0].upper() + kind[1:] for kind in kinds} == set(EXAMPLES)
