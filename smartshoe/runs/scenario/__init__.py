"""Scenarios: TOML files that name devices, protocols and analyses; here they are read, checked and run."""

from smartshoe.runs.scenario._keys import Tables, parse_assignments, with_values
from smartshoe.runs.scenario._run import (
    ScenarioResult,
    UnitResult,
    check_machines,
    check_simulated,
    noise_of,
    protocols_of,
    run,
    sample_rate_of,
    simulate,
    simulate_trial,
    steps_of,
)
from smartshoe.runs.scenario._schema import (
    ProtocolTable,
    Scenario,
    ScenarioKeyError,
    ScenarioText,
    checked,
    load,
    read_tables,
)

__all__ = [
    "Scenario",
    "ScenarioResult",
    "UnitResult",
    "check_machines",
    "check_simulated",
    "checked",
    "load",
    "noise_of",
    "protocols_of",
    "read_tables",
    "run",
    "sample_rate_of",
    "simulate",
    "simulate_trial",
    "steps_of",
    "ProtocolTable",
    "ScenarioKeyError",
    "ScenarioText",
    "Tables",
    "parse_assignments",
    "with_values",
]
