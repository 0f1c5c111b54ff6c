"""Figures of the tutorial: a result's ``plot()`` gives a figure that pyplot does not know, so that it is taken here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import WeakSet

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

_shown: WeakSet[Figure] = WeakSet()

LAST = "___"  # where sphinx-gallery keeps the value of a block's last line


def scraper(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the figure that a block ends with, and return the text that shows it."""
    figure = block_vars["example_globals"].get(LAST)
    if not isinstance(figure, Figure) or figure in _shown:  # a block that ends with no value leaves the last one's
        return ""
    _shown.add(figure)
    path = next(block_vars["image_path_iterator"])
    figure.savefig(path)
    text: str = figure_rst([path], gallery_conf["src_dir"])
    return text


def _get_sg_image_scraper() -> Callable[[Any, dict[str, Any], dict[str, Any]], str]:
    return scraper
