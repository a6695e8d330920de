"""Mesh files of Abaqus and CalculiX (.inp): nodes, elements, sets, parts, instances.

meshio reads .inp too, but loses instances, blocks of nodes and members of sets without a word, and no light maintained
library reads them. This reader understands what a file states about the mesh, or refuses it with file and line.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from structures.caution import caution
from structures.structure import Vector

NODE_NUMBERS = "numbers of nodes"
"""The data of points with the numbers that they have in the file, where no instances number them anew."""

LARGEST_NUMBER = 2**31
"""Numbers of nodes and elements lie below it."""

MOST_FILES = 100
"""Number of files that one mesh may include, those that are included twice counted twice."""

DEEPEST_SET = 50
"""How deep sets may contain sets."""

ELEMENTS: tuple[tuple[re.Pattern[str], dict[str, tuple[str, int]]], ...] = (
    (
        re.compile(r"(?:[AD]|DC)?C3D(\d+)[A-Z]*|SC(\d)R?T?"),
        {
            "4": ("tetra", 4), "10": ("tetra10", 10), "8": ("hexahedron", 8), "20": ("hexahedron20", 20),
            "5": ("pyramid", 5), "6": ("wedge", 6), "15": ("wedge15", 15),
        },
    ),
    (
        re.compile(r"(?:S|DS|CPS|CPE|CPEG|CAX|M3D|SFM3D|R3D|STRI|[AD]C2D)(\d+)(?:[A-Z]+\d?)?"),
        {
            "3": ("triangle", 3), "6": ("triangle6", 6), "65": ("triangle6", 6), "4": ("quad", 4), "8": ("quad8", 8),
            "9": ("quad9", 9),
        },
    ),
    (re.compile(r"(?:B|PIPE)[23](\d)[A-Z]*"), {"1": ("line", 2), "2": ("line3", 3), "3": ("line", 2)}),
    (re.compile(r"(?:T[23]D|R2D)(\d)[A-Z]*"), {"2": ("line", 2), "3": ("line3", 3)}),
)  # fmt: skip
"""Names of element types, and meshio's name and the number of nodes by the digits in them."""

FACES = {
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
}
"""Corners of the faces S1 to S6 of solids and of the edges E1 to E4 of shells."""

FACET = {2: "line", 3: "triangle", 4: "quad"}

WHAT = {"NSET": "nodes", "ELSET": "elements"}

SCOPES = {"PART": "END PART", "INSTANCE": "END INSTANCE"}

OPTIONS = {
    "NODE": {"NSET", "SYSTEM"},
    "ELEMENT": {"TYPE", "ELSET"},
    "NSET": {"NSET", "ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"},
    "ELSET": {"ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"},
    "SURFACE": {"NAME", "TYPE", "INTERNAL"},
    "PART": {"NAME"},
    "INSTANCE": {"NAME", "PART"},
    "SYSTEM": set(),
}
"""The parameters of keywords that are understood."""

