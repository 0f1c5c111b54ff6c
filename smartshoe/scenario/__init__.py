"""Scenarios: a TOML file that says which devices, protocols and steps; read, checked and run."""

from smartshoe.scenario.run import ScenarioResult, UnitResult, run, simulate, simulate_trial
from smartshoe.scenario.schema import Scenario, load

__all__ = ["Scenario", "ScenarioResult", "UnitResult", "load", "run", "simulate", "simulate_trial"]
