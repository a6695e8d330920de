"""The whole thesis: a verdict on each of its numbers and statements, with the study or check that shows it."""

from collections.abc import Iterator

import joblib
import numpy as np
import xarray as xr
from tqdm.auto import tqdm

from hertzlink.studies import draw, equations, study
from hertzlink.studies.compare import VERDICTS, Number, Row, compare, counts, in_words, printed
from structures.caution import collected

# Parts that are computed without a run, by what stands for their study in printed.csv.
CHECKED = {"closed-forms": equations.closed_forms, "equations": equations.numbers}
STUDIED = (
    "deformable-chain", "contact-law", "dissipation", "ellipsoids", "cylinders", "hollow-spheres", "rod-stiffness",
    "rod-length", "upper-layer", "lower-layer", "aspect-ratio", "plate-boundary",
)  # fmt: skip
PARTS = (*CHECKED, *STUDIED)
# These parts start first, so that no process waits for them at the end.
LONGEST_FIRST = ("plate-boundary", "deformable-chain", "contact-law")


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the rows of all parts. quick: the quick versions of the studies."""
    order = sorted(PARTS, key=lambda part: part not in LONGEST_FIRST)
    parallel = joblib.Parallel(min(joblib.cpu_count() if jobs is None else jobs, len(order)), return_as="generator")
    found = parallel(joblib.delayed(rows_of)(part, quick) for part in order)
    done = dict(zip(order, tqdm(found, total=len(order), leave=False, disable=None), strict=True))
    columns = zip(*((part, *row) for part in PARTS for row in done[part]), strict=True)
    names = ("part", *Row._fields)
    return xr.Dataset({name: ("entry", [*column]) for name, column in zip(names, columns, strict=True)})


def rows_of(part: str, quick: bool) -> list[Row]:
    """Return the rows of one part in which the thesis prints something."""
    with collected():  # each study warns by itself
        found = CHECKED[part]() if part in CHECKED else study(part).numbers(study(part).run(quick, 1))
        return compare(part, [number for number in found if number.name in printed(part)])


def rows(data: xr.Dataset, part: str = "") -> list[Row]:
    """Return the rows of a part, by default of all."""
    columns = zip(*(data[name].values.tolist() for name in ("part", *Row._fields)), strict=True)
    return [Row(*row) for of, *row in columns if part in ("", of)]


def numbers(data: xr.Dataset) -> Iterator[Number]:
    """Yield how many numbers agree, differ and are misprints, in all and by part."""
    for part in ("", *PARTS):
        yield Number(part or "all numbers and statements", in_words(rows(data, part)) or "inputs")


def table(data: xr.Dataset) -> list[Row]:
    """Return the counts, then the rows of each part under its name."""
    total, *of_parts = compare("thesis", numbers(data))
    found = [total]
    for part, line in zip(PARTS, of_parts, strict=True):
        command = f"hertzlink study {part}" if part in STUDIED else "hertzlink study thesis"
        found += [line._replace(number=line.number.upper(), remark=command), *rows(data, part)]
    return found


def summary(data: xr.Dataset) -> str:
    """Return for the terminal how many numbers agree and how many do not."""
    agree, differ, misprints = counts(rows(data)).values()
    quick = " (a quick run, whose coarser studies change a few verdicts)" if data.attrs.get("quick") else ""
    lines = [
        f"{agree + differ + misprints} numbers and statements of the thesis{quick}:",
        f"- {agree} agree; where they need a condition, the table names it.",
        f"- {differ} differ; the table says by how much, and why.",
        f"- {misprints} are misprints: the corrected form agrees.",
        f"{sum(not row.verdict for row in rows(data))} inputs and undefined numbers are not counted.",
        "",
        "table.txt and report.html hold counts by part, and each verdict and why.",
    ]
    return "\n".join(lines)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    figure, (axis,) = draw.panels(1, width=7.0, height=4.6, xlabel="numbers and statements", ylabel="part")
    left = np.zeros(len(PARTS))
    for word, shade in zip(VERDICTS, (draw.COLOURS[0], draw.COLOURS[1], "0.45"), strict=True):
        of_parts = [counts(rows(data, part))[word] for part in PARTS]
        axis.barh(range(len(PARTS)), of_parts, left=left, color=shade, label=word, height=0.7)
        left += of_parts
    axis.set_axisbelow(True)
    axis.set_ylim(len(PARTS) - 0.4, -0.6)
    axis.set_yticks(range(len(PARTS)), PARTS, fontsize="small")
    axis.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.4, 1.0))
    return {"verdicts": figure}