MAKES_MESH = {
    *("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "IMPORT", "IMPERFECTION", "PARAMETER", "MAP SOLUTION"),
    *("SYMMETRIC MODEL GENERATION", "TRANSFORM MODEL"),
}
"""Keywords that make or move nodes and elements by rules."""

BEYOND_MESH = {
    *("BOUNDARY", "TIE", "EQUATION", "MPC", "RIGID BODY", "EMBEDDED ELEMENT", "SHELL TO SOLID COUPLING"),
    *("COUPLING", "KINEMATIC COUPLING", "DISTRIBUTING COUPLING", "CONTACT PAIR"),
}
"""Keywords that hold or join parts of a body otherwise than by common nodes."""


class Line(NamedTuple):
    """A line of a file, without blanks at its ends."""

    file: str
    number: int
    text: str

    def fail(self, what: str) -> ValueError:
        """Return the error that names file and line."""
        return ValueError(f"mesh = {self.file!r}, line {self.number}: {what}")

    @property
    def fields(self) -> list[str]:
        """The fields that commas separate; a comma at the end adds nothing."""
        fields = [part.strip() for part in self.text.split(",")]
        while fields and not fields[-1]:
            fields.pop()
        return fields

    @property
    def first(self) -> str:
        """The first field."""
        return (self.fields or [""])[0]

    def integer(self, text: str) -> int:
        """Return a number of a node or an element."""
        try:
            number = int(text)
        except ValueError:
            raise self.fail(f"{text!r} must be a whole number") from None
        if abs(number) >= LARGEST_NUMBER:
            raise self.fail(f"{text!r} is larger than any number of a node or an element")
        return number

    def floats(self, texts: Iterable[str]) -> list[float]:
        """Return the numbers, also with Fortran's exponent 1D-3; an empty field is zero."""
        numbers = []
        for text in texts:
            try:
                number = float(text.upper().replace("D", "E")) if text else 0.0
            except ValueError:
                raise self.fail(f"{text!r} must be a number") from None
            if not isfinite(number):
                raise self.fail(f"{text!r} must be a finite number")
            numbers.append(number)
        return numbers


class Card(NamedTuple):
    """A keyword, its parameters and its lines of data."""

    name: str
    options: dict[str, str]
    head: Line
    rows: list[Line]

    def required(self, option: str) -> str:
        """Return the value of a parameter."""
        if not self.options.get(option):
            raise self.head.fail(f"*{self.name} needs {option}=")
        return self.options[option]


@dataclass
class Members:
    """A set as the file lists it: numbers and names of other sets, each with its line and its instance."""

    name: str
    numbers: list[tuple[Line, str, Sequence[int]]] = field(default_factory=list)
    others: list[tuple[Line, str, str]] = field(default_factory=list)


@dataclass
class Scope:
    """The definitions of a part, an instance or the file. Names are in capitals, as their case does not count."""

    name: str = ""
    nodes: dict[int, tuple[float, ...]] = field(default_factory=dict)
    elements: dict[int, tuple[str, tuple[int, ...], Line]] = field(default_factory=dict)
    unread: set[int] = field(default_factory=set)
    sets: dict[str, dict[str, Members]] = field(default_factory=lambda: {"NSET": {}, "ELSET": {}})
    surfaces: dict[str, tuple[str, list[Line]]] = field(default_factory=dict)

    def members(self, kind: str, name: str) -> Members:
        """Return the set of that name, made where it does not exist."""
        return self.sets[kind].setdefault(name.upper(), Members(name))

    def placed(self, name: str) -> "Scope":
        """Return the same definitions under another name."""
        sets = {kind: dict(members) for kind, members in self.sets.items()}
        return Scope(name, dict(self.nodes), dict(self.elements), set(self.unread), sets, dict(self.surfaces))


def read_abaqus(path: Path, name: str) -> Any:
    """Return the meshio.Mesh of a file; name: as the user gave it.

    Sets of an instance are "instance.set", and "set" where no other set has that name; the cells of an instance have
    its name as well. Raises ValueError, with file and line, for what is not understood.
    """
    reader = _Reader()
    for card in _cards(_lines(path, name, path.resolve().parent, [])):
        reader.take(card)
    reader.report(name)
    return _Flat(reader.scopes(name)).mesh(name)


def _text(path: Path) -> str:
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _lines(path: Path, name: str, folder: Path, files: list[Path]) -> Iterator[Line]:
    """Yield the lines without comments; a keyword that goes on is one line; the lines of an included file stand in its
    place."""
    files.append(path.resolve())
    if len(files) > MOST_FILES:
        raise ValueError(f"mesh = {name!r}: includes more than {MOST_FILES} files, or itself")
    shown = name if len(files) == 1 else f"{name} ({path.name})"
    head: Line | None = None
    for number, text in enumerate(_text(path).splitlines(), 1):
        line = Line(shown, number, text.strip())
        if not line.text or line.text.startswith("**"):
            continue
        if head is not None:
            head = head._replace(text=head.text + line.text)
        elif line.text.startswith("*"):
            head = line
        else:
            yield line
            continue
        if head.text.endswith(","):
            continue
        line, head = head, None
        keyword, options = _keyword(line)
        if keyword != "INCLUDE":
            yield line
        if "INPUT" in options or keyword == "INCLUDE":
            other = (folder / options.get("INPUT", "").strip('"')).resolve()
            if not other.is_relative_to(folder):
                raise line.fail(
                    f"names {options['INPUT']!r}, which lies outside the folder of the mesh; it was not read"
                )
            if not other.is_file():
                raise line.fail(f"there is no file {options.get('INPUT', '')!r}")
            yield from _lines(other, name, folder, files)
    if head is not None:
        yield head


def _keyword(line: Line) -> tuple[str, dict[str, str]]:
    """Return the keyword in capitals with single blanks, and its parameters."""
    first, *rest = line.text[1:].split(",")
    pairs = [option.partition("=") for option in rest if option.strip()]
    options = {" ".join(key.upper().split()): value.strip().strip('"') for key, _, value in pairs}
    return " ".join(first.upper().split()), options


def _cards(lines: Iterable[Line]) -> Iterator[Card]:
    card = None
    for line in lines:
        if line.text.startswith("*"):
            if card is not None:
                yield card
            card = Card(*_keyword(line), line, [])
        elif card is None:
            raise line.fail("stands before the first keyword, such as *NODE; is it an .inp file of Abaqus or CalculiX?")
        else:
            card.rows.append(line)
    if card is not None:
        yield card


class _Reader:
    """Takes the keywords of a file one after another."""

    def __init__(self) -> None:
        self.root = self.scope = Scope()
        self.parts: dict[str, Scope] = {}
        self.instances: dict[str, Scope] = {}
        self.inside: Card | None = None
        self.system: tuple[Vector, Vector] | None = None
        self.unread: dict[str, tuple[int, Line]] = {}
        self.beyond: dict[str, Line] = {}

    def take(self, card: Card) -> None:
        """Adds what a keyword defines to its scope."""
        if card.name in MAKES_MESH:
            raise card.head.fail(f"*{card.name} makes or moves nodes by a rule that is not read; write the mesh out")
        if card.name in BEYOND_MESH:
            self.beyond.setdefault(card.name, card.head)
        unknown = sorted(set(card.options) - OPTIONS.get(card.name, set(card.options)) - {"INPUT"})
        if unknown:
            raise card.head.fail(f"*{card.name} has the parameter {unknown[0]}, which is not understood")
        action = getattr(self, "_" + card.name.lower().replace(" ", "_"), None) if card.name in ACTIONS else None
        if action is not None:
            action(card)

    def report(self, name: str) -> None:
        """Warns of what the file states and the mesh does not hold."""
        if self.inside is not None:
            raise self.inside.head.fail(f"*{self.inside.name} does not end; the file is cut short")
        for kind, (count, line) in self.unread.items():
            caution(
                f"mesh = {line.file!r}, line {line.number}: elements of type {kind} are not read ({count}); the body "
                "is what solids, shells and lines fill"
            )
        if self.beyond:
            stated = ", ".join(f"*{key} (line {line.number})" for key, line in self.beyond.items())
            caution(f"mesh = {name!r}: {stated}: not read; the mesh alone is, and supports are arguments")

    def scopes(self, name: str) -> list[Scope]:
        """Return the file's own definitions, and its instances."""
        placed = list(self.instances.values())
        if self.parts and not placed:
            if len(self.parts) > 1 or self.root.elements:
                raise ValueError(f"mesh = {name!r}: has parts, but no *INSTANCE that places them")
            caution(f"mesh = {name!r}: no *INSTANCE places its part, which is read where it stands")
            placed = list(self.parts.values())
        return [self.root, *placed]

    def _part(self, card: Card) -> None:
        self._enter(card, self.parts, Scope(card.required("NAME")))

    def _instance(self, card: Card) -> None:
        part = self.parts.get(card.required("PART").upper())
        if part is None:
            raise card.head.fail(f"*INSTANCE places the part {card.options['PART']!r}, which is not defined above")
        self._enter(card, self.instances, part.placed(card.required("NAME")))

    def _enter(self, card: Card, where: dict[str, Scope], scope: Scope) -> None:
        if self.inside is not None:
            raise card.head.fail(f"*{card.name} stands inside *{self.inside.name}")
        if scope.name.upper() in where:
            raise card.head.fail(f"*{card.name} defines {scope.name!r} a second time")
        where[scope.name.upper()] = self.scope = scope
        self.inside, self.system = card, None

    def _end_part(self, card: Card) -> None:
        if self.inside is None or card.name != SCOPES[self.inside.name]:
            raise card.head.fail(f"*{card.name} ends nothing")
        self.inside, self.scope, self.system = None, self.root, None

    def _end_instance(self, card: Card) -> None:
        placing, scope = self.inside, self.scope
        self._end_part(card)
        if placing is not None and placing.rows and scope.nodes:
            places = _placed(np.array(list(scope.nodes.values())), placing.rows)
            scope.nodes = dict(zip(scope.nodes, map(tuple, places.tolist()), strict=True))

    def _system(self, card: Card) -> None:
        self.system = None if not card.rows else _local_axes(card)

    def _node(self, card: Card) -> None:
        numbers = [line.integer(line.first) for line in card.rows]
        places = np.zeros((len(numbers), 3))
        for place, line in zip(places, card.rows, strict=True):
            coordinates = line.floats(line.fields[1:4])
            place[: len(coordinates)] = coordinates
        places = _cartesian(card, places)
        if self.system is not None:
            places = self.system[0] + places @ self.system[1]
        for number, point, line in zip(numbers, map(tuple, places.tolist()), card.rows, strict=True):
            if number <= 0:
                raise line.fail(f"{number} is no number of a node")
            if self.scope.nodes.setdefault(number, point) != point:
                raise line.fail(f"node {number} is defined a second time, at another place")
        self._listed("NSET", card, numbers)

    def _element(self, card: Card) -> None:
        kind, count = _element_type(card.required("TYPE"))
        numbers = []
        if not kind:
            numbers = [line.integer(line.first) for line in card.rows]
            self.scope.unread.update(numbers)
            count, first = self.unread.get(card.options["TYPE"].upper(), (0, card.head))
            self.unread[card.options["TYPE"].upper()] = count + len(numbers), first
        for line, (number, *nodes) in _elements(card, count) if kind else ():
            numbers.append(number)
            if self.scope.elements.setdefault(number, (kind, tuple(nodes), line))[:2] != (kind, tuple(nodes)):
                raise line.fail(f"element {number} is defined a second time, with other nodes")
        self._listed("ELSET", card, numbers)

    def _listed(self, kind: str, card: Card, numbers: list[int]) -> None:
        """Adds the numbers to the set that *NODE or *ELEMENT names."""
        if card.options.get(kind):
            self.scope.members(kind, card.options[kind]).numbers.append((card.head, "", numbers))

    def _nset(self, card: Card) -> None:
        members = self.scope.members(card.name, card.required(card.name))
        instance = card.options.get("INSTANCE", "").upper()
        if card.name == "NSET" and card.options.get("ELSET"):
            members.others.append((card.head, instance, "ELSET " + card.options["ELSET"]))
        if "GENERATE" in card.options:
            members.numbers += [(line, instance, _range(line)) for line in card.rows]
            return
        for line in card.rows:
            numbers = []
            for text in filter(None, line.fields):
                if re.fullmatch(r"[+-]?\d+", text):
                    numbers.append(line.integer(text))
                else:
                    members.others.append((line, instance, text.strip('"')))
            members.numbers.append((line, instance, numbers))

    _elset = _nset

    def _surface(self, card: Card) -> None:
        name = card.required("NAME")
        if card.options.get("TYPE", "ELEMENT").upper() == "NODE":
            members = self.scope.members("NSET", name)
            members.others += [(line, "", line.first) for line in card.rows]
        else:
            self.scope.surfaces[name.upper()] = (name, card.rows)


ACTIONS = {"PART", "END PART", "INSTANCE", "END INSTANCE", "SYSTEM", "NODE", "ELEMENT", "NSET", "ELSET", "SURFACE"}
"""The keywords that a mesh consists of."""


def _element_type(name: str) -> tuple[str, int]:
    """Return the meshio's name of the type and its number of nodes; an empty name for what is no cell of a mesh."""
    for pattern, kinds in ELEMENTS:
        match = pattern.fullmatch(name.upper())
        if match:
            return kinds.get(next(filter(None, match.groups())), ("", 0))
    return "", 0


def _elements(card: Card, count: int) -> Iterator[tuple[Line, list[int]]]:
    """Yield the number and nodes of each element, which may go on over several lines."""
    first, numbers = card.head, list[int]()
    for line in card.rows:
        if not numbers:
            first = line
        numbers += [line.integer(text) for text in line.fields]
        if len(numbers) > count + 1:
            raise line.fail(f"{card.options['TYPE']} has {count} nodes, but this element has {len(numbers) - 1}")
        if len(numbers) == count + 1:
            yield first, numbers
            numbers = []
    if numbers:
        raise first.fail(f"{card.options['TYPE']} has {count} nodes, but this element has {len(numbers) - 1}")


def _range(line: Line) -> range:
    """Return the first, last and step of GENERATE; the step is 1 where it is missing, and may be negative."""
    numbers = [line.integer(text) for text in line.fields]
    if not 2 <= len(numbers) <= 3:
        raise line.fail("GENERATE takes first, last and step")
    first, last, step = (*numbers, 1)[:3]
    if step == 0 or (last - first) * step < 0:
        raise line.fail(f"GENERATE from {first} to {last} in steps of {step} makes no number")
    return range(first, last + (1 if step > 0 else -1), step)


def _cartesian(card: Card, places: Vector) -> Vector:
    """Return x, y, z of nodes in the system of *NODE: R rectangular, C (r, θ, z), S (r, θ, φ), angles in degrees."""
    system = card.options.get("SYSTEM", "R").upper()
    if system == "R":
        return places
    if system not in ("C", "S"):
        raise card.head.fail(f"SYSTEM={card.options['SYSTEM']} must be R, C or S")
    radius, angle, last = places.T
    angle = np.radians(angle)
    if system == "S":
        # φ is the angle above the plane of x and y.
        radius, last = radius * np.cos(np.radians(last)), radius * np.sin(np.radians(last))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), last])


