"""The files of a study: netCDF, table, figures and report, from a new run or drawn again from its netCDF file."""

from pathlib import Path
from textwrap import wrap

import xarray as xr

from coupling.files.loading import read_netcdf
from coupling.results.provenance import stored
from hertzlink.studies import STUDIES, LongStudy, Study, draw
from hertzlink.studies.table import WIDTH, text

TABLE, REPORT = "table.txt", "report.html"  # File names of the table and of the report.
# The remark on every table, figure, report and Dataset of a run with --quick.
QUICK = "quick run (--quick), for a first look only"
REMARK_HEIGHT = 0.2  # Height, in inches, of each line of small text in the strip below a figure that holds remarks.
LETTERS_PER_INCH = 14  # About as many of such text fit.
# Formats of figures, and the name under which their files hold a remark.
FORMATS = {"png": "Comment", "svg": "Description", "pdf": "Subject"}


class Written:
    """The table and the figures of a study's data, made once and then written."""

    def __init__(self, name: str, study: Study, data: xr.Dataset, form: str = "png") -> None:
        self.name, self.data, self.form = name, data, form
        self._comment = str(data.attrs.get("comment", ""))
        self._rows = study.table(data)
        with draw.style():
            self._figures = study.figures(data)
        self.table = (f"{fill(self._comment)}\n\n" if self._comment else "") + text(self._rows)
        self.shown = study.summary(data) if isinstance(study, LongStudy) else self.table
        """What a terminal shows."""

    def write(self, into: Path, data: xr.Dataset | None = None) -> None:
        """Write all files but the list of them. data: the Dataset with its provenance and warnings.

        Without data what is drawn from the netCDF file is written, and no such file.
        """
        if data is not None:
            (into / f"{self.name}.nc").write_bytes(data.to_netcdf(engine="h5netcdf"))
        (into / TABLE).write_text(self.table + "\n", encoding="utf-8")
        for title, figure in self._figures.items():
            if self._comment:
                stamp(figure, self._comment)
            noted = {FORMATS[self.form]: self._comment} if self._comment else None
            figure.savefig(into / f"{title}.{self.form}", metadata=noted)
        # Here: other commands need no report.
        from hertzlink.reports.of_studies import study_report

        shown = self.data if data is None else data
        page = study_report(self.name, shown, self._rows, self._figures, self._comment)
        (into / REPORT).write_text(page, encoding="utf-8")


def stamp(figure: draw.Figure, words: str) -> None:
    """Write words into a separate strip below a figure."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    lines = fill(words, int(LETTERS_PER_INCH * figure.get_figwidth()))
    figure.set_figheight(figure.get_figheight() + lines.count("\n") * REMARK_HEIGHT)
    strip = (1 + lines.count("\n")) * REMARK_HEIGHT / figure.get_figheight()
    layout = figure.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        layout.set(rect=(0.0, strip, 1.0, 1.0 - strip))
    below = 0.06 / figure.get_figheight()
    figure.text(0.99, below, lines, ha="right", va="bottom", color="firebrick", fontsize="small")


def fill(words: str, width: int = WIDTH) -> str:
    """Return the lines of words, none longer than a number of letters."""
    return "\n".join(part for line in words.splitlines() for part in wrap(line, width))


def read_study(file: Path) -> tuple[str, xr.Dataset]:
    """Return name and the data of a study from the netCDF file that it wrote; raise a ValueError for any other file."""
    data = read_netcdf(file)
    name = stored(data.attrs.get("input")).get("study")
    if name not in STUDIES:
        raise ValueError(f"{file}: was not written by a study; give the .nc file of `hertzlink study`")
    return str(name), data
