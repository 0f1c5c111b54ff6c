"""A calibration as a page: what to trust, what to look at, and the numbers behind."""

from smartshoe.report.calibration.page import write_page
from smartshoe.report.calibration.unit_report import DiagnosisLink, UnitReport

__all__ = ["DiagnosisLink", "UnitReport", "write_page"]
