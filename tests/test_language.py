"""The language of the code: names, docstrings, comments, file names and imports, measured with the standard library.

`python tests/test_language.py FOLDER ...` prints the table for any package. By the same measures scikit-fem 12, pyMOR
2026.1, lmfit 1.3 and diffrax 0.7 have 0 to 1 dialect names in 1000, and 3 to 13 % comments; 18 to 25 % of their
docstrings open without subject or verb: up to 6 % with words such as "For", and the others as bare noun phrases.
"""

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("structures", "particles", "plates", "coupling", "hertzlink")

DIALECT = frozenset(("one", "found", "given", "own", "kept", "known", "made", "whole", "way"))
"""Words that say nothing of what a variable holds: a reader must look for its assignment."""

MOST_DIALECT = 8.0
"""Dialect names in 1000."""

NO_SUBJECT = frozenset(
    """
    after also as at because before behind between beyond by during for from how if in inside into like not of
    on outside over per since than through to under unless until up what when where whether while why with
    within without
    """.split()  # noqa: SIM905
)
"""A docstring that opens with these has neither subject nor verb: "Of the contact: …", "What others need."."""

VERBS = frozenset(
    """
    adapt add advance allocate answer applies apply approximate arrange ask assemble assert assign attach
    average begin bind bound bring build calculate call cancel catch change check choose clear close collect
    combine compare compile complete compute condense connect continue convert copies copy count create cut
    decide define delete describe detect determine differentiate discard dismiss display divide do drain draw
    drop embed end enforce enter enumerate estimate evaluate exchange exit expand explain export extend extract
    fail fetch fill filter find finish fit fix flatten fold follow forget format freeze gather generate get give
    go group guess handle hold identify ignore implement import improve include increase indicate initialize
    insert install integrate interpolate introduce invalidate invert iterate join keep leave let limit link list
    load lock log look lower make map mark mask match measure merge mirror modify morph move multiply name
    normalize note obtain offer open order overwrite pack parse pass penalize perform pick place plot prepare
    prescribe press print process produce project provide push put raise rank read rebuild receive record
    recover reduce refine refuse register release reload remember remove rename render repeat replace report
    represent request require reset reshape resolve restore restrict retrieve return reuse reverse rewrite
    rotate round run sample save say scale scan search see select send serialize set share shift show shuffle
    shut simplify simulate skip smooth solve sort split stack start state step stop store strip subtract suggest
    sum suppress swap switch take tell test throw tie touch trace track train transform translate transpose
    treat try turn undo unfold unpack update use used validate vectorize verify view visualise visualize wait
    walk warn watch weigh work wrap write yield
    """.split()  # noqa: SIM905
)
"""Verbs with which docstrings of functions open, also with an s; add yours."""

FINITE = re.compile(
    r"\b(are|bear|bears|become|becomes|begin|begins|can|cancel|cannot|collide|come|comes|counts"
    r"|cross|crosses|did|differ|differs|divide|do|does|end|ends|follow|follows|gets|gives"
    r"|grow|grows|had|has|have|hide|hold|holds|is|join|joins|keep|keeps|lead|leads|leave"
    r"|leaves|lie|lies|look|make|makes|may|meet|meets|move|moves|must|names|need|needs|pass"
    r"|passes|print|prints|pull|reach|reads|rest|returns|say|says|show|shows|stand|stands"
    r"|start|starts|stay|stays|stop|stops|take|takes|turn|turns|was|were|will)\b"
)
CLAUSE = re.compile(r"[.:;,(]|\b(?:that|which|who|whose|where|whether|if|as|when|so|what|how|because|until|unless)\b")

Bound = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Module


def files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.py"))


@cache
def read(path: Path) -> tuple[str, ast.Module]:
    text = path.read_text("utf-8")
    return text, ast.parse(text)