def _local_axes(card: Card) -> tuple[Vector, Vector]:
    """Return the origin and axes of *SYSTEM: its origin, a point on its x axis, and a point of its plane of x and y."""
    numbers = [line.floats(line.fields) for line in card.rows]
    if len(numbers) > 2 or len(numbers[0]) not in (3, 6) or (len(numbers) > 1 and len(numbers[1]) != 3):
        raise card.head.fail("*SYSTEM takes the origin, a point on the x axis, and on a second line a third point")
    origin = np.array(numbers[0][:3])
    if len(numbers[0]) == 3:
        return origin, np.eye(3)
    x = np.array(numbers[0][3:]) - origin
    if len(numbers) > 1:
        z = np.cross(x, np.array(numbers[1]) - origin)
    elif abs(x[2]) <= 1e-9 * np.linalg.norm(x):
        z = np.array([0.0, 0.0, 1.0])
    else:
        raise card.head.fail("*SYSTEM with an x axis that leaves the plane of x and y needs a third point")
    if np.linalg.norm(x) == 0.0 or np.linalg.norm(z) == 0.0:
        raise card.head.fail("the points of *SYSTEM lie on one line")
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return origin, np.array([x, np.cross(z, x), z])


def _placed(places: Vector, rows: list[Line]) -> Vector:
    """Return the nodes of an instance: moved by the first line, then turned about the axis of the second by degrees."""
    from scipy.spatial.transform import Rotation

    for i, line in enumerate(rows):
        numbers = np.array(line.floats(line.fields))
        if i > 1 or numbers.size != (3, 7)[i]:
            raise line.fail("*INSTANCE takes a translation of three numbers, and a rotation of seven on the next line")
        if i == 0:
            places = places + numbers
            continue
        start, axis = numbers[:3], numbers[3:6] - numbers[:3]
        if np.linalg.norm(axis) == 0.0:
            raise line.fail("the axis of the rotation has no length")
        turn = Rotation.from_rotvec(np.radians(numbers[6]) * axis / np.linalg.norm(axis))
        places = start + turn.apply(places - start)
    return places


