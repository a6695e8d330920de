"""Compiled kernels are kept in files, and are never stale. A copy of hertzlink's sources has kernels of one line."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import structures

COMPILES, EACH_TIME = "compiling kernels that this machine", "compiling kernels for pieces that are not hertzlink's"

LOOP = """
from structures.kernels.compiling import entry, inner
from structures.kernels.pieces import by_type

@by_type
def force(law, i, overlap):
    raise NotImplementedError

@inner()
def pressed(chain, overlap):
    return force(chain[0], 0, overlap)

@entry
def loop(chain, overlap):
    return pressed(chain, overlap)
"""

LAW = """
from typing import NamedTuple

class Law(NamedTuple):
    stiffness: float

    @staticmethod
    def force(law, i, overlap):
        return law.stiffness * overlap
"""

MAIN = """
import subprocess
import sys
from coupling.kernels.loop import loop
from {law} import Law
{before}
print(loop((Law(2.0),), 3.0))
if "child" in sys.argv:
    subprocess.run([sys.executable, __file__], check=True)
"""


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sources")
    for room in ("structures", "particles", "coupling"):
        (folder / room / "kernels").mkdir(parents=True)
        (folder / room / "__init__.py").touch()
    for name in ("compiling", "pieces"):
        original = Path(str(structures.__file__)).parent / "kernels" / f"{name}.py"
        shutil.copy(original, folder / "structures" / "kernels")
    (folder / "coupling" / "kernels" / "loop.py").write_text(LOOP)
    return folder


@pytest.fixture
def printed(sources: Path, tmp_path: Path) -> Callable[..., tuple[list[float], bool, list[str]]]:
    """What a process prints, whether it read a kept kernel, and what it logs; its kernels are in tmp_path/kept."""

    def run(
        law: str = LAW, name: str = "particles.kernels.laws", before: str = "", *words: str, **settings: str
    ) -> tuple[list[float], bool, list[str]]:
        (sources / f"{name.replace('.', '/')}.py").write_text(law)
        (sources / "main.py").write_text(MAIN.format(law=name, before=before))
        ours = {"NUMBA_CACHE_DIR": str(tmp_path / "kept"), "NUMBA_DEBUG_CACHE": "1", "PYTHONDONTWRITEBYTECODE": "1"}
        ours["PYTHONSAFEPATH"] = ""  # the copies lie beside the script
        done = subprocess.run(
            [sys.executable, sources / "main.py", *words],
            env=os.environ | ours | settings, capture_output=True, text=True, check=True,
        )  # fmt: skip
        numbers = [float(line) for line in done.stdout.splitlines() if not line.startswith("[cache]")]
        return numbers, "data loaded" in done.stdout, done.stderr.splitlines()

    return run


@pytest.fixture(scope="module")
def kept(sources: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the kernels of LAW."""
    (sources / "particles" / "kernels" / "laws.py").write_text(LAW)
    (sources / "main.py").write_text(MAIN.format(law="particles.kernels.laws", before=""))
    folder = tmp_path_factory.mktemp("kept")
    done = subprocess.run(
        [sys.executable, sources / "main.py"],
        env=os.environ | {"NUMBA_CACHE_DIR": str(folder), "PYTHONSAFEPATH": ""},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stderr.startswith(COMPILES)
    return folder


@pytest.mark.thorough
def test_a_second_process_finds_kernels_and_an_edited_one_is_compiled(
    printed: Callable[..., Any], kept: Path, tmp_path: Path
) -> None:
    """The edited function is not the one that is kept."""
    shutil.copytree(kept, tmp_path / "kept")
    assert printed() == ([6.0], True, [])
    numbers, found, lines = printed(LAW.replace("* overlap", "+ overlap"))
    assert (numbers, found) == ([5.0], False)
    assert [line.startswith(COMPILES) for line in lines] == [True]
    assert len(list((tmp_path / "kept").iterdir())) == 2


@pytest.mark.thorough
def test_a_users_piece_is_compiled_at_each_start(printed: Callable[..., Any], tmp_path: Path) -> None:
    for sign, result in (("*", 6.0), ("+", 5.0)):
        numbers, found, lines = printed(LAW.replace("* overlap", f"{sign} overlap"), "own")
        assert (numbers, found) == ([result], False)
        assert [line.startswith(EACH_TIME) for line in lines] == [True]
    assert not list((tmp_path / "kept").rglob("*.nbi"))


@pytest.mark.thorough
@pytest.mark.parametrize(("ending", "part"), [("nbi", 0.0), ("nbi", 0.9), ("nbc", 0.5)])
def test_what_is_cut_is_compiled(
    printed: Callable[..., Any], kept: Path, tmp_path: Path, ending: str, part: float
) -> None:
    """One line names the folder."""
    shutil.copytree(kept, tmp_path / "kept")
    (file,) = (tmp_path / "kept").rglob(f"*.{ending}")
    os.truncate(file, int(part * file.stat().st_size))
    numbers, found, lines = printed()
    assert (numbers, found) == ([6.0], False)
    assert re.fullmatch(rf"kernels in {tmp_path}/kept/kernels-\w+ cannot be read or written .*", *lines)


@pytest.mark.thorough
@pytest.mark.parametrize("settings", [{"NUMBA_CACHE_DIR": ""}, {"NUMBA_CACHE_DIR": "/proc/none"}], ids=["home", "dir"])
def test_without_a_folder_kernels_last_as_long_as_the_process(
    printed: Callable[..., Any], tmp_path: Path, settings: dict[str, str]
) -> None:
    """The installation is read-only, without a home folder. A process that this one starts finds the kernels."""
    nowhere = {"HOME": "/proc/none", "XDG_CACHE_HOME": "", "TMPDIR": str(tmp_path)}
    numbers, found, lines = printed(LAW, "particles.kernels.laws", "", "child", **nowhere, **settings)
    assert (numbers, found) == ([6.0, 6.0], True)
    assert lines[0].startswith("compiled kernels cannot be cached")
    assert [line.startswith(COMPILES) for line in lines[1:]] == [True]
    assert not list(tmp_path.glob("hertzlink-*"))


@pytest.mark.thorough
def test_disabled_compilation_is_one_line() -> None:
    for command in (["-c", "import particles.kernels.motion"], ["-m", "hertzlink", "info"]):
        done = subprocess.run(
            [sys.executable, *command],
            env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert "NUMBA_DISABLE_JIT forbids it: unset it" in done.stderr.splitlines()[-1]
