"""Integrity of the data: faults of clocks, loggers and converters, found before any model is asked."""

from smartshoe.integrity._examination import examine
from smartshoe.integrity._fault import DataFault, Integrity, OneClock
from smartshoe.integrity._quantisation import coarse_step
from smartshoe.integrity._twins import Twin, twins
from smartshoe.integrity._twins_by_noise import twins_by_noise

__all__ = ["DataFault", "Integrity", "OneClock", "Twin", "coarse_step", "examine", "twins", "twins_by_noise"]
