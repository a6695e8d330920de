"""Breaks places of the source, one at a time, and reports which of them the quick tests catch.

    python tests/mutation.py --seed 1 --count 100 --results mutants.jsonl

A seeded draw chooses the places, as many in each of five rooms: the compiled kernels, the other particles, coupling
(schemes, interface, loops, results), plates and structures. A place is an operator, a sign, the direction of a
comparison, a constant, or a pair of indices. Left out are types, messages, texts and decorators, which no result
depends on.

Everything happens in a copy of the checkout, a temporary one or that of `--copy`, whose compiled kernels serve the next
time. Each mutant meets the quick tests nearest to it (nearest_tests.py), in three parts: those of one file, of three
more, and of eleven more. A part ends after `--most` seconds of the processor. The first test that fails catches the
mutant; so does a process that dies, or runs longer than LONGEST or `--limit` seconds. A mutant that passes all three
has survived. Lastly the tests that caught one must pass in the unbroken copy, or else their catches do not count.

The results file gets a line for each mutant, and a later run with the same arguments continues it. `--only ROOM`
restricts the draw to one room; `--again PLACE` (as reports print it) tests that place once more, say after a new test.
"""

import argparse
import ast
import copy
import json
import multiprocessing
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from math import inf
from pathlib import Path
from time import process_time
from typing import Any

import pytest
from nearest_tests import NearestTests, assigned

CHECKOUT = Path(__file__).resolve().parents[1]
KERNELS = ("*/kernels/*.py",)
SOURCES = {
    "kernels": KERNELS,
    "particles": ("particles/**/*.py",),
    "coupling": (
        "coupling/black_box.py",
        "coupling/interface.py",
        "coupling/engine.py",
        "coupling/results/*.py",
    ),
    "plates": ("plates/**/*.py",),
    "structures": ("structures/**/*.py",),
}
FORK = multiprocessing.get_context("fork")

OPERATORS: dict[type, type] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult,
    ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
MESSAGES = {"caution", "short", "plural", "warn", "join", "format", "html_table"}
"""Functions whose arguments are texts for people."""

TEXTS = {"__repr__", "__str__", "_repr_html_"}
LIBRARIES = (
    "h5netcdf", "h5py", "hypothesis", "joblib", "matplotlib.pyplot", "numba", "pandas", "scipy.optimize",
    "scipy.signal", "scipy.sparse.linalg", "skfem.helpers", "tqdm", "xarray",
)  # fmt: skip
"""Imported once, before the processes of the mutants are forked: opening them takes longer than most tests."""

LONGEST = 120
"""Seconds of the processor after which the tests hang: kernels are compiled in 60 s, no quick test takes 10 s."""

COMPILING = 6
"""The tests of a kernel take so many times as long, most of it to compile."""

MEMORY = 12 * 2**30
"""The most address space (bytes) that a mutant may take: a changed size must not bring the machine down."""


@dataclass(frozen=True)
class Place:
    """Where one change is made: the bytes from start to end of the file become `new`."""

    room: str
    file: str
    line: int
    function: str
    start: int
    end: int
    old: str
    new: str

    @property
    def name(self) -> str:
        return f"{self.file}:{self.line}:{self.start}-{self.end}"


def changed(node: ast.AST) -> Iterator[ast.AST]:
    """The ways to break this one node."""
    new: Any = copy.deepcopy(node)
    match new:
        case ast.BinOp(left=left, op=op, right=right) | ast.AugAssign(target=left, op=op, value=right):
            texts = (ast.JoinedStr, ast.List, ast.Tuple)
            if type(op) not in OPERATORS or any(isinstance(one, texts) or _text(one) for one in (left, right)):
                return
            new.op = OPERATORS[type(op)]()
        case ast.BoolOp(op=op):
            new.op = OPERATORS[type(op)]()
        case ast.Compare(ops=[op, *_]):
            new.ops[0] = OPERATORS[type(op)]()
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            new = operand
        case ast.Constant(value=bool() as value):
            new.value = not value
        case ast.Constant(value=int() as value):
            new.value = value + 1
        case ast.Constant(value=float() as value):
            new.value = 1.5 * value if value else 1.0
        case ast.Subscript(slice=ast.Tuple(elts=[first, second])) if ast.dump(first) != ast.dump(second):
            new.slice = ast.Tuple([second, first], ast.Load())
        case _:
            return
    yield new