class _Flat:
    """All scopes as one mesh: indices in place of numbers."""

    def __init__(self, scopes: list[Scope]) -> None:
        self.scopes = {scope.name.upper(): scope for scope in scopes}
        self.index: dict[str, dict[str, dict[int, int]]] = {"NSET": {}, "ELSET": {}}
        self.kinds: dict[str, list[tuple[int, ...]]] = {}
        self.done: dict[tuple[str, str, str], Any] = {}
        self.kind_of: list[tuple[str, int]] = []
        start = 0
        for key, scope in self.scopes.items():
            nodes = {number: start + i for i, number in enumerate(scope.nodes)}
            self.index["NSET"][key], self.index["ELSET"][key] = nodes, {}
            start += len(nodes)
            for number, (kind, corners, line) in scope.elements.items():
                missing = [node for node in corners if node not in nodes]
                if missing:
                    raise line.fail(f"element {number} has the node {missing[0]}, which is not defined")
                self.index["ELSET"][key][number] = len(self.kind_of)
                block = self.kinds.setdefault(kind, [])
                self.kind_of.append((kind, len(block)))
                block.append(tuple(nodes[node] for node in corners))

    def mesh(self, name: str) -> Any:
        """Return the meshio.Mesh with the sets of all scopes."""
        import meshio  # type: ignore[import-untyped]

        scopes = self.scopes.values()
        places = [place for scope in scopes for place in scope.nodes.values()]
        if not places or not self.kinds:
            raise ValueError(f"mesh = {name!r}: has no *NODE or no *ELEMENT that is read")
        sets = {
            kind: self._by_name(
                (scope, members.name, self._resolved(scope, kind, key, ()))
                for scope in scopes
                for key, members in scope.sets[kind].items()
            )
            for kind in WHAT
        }
        surfaces = self._by_name(
            (scope, name, [facet for line in rows for facet in self._facets(scope, line)])
            for scope in scopes
            for name, rows in scope.surfaces.values()
        )
        for scope in scopes:
            if scope.name:
                members = list(self.index["ELSET"][scope.name.upper()].values())
                sets["ELSET"].setdefault(scope.name, np.array(members, dtype=np.int64))
        kinds = np.array([list(self.kinds).index(kind) for kind, _ in self.kind_of])
        within = np.array([i for _, i in self.kind_of])
        blocks = [(kind, np.array(cells, dtype=np.int64)) for kind, cells in self.kinds.items()]
        in_blocks = {
            tag: [within[members[kinds[members] == i]] for i in range(len(blocks))]
            for tag, members in sets["ELSET"].items()
        }
        for tag, facets in surfaces.items():
            for size in sorted({len(facet) for facet in facets}):
                blocks.append((FACET[size], np.array([facet for facet in facets if len(facet) == size])))
                listed = in_blocks.setdefault(tag, [])
                listed += [np.zeros(0, dtype=np.int64)] * (len(blocks) - 1 - len(listed))
                listed.append(np.arange(len(blocks[-1][1])))
        for listed in in_blocks.values():
            listed += [np.zeros(0, dtype=np.int64)] * (len(blocks) - len(listed))
        flat = [] if any(scope.name for scope in self.scopes.values()) else list(self.index["NSET"].values())
        numbers = {NODE_NUMBERS: np.array([*flat[0]], dtype=np.int64)} if len(flat) == 1 else {}
        return meshio.Mesh(np.array(places), blocks, numbers, point_sets=sets["NSET"], cell_sets=in_blocks)

    @staticmethod
    def _by_name(every: Iterable[tuple[Scope, str, Any]]) -> dict[str, Any]:
        """Return what scopes define by name; a name that several scopes use is that of none alone."""
        every = [*every]
        uses, by_name = Counter(name.upper() for _, name, _ in every), dict[str, Any]()
        for scope, name, members in every:
            by_name |= {f"{scope.name}.{name}": members} if scope.name else {}
            by_name |= {name: members} if uses[name.upper()] == 1 else {}
        return by_name

    def _resolved(self, scope: Scope, kind: str, key: str, above: tuple[tuple[str, str, str], ...]) -> Any:
        """Return the indices of the nodes or elements of a set; a warning where some do not exist."""
        members, path = scope.sets[kind][key], (scope.name, kind, key)
        if path in self.done:
            return self.done[path]
        if path in above or len(above) > DEEPEST_SET:
            raise members.others[0][0].fail(f"the set {members.name!r} contains itself, or sets in sets in sets")
        pieces: list[Any] = []
        for line, instance, numbers in members.numbers:
            index, unread = self._numbers(line, scope, instance, kind)
            # A range may be longer than all numbers there are.
            far = isinstance(numbers, range) and len(numbers) > len(index) + len(unread)
            few = [number for number in (*index, *unread) if number in numbers] if far else numbers
            existing = [number for number in few if number in index or number in unread]
            if lacking := len(numbers) - len(existing):
                first = next(number for number in numbers if number not in index and number not in unread)
                caution(
                    f"mesh = {line.file!r}, line {line.number}: {lacking} of the {WHAT[kind]} of the set "
                    f"{members.name!r} do not exist, the first {first}; they are left out"
                )
            pieces.append(np.array([index[number] for number in existing if number in index], dtype=np.int64))
        for line, instance, name in members.others:
            pieces.append(self._other(line, scope, instance, kind, name, (*above, path)))
        self.done[path] = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *pieces]))
        return self.done[path]

    def _numbers(self, line: Line, scope: Scope, instance: str, kind: str) -> tuple[dict[int, int], set[int]]:
        key = instance or scope.name.upper()
        if key not in self.scopes:
            raise line.fail(f"the instance {instance!r} is not defined")
        return self.index[kind][key], self.scopes[key].unread if kind == "ELSET" else set()

    def _other(
        self, line: Line, scope: Scope, instance: str, kind: str, name: str, above: tuple[tuple[str, str, str], ...]
    ) -> Any:
        """Return what another set, or a node or element of an instance, adds to a set."""
        if kind == "NSET" and name.startswith("ELSET "):
            elements = self._other(line, scope, instance, "ELSET", name.removeprefix("ELSET "), above)
            places = [self.kind_of[element] for element in elements]
            return np.unique([n for kind, i in places for n in self.kinds[kind][i]])
        place = self.scopes[instance] if instance in self.scopes and instance else scope
        if name.upper() in place.sets[kind]:
            return self._resolved(place, kind, name.upper(), above)
        before, _, last = name.rpartition(".")
        inside = self.scopes.get(before.upper().strip('"')) if before else place
        if inside is not None and re.fullmatch(r"\d+", last):
            index = self.index[kind][inside.name.upper()]
            if int(last) in index:
                return np.array([index[int(last)]], dtype=np.int64)
        elif inside is not None and last.upper() in inside.sets[kind]:
            return self._resolved(inside, kind, last.upper(), above)
        raise line.fail(f"{name!r} is no {WHAT[kind].removesuffix('s')}, and no set that is defined")

    def _facets(self, scope: Scope, line: Line) -> Iterator[tuple[int, ...]]:
        who, face = (*line.fields, "", "")[:2]
        number = re.fullmatch(r"[SE]([1-6])", face.upper())
        if number is None:
            caution(f"mesh = {line.file!r}, line {line.number}: the face {face!r} of a surface is not understood")
            return
        if re.fullmatch(r"\d+", who) and int(who) in self.index["ELSET"][scope.name.upper()]:
            elements = [self.index["ELSET"][scope.name.upper()][int(who)]]
        else:
            elements = self._other(line, scope, "", "ELSET", who, ())
        for element in elements:
            kind, i = self.kind_of[element]
            faces = FACES.get(re.sub(r"\d+$", "", kind), ())
            if int(number[1]) <= len(faces):
                yield tuple(self.kinds[kind][i][corner] for corner in faces[int(number[1]) - 1])
