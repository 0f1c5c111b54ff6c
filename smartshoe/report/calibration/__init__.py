"""A calibration as a page: what to trust, what to look at, and the numbers behind."""

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