def names(tree: ast.Module) -> set[tuple[tuple[str, ...], str]]:
    """Return what each module, class or function binds: parameters, variables, attributes, functions and classes.

    Comprehensions belong to what encloses them. Names that are imported are bound elsewhere.
    """
    bound, waiting = set[tuple[tuple[str, ...], str]](), list[tuple[ast.AST, tuple[str, ...]]]([(tree, ())])
    while waiting:
        node, scope = waiting.pop()
        for child in ast.iter_child_nodes(node):
            inner = scope
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                bound.add((scope, child.name))
                inner = (*scope, f"{child.name}:{child.lineno}")
            elif isinstance(child, ast.arg):
                bound.add((scope, child.arg))
            elif isinstance(child, ast.Name) and isinstance(child.ctx, ast.Store):
                bound.add((scope, child.id))
            elif isinstance(child, ast.Attribute) and isinstance(child.ctx, ast.Store):
                bound.add((scope[:-1], child.attr))
            waiting.append((child, inner))
    return bound


def dialect(folder: Path) -> tuple[int, list[str]]:
    """Return how many names a folder binds, once for each scope, and those that are a word of DIALECT and no more."""
    bound = [(path, *pair) for path in files(folder) for pair in names(read(path)[1])]
    bound = [entry for entry in bound if entry[2] not in ("_", "self", "cls")]
    return len(bound), [f"{path}: {name}" for path, _, name in bound if name.strip("_").lower() in DIALECT]


def documented(path: Path) -> Iterator[tuple[Bound, str]]:
    for node in ast.walk(read(path)[1]):
        if isinstance(node, Bound) and (text := ast.get_docstring(node)):
            yield node, text


def speechless(node: Bound, text: str) -> bool:
    """Return whether a docstring opens without subject and verb; noun phrases name classes, modules and properties.

    A described builder is named like a class: its first line is the description of its kind in the schema of cases.
    """
    opening = " ".join(text.partition("\n\n")[0].split()).lower()
    match = re.match(r"[\W_]*([^\s,.:;()]*)", opening)
    first = match[1] if match else ""
    if first in NO_SUBJECT or opening.startswith("the same"):
        return True
    if not isinstance(node, ast.FunctionDef) or any(
        "property" in word or "described" in word for word in map(ast.unparse, node.decorator_list)
    ):
        return False
    return not {first, first.removesuffix("s"), first.removesuffix("es")} & VERBS and not FINITE.search(
        CLAUSE.split(opening)[0]
    )


def docstrings(folder: Path) -> tuple[int, list[str]]:
    """Return how many docstrings a folder has, and those without subject and verb."""
    every = [(path, node, text) for path in files(folder) for node, text in documented(path)]
    bad = [f"{path}: {text[:60]!r}" for path, node, text in every if speechless(node, text)]
    return len(every), bad


def comments(path: Path) -> tuple[int, int]:
    """Return lines of code, without blank lines, docstrings and comments, and comments: # and texts below constants."""
    text, tree = read(path)
    lines, explained, count = [line.encode() for line in text.splitlines()], set[int](), 0
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for before, statement in pairwise([None, *body] if isinstance(body, list) else []):
            if isinstance(statement, ast.Expr) and isinstance(getattr(statement.value, "value", None), str):
                within = range(statement.lineno - 1, statement.end_lineno or 0)
                explained |= set(within)
                count += len(within) * isinstance(before, ast.Assign | ast.AnnAssign)
        if isinstance(node, ast.JoinedStr) or isinstance(getattr(node, "value", None), str | bytes):
            ends = getattr(node, "lineno", 1) - 1, getattr(node, "end_lineno", 1) - 1
            for i in (i for i in range(ends[0], ends[1] + 1) if b"#" in lines[i]):  # a # in a text is no comment
                begin = getattr(node, "col_offset", 0) if i == ends[0] else 0
                end = getattr(node, "end_col_offset", 0) if i == ends[1] else len(lines[i])
                lines[i] = lines[i][:begin] + lines[i][begin:end].replace(b"#", b"-") + lines[i][end:]
    rest = [line for i, line in enumerate(lines) if i not in explained]
    code = sum(bool(line.strip()) and not line.strip().startswith(b"#") for line in rest)
    return code, count + sum(b"#" in line for line in rest)


def share(folder: Path) -> float:
    """Return comments in per cent of lines of code."""
    code, count = map(sum, zip(*map(comments, files(folder)), strict=True))
    return 100.0 * count / code


