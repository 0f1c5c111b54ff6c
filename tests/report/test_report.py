"""The report: well-formed, self-contained, and safe with any name."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from balance import Balance

from smartshoe.identification import identify
from smartshoe.recording import Recording
from smartshoe.report.numbers import plain, with_sd
from smartshoe.report.page import UnitReport, write_page
from smartshoe.validation import validate

NAME = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    from scipy import signal

    time_s = np.arange(0, 40, 0.01)
    load_n = np.interp(time_s, [0, 2, 10, 18, 22, 23, 24, 40], [0, 0, 800, 0, 0, 800, 0, 0])
    _, reading, _ = signal.lsim(([1, 0.2], [1.6, 0.3]), load_n, time_s)
    rng = np.random.default_rng(1)
    recording = Recording.from_arrays(
        time_s=time_s, force_n=load_n + rng.normal(0, 1, load_n.size), pressure_mbar=reading, name="check", unit=NAME
    )
    found = identify([recording])
    unit = UnitReport(
        NAME, found.to_dict(), validate([recording], found.calibration()), [recording], ("check",), ("check",)
    )
    path = write_page(tmp_path_factory.mktemp("report") / "report.html", "A & B", "about", {"seed": "1"}, [unit])
    return Path(path).read_text(encoding="utf-8")


def test_the_page_is_well_formed_and_needs_no_network(page: str) -> None:
    parser = Balance()
    parser.feed(page)
    assert parser.open == []
    assert "script" not in parser.tags
    assert not re.search(r'(?:src|href)="https?:', re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL))


def test_names_are_escaped(page: str) -> None:
    assert NAME not in page
    assert "&lt;script&gt;" in page
    assert "A &amp; B" in page


def test_each_figure_is_valid_svg_and_says_what_it_is(page: str) -> None:
    figures = re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL)
    assert len(figures) == 4
    for figure in figures:
        ET.fromstring(figure)
        assert len(figure) < 200_000
    assert page.count('role="img" aria-label=') == 4


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (1234.5, 3, "1234"),
        (0.012345, 3, "0.0123"),
        (0, 3, "0"),
        (None, 3, "–"),
        (float("nan"), 3, "–"),
        (9.996, 3, "10.00"),
    ],
)
def test_numbers_are_short(value: float | None, digits: int, text: str) -> None:
    assert plain(value, digits) == text


def test_an_error_bar_sets_the_digits() -> None:
    assert with_sd({"value": 1.34098765, "sd": 0.000612}) == "1.34099 ± 0.00061"
    assert with_sd({"value": 2.0, "sd": None}) == "2.0000"
