"""The documentation site: `sphinx-build -W docs build/site`, with the extra `docs`."""

import logging
import re
import sys
import warnings
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "site")]

import gallery_pages
import matplotlib as mpl
import reference_pages

import hertzlink

mpl.use("Agg")
warnings.filterwarnings("ignore", category=hertzlink.HertzlinkWarning)

for own in ("hertzlink", "skfem"):
    logging.getLogger(own).setLevel(logging.WARNING)

project = "hertzlink"
author = "the hertzlink developers"
project_copyright = "2026, the hertzlink developers"
release = version = hertzlink.__version__

extensions = [
    "myst_parser",
    "formulas",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
    "sphinx_design",
]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
exclude_patterns = ["_examples", "_build", "packaging", "paper"]
html_theme = "furo"
html_math_renderer = "drawn"
html_static_path = ["site/static"]
html_css_files = ["site.css"]
html_title = f"hertzlink {release}"
html_show_sourcelink = False
html_copy_source = False

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
default_role = "code"

gallery_pages.write(HERE.parent / "examples", HERE / "_examples")
reference_pages.write(HERE / "reference")

sphinx_gallery_conf = {
    "examples_dirs": str(HERE / "_examples"),
    "gallery_dirs": str(HERE / "gallery"),
    "filename_pattern": gallery_pages.PATTERN,
    "abort_on_example_error": True,
    "within_subsection_order": "FileNameSortKey",
    "capture_repr": (),
    "default_thumb_file": str(HERE / "beads.png"),
    "thumbnail_size": (320, 224),
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "download_all_examples": False,
    "write_computation_times": False,
    "min_reported_time": 1000,
    "nested_sections": False,
}
# sphinx-gallery's configuration holds objects that cannot be pickled; the warning is not for readers.
suppress_warnings = ["config.cache"]


def plain_bars(app: Any, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Docstrings write |x| for the absolute value, which reStructuredText takes for a substitution."""
    lines[:] = [line if line.lstrip().startswith(">>>") else line.replace("|", r"\|") for line in lines]


def without_aliases(app: Any, what: str, name: str, thing: object, skip: bool, options: object) -> bool | None:
    """The fields of named tuples are described among the parameters."""
    return True if str(getattr(thing, "__doc__", "")).startswith("Alias for field number") else None


def page_of_the_site(app: Any, page: str, template: str, context: dict[str, Any], document: object) -> None:
    """The sidebar lists the reference's names on the pages of the reference alone; elsewhere they took half of the time
    of the build. Long names of files and functions may break behind their underscores and slashes.
    """
    if whole := context.get("toctree"):
        context["toctree"] = lambda **given: whole(**given | {"collapse": True})
    context["body"] = re.sub(
        r'(?<=<span class="pre">)[^<&]{13,}(?=</span>)',
        lambda name: re.sub(r"(?<!test_)(?<=[_/])(?=\w)", "<wbr>", name[0]),
        context.get("body", ""),
    )


def setup(app: Any) -> None:
    app.connect("html-page-context", page_of_the_site, priority=100)  # before the theme
    app.connect("autodoc-skip-member", without_aliases)
    app.connect("source-read", gallery_pages.link)
    app.connect("autodoc-process-docstring", plain_bars, priority=100)