def places(room: str) -> list[Place]:
    """Every place of a room that may be broken."""
    files = sorted({path for pattern in SOURCES[room] for path in CHECKOUT.glob(pattern)})
    found: list[Place] = []
    for path in files:
        file = path.relative_to(CHECKOUT).as_posix()
        kernel = any(path.match(pattern) for pattern in KERNELS)
        if (room != "kernels" and kernel) or path.name == "__init__.py":
            continue
        source = path.read_bytes()
        starts = [0]
        for row in source.splitlines(keepends=True):
            starts.append(starts[-1] + len(row))
        for node, function in _nodes(ast.parse(source), ()):
            for new in changed(node):
                at: Any = node
                start, end = starts[at.lineno - 1] + at.col_offset, starts[at.end_lineno - 1] + at.end_col_offset
                text = ast.unparse(new) if isinstance(node, ast.AugAssign) else f"({ast.unparse(new)})"
                found.append(Place(room, file, at.lineno, function, start, end, source[start:end].decode(), text))
    return found


def _text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _nodes(node: ast.AST, within: tuple[str, ...]) -> Iterator[tuple[ast.AST, str]]:
    """The nodes that results depend on, each with the name of the function or method that holds it."""
    match node:
        case ast.Raise() | ast.JoinedStr() | ast.Assert() | ast.Import() | ast.ImportFrom():
            return
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
            if name in MESSAGES or name.endswith(("Error", "Warning")):
                return
        case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            if name in TEXTS:
                return
            within = (*within, name)
    if not within and assigned(node):
        within = (assigned(node),)
    yield node, ".".join(within[:2])
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns", "decorator_list", "bases", "type_params"):
            continue
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, ast.keyword) and one.arg in ("strict", "stacklevel", "encoding"):
                continue
            if isinstance(one, ast.AST):
                yield from _nodes(one, within)


