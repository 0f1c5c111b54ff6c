"""The page is well formed, whole, and takes any name for what it is: text."""

from __future__ import annotations

import io
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest

import smartshoe
from smartshoe.compensate import Calibration
from smartshoe.report import Report, UnitReport, write_report
from smartshoe.report.figures import decimate, unit_figures
from smartshoe.report.numbers import with_sd
from smartshoe.report.tables import print_summary, print_validation
from smartshoe.units import MILLIBAR
from smartshoe.validate import validate

VOID = {"meta", "br", "img", "link", "hr", "input"}


class _Balance(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def _unit(name: str) -> UnitReport:
    time_s = np.arange(0.0, 30.0, 0.01)
    load = np.interp(time_s, [2.0, 10.0, 18.0, 20.0, 21.0, 22.0], [0.0, 800.0, 0.0, 0.0, 800.0, 0.0])
    recording = smartshoe.Recording.from_arrays(
        time_s=time_s, force_n=load, pressure_mbar=load / 4, unit=name
    )
    calibration = Calibration(a1=1.0, b0=5.0, b1=4.0, reading_unit=MILLIBAR, unit=name)
    filter_ = calibration.compensator(100.0)
    found = {
        "parameters": {key: {"value": 1.0, "sd": 0.01, "unit": "1"} for key in ("k1", "k2", "c")},
        "fit_percent": 99.0,
        "reading_unit": "mbar",
    }
    info = {"a1": 1.0, "b0": 5.0, "b1": 4.0, "rate": 100.0}
    info |= {"numerator": filter_.numerator, "denominator": filter_.denominator}
    return UnitReport(name, found, validate(recording, calibration), [recording], info)


def test_the_page_is_well_formed_and_escapes_names(tmp_path):
    names = ("left_toe", "<script>alert(1)</script>")
    page = write_report(
        tmp_path / "out", Report("A & B", "", [_unit(name) for name in names]), result_json="{}"
    )
    text = page.read_text(encoding="utf-8")
    parser = _Balance()
    parser.feed(text)
    assert parser.open == []
    assert "script" not in parser.tags
    assert "left_toe" in text
    assert "&lt;script&gt;" in text
    assert text.count("<figure>") == 8
    assert (tmp_path / "out" / "result.json").read_text() == "{}"


def test_figures_are_small_valid_xml_with_a_title():
    for caption, svg in unit_figures(_unit("a<b&c")):
        root = ElementTree.fromstring(svg)
        assert root[0].text == f"a<b&c: {caption}"
        assert len(svg) < 100_000


def test_decimation_keeps_the_extremes():
    values = np.random.default_rng(5).normal(size=100_001)
    time, kept = decimate(np.arange(values.size) * 1.0, values)
    assert kept.size <= 800
    assert (kept.min(), kept.max()) == (values.min(), values.max())
    assert (np.diff(time) > 0).all()


@pytest.mark.parametrize(
    ("value", "sd", "shown"),
    [(0.21504, 0.00081, "0.21504 ± 0.00081"), (1234.6, 56.0, "1235 ± 56"), (1.0, 0.0, "1.0000 (fixed)")],
)
def test_an_error_bar_sets_the_digits(value, sd, shown):
    assert with_sd({"value": value, "sd": sd}) == shown


def test_tables_name_units_and_rates():
    unit = _unit("left_toe")
    text = io.StringIO()
    print_validation(unit.validation.to_dict(), text)
    print_summary(
        [
            {
                "unit": unit.name,
                "identification": unit.identification_dict,
                "validation": unit.validation.to_dict(),
            }
        ],
        text,
    )
    for word in ("left_toe", "rate N/s", "800", "1.000 ± 0.010"):
        assert word in text.getvalue()
    assert max(map(len, text.getvalue().splitlines())) <= 110
