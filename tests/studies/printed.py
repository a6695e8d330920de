"""What the thesis prints, by study and by section: the only things that a column "thesis" may hold.

Read from the text of D. Khatri, Non-Destructive Evaluation of Material System Using Highly Nonlinear Acoustic Waves
(Caltech), in the units of the tables: µs for ms, GPa, per cent as a number where the row's unit is one. Words stand
where the text compares without a number.
"""

from collections.abc import Sequence

import pytest

from hertzlink.studies.table import Row, text

PRINTED: dict[str, dict[str, set[float | str]]] = {
    "aspect-ratio": {
        "6.2.1": {
            0.32, 0.166, 0.072, 1.28, 0.2, 5.15, 1.16, "about 28.5", 87.81, 59.1, 1435.17, 164.38, 3.95,
        },
        "6.2.3": {0.00019},
    },
    "plate-boundary": {
        "6.2.1": {27.7, 55.6, 111.44, "about 0", 0.853},
        "6.2.2": {1.37, 0.57, 2900.0, 315.17, 0.2, 1000.0, 914.0},
    },
    "plate-waves": {"6.2.2": {0.57, 2900.0, 315.17, 0.2, 1000.0, 914.0}},
    "rod-stiffness": {
        "table 2.1, density": {8000.0, 7800.0, 8960.0, 8550.0, 2693.0, 1140.0, 1186.0, 1196.0, 2151.0},
        "table 2.1, Young's modulus": {193.0, 200.0, 115.0, 103.0, 68.9, 6.52, 4.75, 3.75, 1.53},
        "table 2.1, Poisson's ratio": {0.30, 0.28, 0.35, 0.34, 0.33, 0.40, 0.46},
        "6.1.1": {
            "F_ref/F_in", "between the waves", "45 %", "about 0.825", "about 0.917", "< 5 %", "57 %", 0.55, 0.05,
            "about 100", 0.77, 0.421,
            483.0, 616.0, 450.0, 561.0,
        },
        "figure 6.3": {4.39, 85.0, 16.66, 241.0, 450.0, 561.0},
        "figure 6.5": {"about 120"},
    },
    "rod-length": {
        "6.1.2": {"0.73 to 0.78", "440 to 450", 101.0, "< 5 %", "constant"},
        "figure 6.7": {530.0, "none"},
        "figure 6.8": {0.764, 0.734},
    },
    "upper-layer": {
        "6.1.3": {0.428, 0.769, 0.3, "0.00", 3.19, 32.5, 619.0, 821.0, 25.4},
        "figure 6.10": {"430 to 470"},
    },
    "lower-layer": {"6.1.4": {"0.40 to 0.46", 2.5, "460 to 470"}, "figure 6.12": {"constant"}},
    "ellipsoids": {
        "2.1": {0.925},
        "5.1": {"-1/3"},
        "5.2.2": {1.5},
        "5.3.1": {10.93, 3.31, 5.5, 490.0, 524.0, 529.0, "very good agreement", "slower", "faster"},
    },
    "cylinders": {
        "2.1": {0.68},
        "5.3.2": {
            539.2, 544.0, "559 ± 28", 6.0, 591.3, "9 %", "16 %", "about 10", "about 4", "no significant change",
            1.15, 1.11,
        },
    },
    "hollow-spheres": {
        "2.1": {2.38},
        "table 5.1": {3.759, 1.504, 1.493, 1.423, 1.222},
        "5.3.3": {
            1.2, 648.5, 642.2, "644.7 ± 32.2", 7.5, 9.5, "1/6", "1/12", "excellent agreement",
            "increases with thickness",
        },
    },
    "dissipation": {
        "1.5": {"about 0.02"},
        "2.3": {"5 to 7"},
        "4.1": {"about 0.1"},
        "table 4.1": {0.45, 0.123, 0.48, "1.81, −5.58", "1.78, −0.582", "1.85, −6.84"},
        "4.3": {6900.0, 0.17},
        "figure 5.6": {-11.67},
    },
    "deformable-chain": {
        "3.3.1": {"< 1", "< 1, then < 0.01"},
        "3.3.2": {641.0, 635.0, 610.0},
        "3.4": {20.5, 560.0, 20.53, 552.8, "19 h 11 min 2 s"},
    },
    "contact-law": {
        "3.3.1": {1.505, "similar"},
        "5.3.1": {3.31, "good agreement"},
        "5.3.2": {"below 1.5", "30"},
        "table 5.1": {3.759e9, 3.193e9, 1.174e9, 4.671e7, 1.504, 1.493, 1.423, 1.222},
    },
    "identifiability": {},
}  # fmt: skip


def check(study: str, rows: Sequence[Row]) -> None:
    """Every cell "thesis" of a quick run is printed there, and all that is listed above is in a row.

    And each row says why where its numbers differ by more than 1 %, fits 80 columns, and holds no NaN.
    """
    known = set().union(*PRINTED[study].values())
    found = {row.thesis for row in rows if row.thesis != ""}
    assert found <= known, f"the thesis does not print {found - known}"
    assert known <= found, f"no row for {known - found}"
    for row in rows:
        numbers = isinstance(row.thesis, float) and isinstance(row.computed, float)
        assert row.reason or (numbers and row.computed == pytest.approx(row.thesis, rel=1e-2)), row.quantity
    table = text(rows)
    assert "nan" not in table
    assert max(map(len, table.splitlines())) <= 80
