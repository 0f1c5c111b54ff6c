"""The site: ``sphinx-build -W docs out/site`` builds it, offline, from the pages, the docstrings and what it runs."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

DOCS = Path(__file__).parent
SCRIPTS = DOCS.parent / "out" / "tutorial"  # scripts run where they lie, and write files there
sys.path.insert(0, str(DOCS / "_ext"))
shutil.copytree(DOCS / "examples", SCRIPTS, dirs_exist_ok=True)

import matplotlib  # noqa: E402

import smartshoe  # noqa: E402

matplotlib.use("agg")

project = "smartshoe"
author = "The smartshoe founders"
release = version = smartshoe.__version__
copyright = "the smartshoe founders, MIT licence"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
    "commands",
    "stored",
]
exclude_patterns = ["examples", "**/sg_execution_times.rst", "sg_execution_times.rst"]
default_role = "py:obj"

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]

napoleon_google_docstring = False
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "inherited-members": False}
autosummary_generate = True

sphinx_gallery_conf = {
    "examples_dirs": [str(SCRIPTS)],
    "gallery_dirs": ["tutorial"],
    "filename_pattern": "",
    "within_subsection_order": "ExampleTitleSortKey",
    "abort_on_example_error": True,
    "run_stale_examples": True,  # the code they call may have changed
    "download_all_examples": False,
    "min_reported_time": 1e9,  # how long it took says something of the machine that built the site
    "show_memory": False,
    "image_scrapers": ("matplotlib", "figures"),
    "show_signature": False,
    "remove_config_comments": True,
    "capture_repr": ("_repr_html_", "__repr__"),
    "ignore_repr_types": r"matplotlib\.",
}

html_theme = "furo"
html_title = "smartshoe"
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
