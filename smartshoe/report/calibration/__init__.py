"""The report on a calibration: a page with a verdict on each unit, and the numbers behind it."""

from smartshoe.report.calibration._judgement import headline, judge
from smartshoe.report.calibration._page import write_page
from smartshoe.report.calibration._unit_report import DiagnosisLink, UnitReport

__all__ = [
    "DiagnosisLink",
    "UnitReport",
    "write_page",
    "headline",
    "judge",
]
