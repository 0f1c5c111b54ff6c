"""Integrity of the data: faults of clocks, loggers and converters, found before any model is asked."""

from smartshoe.integrity.examination import examine
from smartshoe.integrity.fault import DataFault, Integrity

__all__ = ["DataFault", "Integrity", "examine"]
