"""Sweeps: one scenario run many times, over designs of its keys and over seeds, on all cores or on a cluster."""

from smartshoe.runs.sweeps._running import SweepResult, sweep

__all__ = ["SweepResult", "sweep"]
