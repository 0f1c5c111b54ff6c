"""What a person reads: the HTML report and the terminal's tables (`smartshoe.report.tables`)."""

from __future__ import annotations

from smartshoe.report.model import Report, UnitReport
from smartshoe.report.page import write_report

__all__ = ["Report", "UnitReport", "write_report"]