def draw(seed: int, count: int, only: str | None) -> list[Place]:
    """As many places in each room. The rooms take turns; the kernels, which take longest to compile, come last."""
    rooms = [only] if only else list(SOURCES)
    shares = [random.Random(f"{seed} {room}").sample(places(room), -(-count // len(rooms))) for room in rooms]
    drawn = [one for turn in zip(*shares, strict=True) for one in turn][:count]
    return sorted(drawn, key=lambda one: one.room == "kernels")


class Copy:
    """A copy of the checkout in which mutants are made and tested."""

    def __init__(self, folder: Path) -> None:
        self.tree, self.folder = folder / "tree", folder
        listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
        for name in subprocess.run(listed, cwd=CHECKOUT, check=True, capture_output=True, text=True).stdout.split("\n"):
            if name and (CHECKOUT / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(CHECKOUT / name, self.tree / name)
        self.cache = Path(os.environ.get("NUMBA_CACHE_DIR", folder / "numba"))
        self.nearest = NearestTests(CHECKOUT)

    def test(self, place: Place, limit: float, most: float) -> dict[str, Any]:
        """Make the change, run the tests, and put the file back as it was."""
        path = self.tree / place.file
        stamp, source = path.stat(), path.read_bytes()
        # A compiled kernel would be found in the cache: each of its mutants gets a cache of its own.
        cache = Path(tempfile.mkdtemp(dir=self.folder)) if place.room == "kernels" else self.cache
        path.write_bytes(source[: place.start] + place.new.encode() + source[place.end :])
        status, by, count = 0, "", 0
        try:
            parts = self.nearest.to(place.file, place.function)
            if place.room == "kernels":
                # Each part would compile anew, and the same loop runs in most tests: some of each file, in turn.
                parts, most = [_in_turn([name for part in parts for name in part])], COMPILING * most
            for chosen in parts:
                if chosen and status == 0:
                    status, ran, by = self._pytest(chosen, cache, limit, most)
                    count += ran
        finally:
            path.write_bytes(source)
            os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
            if place.room == "kernels":
                shutil.rmtree(cache, ignore_errors=True)
        return asdict(place) | {"caught": status != 0, "status": status, "tests": count, "by": by}

    def false_alarms(self, results: list[dict[str, Any]]) -> set[str]:
        """The tests that caught a mutant, but fail without one as well."""
        left = {one["by"].partition("[")[0] for one in results if one["caught"] and "::" in one["by"]}
        alarms = set()
        while left:
            status, _, by = self._pytest(sorted(left), self.cache, None, inf)
            if status == 0:
                break
            if by.partition("[")[0] not in left:
                raise RuntimeError(f"the unbroken source cannot be tested: {by}")
            alarms.add(by.partition("[")[0])
            left -= alarms
        return alarms

    def _pytest(self, chosen: list[str], cache: Path, limit: float | None, most: float) -> tuple[int, int, str]:
        """The exit status, how many tests passed, and the one that failed. A process of its own, forked from this one,
        which has imported the libraries, but nothing of the rooms."""
        receiver, sender = FORK.Pipe(duplex=False)
        process = FORK.Process(target=_child, args=(self.tree, chosen, cache, cache != self.cache, most, sender))
        process.start()
        assert process.pid
        sender.close()
        try:
            process.join(limit)
            if process.exitcode is None:
                return 124, 0, "ran too long"
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.join()
        try:
            found: tuple[int, int, str] = receiver.recv()
            return found
        except EOFError:
            return process.exitcode or 1, 0, "the process died"


class Watch:
    """A plugin of pytest: puts the tests in order, and stops after `most` seconds of the processor."""

    def __init__(self, chosen: list[str], most: float) -> None:
        self.order, self.most = {name: place for place, name in enumerate(chosen)}, most
        self.passed, self.failed, self.start = 0, "", 0.0

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        self.start = process_time()
        plain = {one: one.nodeid.partition("[")[0] for one in items}
        items[:] = sorted((one for one in items if plain[one] in self.order), key=lambda one: self.order[plain[one]])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.passed += report.when == "call" and report.passed
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed and not self.failed:
            self.failed = f"{report.nodeid} (import)"

    def pytest_runtest_teardown(self, item: pytest.Item) -> None:
        if process_time() - self.start > self.most:
            item.session.shouldstop = "enough"


def _child(tree: Path, chosen: list[str], cache: Path, quickly: bool, most: float, sender: Any) -> None:
    os.setsid()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
    os.chdir(tree)
    sys.path.insert(0, str(tree))
    os.environ |= {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(cache), "MPLBACKEND": "Agg"}
    if quickly:
        os.environ["NUMBA_OPT"] = "1"
    import_module("numba.core.config").reload_config()
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    watch = Watch(chosen, most)
    files = list(dict.fromkeys(name.partition("::")[0] for name in chosen))
    status = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *files], plugins=[watch]))
    if status in (0, 1, 2, 5):
        status = 1 if watch.failed else 0
    sender.send((status, watch.passed, watch.failed))


def _in_turn(tests: list[str]) -> list[str]:
    """Four tests of each file, then the next four."""
    files: dict[str, list[str]] = {}
    for name in tests:
        files.setdefault(name.partition("::")[0], []).append(name)
    rounds = range(0, max(map(len, files.values()), default=0), 4)
    return [name for start in rounds for own in files.values() for name in own[start : start + 4]]


def report(results: list[dict[str, Any]]) -> None:
    print("\nsurvived:" if not all(one["caught"] for one in results) else "")
    for one in results:
        if not one["caught"]:
            print(
                f"  {one['file']}:{one['line']}:{one['start']} in {one['function']}: {one['old']} became {one['new']}"
            )
    print(f"\n{'room':12}{'broken':>8}{'caught':>8}{'share':>8}")
    for room in [*SOURCES, "all"]:
        own = [one for one in results if room in (one["room"], "all")]
        if own:
            caught = sum(one["caught"] for one in own)
            print(f"{room:12}{len(own):8}{caught:8}{caught / len(own):8.0%}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--only", choices=SOURCES)
    parser.add_argument("--again", nargs="+", metavar="PLACE")
    parser.add_argument("--results", type=Path, metavar="FILE")
    parser.add_argument("--copy", type=Path, metavar="FOLDER")
    parser.add_argument("--limit", type=float, default=300.0)
    parser.add_argument("--most", type=float, default=12.0)
    given = parser.parse_args()
    drawn = draw(given.seed, given.count, given.only)
    if given.again:
        drawn = [one for room in SOURCES for one in places(room) if one.name in given.again]
    before = given.results.read_text().splitlines() if given.results and given.results.exists() else []
    results = [json.loads(row) for row in before]
    done = {(one["file"], one["start"], one["new"]) for one in results}
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("stopped"))
    with nullcontext(given.copy) if given.copy else tempfile.TemporaryDirectory(prefix="mutation-") as folder:
        os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        for library in LIBRARIES:
            import_module(library)
        tree = Copy(Path(folder))
        for place in drawn:
            if (place.file, place.start, place.new) in done:
                continue
            results.append(tree.test(place, given.limit, given.most))
            last = results[-1]
            outcome = "caught" if last["caught"] else "SURVIVED"
            print(f"{len(results):4} {outcome:9}{place.name} {place.old} → {place.new} {last['by']}", flush=True)
            if given.results:
                with given.results.open("a") as file:
                    file.write(json.dumps(last) + "\n")
        for alarm in tree.false_alarms(results):
            print(f"fails without a change as well, and catches nothing: {alarm}")
            results = [one | {"caught": one["caught"] and not one["by"].startswith(alarm)} for one in results]
    report(results)


if __name__ == "__main__":
    main()