def imports(root: Path, folders: tuple[str, ...]) -> dict[str, set[str]]:
    """Return the modules that each module imports, in functions and for type checkers too."""
    paths = {
        ".".join(path.relative_to(root).with_suffix("").parts): path for name in folders for path in files(root / name)
    }
    paths = {module.removesuffix(".__init__"): path for module, path in paths.items()}
    graph: dict[str, set[str]] = {}
    for module, path in paths.items():
        graph[module] = set()
        for node in ast.walk(read(path)[1]):
            if isinstance(node, ast.Import):
                graph[module] |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                graph[module] |= (inner & paths.keys()) or {node.module}
    return {module: found & paths.keys() - {module} for module, found in graph.items()}


def circle(graph: dict[str, set[str]]) -> set[str]:
    """Return the modules that are left when those are removed, again and again, that import no other."""
    left = dict(graph)
    while free := {module for module, needed in left.items() if not needed & left.keys()}:
        left = {module: needed for module, needed in left.items() if module not in free}
    return set(left)


@pytest.mark.parametrize("room", ROOMS)
def test_names_say_what_they_hold(room: str) -> None:
    count, bad = dialect(ROOT / room)
    assert 1000.0 * len(bad) / count < MOST_DIALECT, "\n".join(bad)


@pytest.mark.parametrize("room", ROOMS)
def test_docstrings_have_a_subject_or_a_verb(room: str) -> None:
    count, bad = docstrings(ROOT / room)
    assert len(bad) < 0.03 * count, "\n".join(bad)


@pytest.mark.parametrize("room", ROOMS)
def test_code_is_explained(room: str) -> None:
    assert share(ROOT / room) > 3.0


@pytest.mark.parametrize("room", ROOMS)
def test_no_file_name_stands_twice(room: str) -> None:
    counts = Counter(path.name for path in files(ROOT / room) if path.name != "__init__.py")
    assert [name for name, count in counts.items() if count > 1] == []


def test_no_modules_import_each_other() -> None:
    assert circle(imports(ROOT, ROOMS)) == set()


@pytest.mark.parametrize(
    ("text", "bad"),
    [
        ("def f():\n    'Of the contact: force.'", True), ("def f():\n    'The same for one.'", True),
        ("def f():\n    'The matrix of a rod that is cut.'", True), ("def f():\n    'Return the matrix.'", False),
        ("class A:\n    'A matrix.'", False), ("class A:\n    'What others need.'", True),
        ("@property\ndef f(self):\n    'The matrix.'", False), ("def f():\n    'A window that fails is halved.'", True),
        ("def f():\n    'Links and files are kept.'", False),
    ],
)  # fmt: skip
def test_openings_are_told_apart(text: str, bad: bool) -> None:
    node = ast.parse(text).body[0]
    assert isinstance(node, Bound)
    assert speechless(node, ast.get_docstring(node) or "") is bad


def test_a_circle_and_a_dialect_name_are_seen(tmp_path: Path) -> None:
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "a.py").write_text("from room import b\ndef f(found, x):\n    return [one for one in found]\n")
    (tmp_path / "room" / "b.py").write_text("def g():\n    # why\n    from room.a import f\n    return f\n")
    assert circle(imports(tmp_path, ("room",))) == {"room.a", "room.b"}
    count, bad = dialect(tmp_path / "room")
    assert (count, len(bad)) == (5, 2)
    assert comments(tmp_path / "room" / "b.py") == (3, 1)


if __name__ == "__main__":
    print("folder                     names  dialect in 1000  docstrings  no subject %  comments %")  # noqa: T201
    for word in sys.argv[1:] or ROOMS:
        folder = Path(word)
        (number, bad_names), (texts, bad_texts) = dialect(folder), docstrings(folder)
        row = (number, 1000.0 * len(bad_names) / number, texts, 100.0 * len(bad_texts) / texts, share(folder))
        print(f"{word[-24:]:24s} {row[0]:7d} {row[1]:16.1f} {row[2]:11d} {row[3]:13.1f} {row[4]:11.1f}")  # noqa: T201
