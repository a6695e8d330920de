"""The files of a study: netCDF, table, figures and report, from a new run or drawn again from its netCDF file."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from hertzlink.studies import STUDIES, Study
from hertzlink.studies.table import text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE, REPORT = "table.txt", "report.html"
"""File names of the table and of the report."""

QUICK = "quick run (--quick), for a first look only"
"""The remark on every table, figure, report and Dataset of a run with --quick."""

REMARK_HEIGHT = 0.2
"""Height, in inches, of the strip below a figure that holds this remark: one line of small text."""

FORMATS = {"png": "Comment", "svg": "Description", "pdf": "Subject"}
"""Formats of figures, and the name under which their files hold a remark."""


class Written:
    """The table and the figures of a study's data, made once and then written."""

    def __init__(self, name: str, study: Study, data: xr.Dataset, form: str = "png") -> None:
        self.name, self.data, self.form = name, data, form
        self.remark = QUICK if data.attrs.get("quick") else ""
        self._about = (study.__doc__ or "").strip().split("\n")[0]
        self._rows, self._figures = study.table(data), study.figures(data)
        self.table = (f"{self.remark}\n\n" if self.remark else "") + text(self._rows)

    def write(self, into: Path, data: xr.Dataset) -> None:
        """All files but the list of them. data: the Dataset with its provenance and warnings."""
        self._write_drawn(into, data)
        (into / f"{self.name}.nc").write_bytes(data.to_netcdf(engine="h5netcdf"))

    def write_again(self, into: Path) -> None:
        """All that is drawn from the netCDF file, without it."""
        self._write_drawn(into, self.data)

    def _write_drawn(self, into: Path, data: xr.Dataset) -> None:
        (into / TABLE).write_text(self.table + "\n", encoding="utf-8")
        for title, figure in self._figures.items():
            if self.remark:
                stamp(figure, self.remark)
            noted = {FORMATS[self.form]: self.remark} if self.remark else None
            figure.savefig(into / f"{title}.{self.form}", metadata=noted)
        # Here: other commands need no report.
        from hertzlink.reports.of_studies import study_report

        page = study_report(self.name, self._about, data, self._rows, self._figures, self.remark)
        (into / REPORT).write_text(page, encoding="utf-8")


def stamp(figure: "Figure", words: str) -> None:
    """Write words into a separate strip below a figure."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    strip, layout = REMARK_HEIGHT / figure.get_figheight(), figure.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        layout.set(rect=(0.0, strip, 1.0, 1.0 - strip))
    figure.text(0.99, 0.3 * strip, words, ha="right", va="bottom", color="firebrick", fontsize="small")


def read_study(file: Path) -> tuple[str, xr.Dataset]:
    """The name and the data of a study from the netCDF file that it wrote; a ValueError for any other file."""
    try:
        with xr.open_dataset(file, engine="h5netcdf") as opened:
            data = opened.load()
    except FileNotFoundError:
        raise ValueError(f"{file}: does not exist") from None
    except (OSError, ValueError) as error:
        raise ValueError(f"{file}: cannot be read as netCDF ({error})") from error
    try:
        name = json.loads(data.attrs.get("input", "{}")).get("study")
    except (ValueError, AttributeError):
        name = None
    if name not in STUDIES:
        raise ValueError(f"{file}: was not written by a study; give the .nc file of `hertzlink study`")
    return str(name), data
