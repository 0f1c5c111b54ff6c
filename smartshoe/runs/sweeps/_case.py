"""One case of a sweep: runs its scenario and collects its figures; the bytes are the same wherever it is computed."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from smartshoe.errors import DeviceError, SmartShoeError
from smartshoe.files.atomic import json_text
from smartshoe.kernels.blas import on_one_thread
from smartshoe.models.effects import failure_of_others
from smartshoe.runs.scenario import ScenarioText, checked, run
from smartshoe.runs.sweeps._plan import Case

if TYPE_CHECKING:
    from smartshoe.runs.scenario import ScenarioResult, UnitResult

Figures = dict[str, Any]

SCHEMA = "smartshoe.case/1"
JUDGED = (
    "rmse_raw_n",
    "rmse_static_n",
    "rmse_compensated_n",
    "improvement_percent",
    "improvement_over_static_percent",
    "hysteresis_raw_percent",
    "hysteresis_compensated_percent",
    "peak_error_n",
    "delay_s",
)


def computed(case: Case) -> str:
    """The case's JSON text: its figures, or the reason for which it has none.

    A case that fails is a valid result. Lack of memory or a failing disk is not, and raises `DeviceError`.
    """
    outcome: dict[str, Any]
    try:
        outcome = {"status": "done", "says": None, "figures": figures_of(_run(case))}
    except SmartShoeError as error:
        outcome = {"status": "failed", "says": _sentence(str(error), case), "figures": {}}
    except (OSError, MemoryError) as error:
        raise DeviceError(
            f"case {case.name} could not be computed here ({type(error).__name__}: {error}): mend that, and the same"
            " command goes on"
        ) from error
    except Exception as error:  # a bug in one case must not stop the others; it is reported in the case
        ours = f"{type(error).__name__}: {error} (a fault of smartshoe's: please report it)"
        said = _sentence(failure_of_others(error) or ours, case)
        outcome = {"status": "failed", "says": said, "figures": {}}
    return json_text(
        {
            "schema": SCHEMA,
            "scenario": Path(case.source).name,
            "version": case.version,
            "seed": case.seed,
            "vary": dict(case.values),
            **outcome,
        }
    )


# With several threads sums are formed in another order and differ in the last digits.
@on_one_thread
def _run(case: Case) -> ScenarioResult:
    source = ScenarioText(Path(case.source), case.text)
    return run(checked(case.tables, source), source)


def _sentence(said: str, case: Case) -> str:
    """The error as one line, with files named relative to the scenario's folder, so that all machines give the same."""
    return " ".join(said.replace(f"{Path(case.source).parent}{os.sep}", "").split())


def figures_of(result: ScenarioResult) -> Figures:
    """The figures of a run by name, ``UNIT.FIGURE`` and ``trial.FIGURE``: numbers, words, or None."""
    found: Figures = {}
    for unit in result.units:
        found.update({f"{unit.name}.{name}": value for name, value in _of_unit(unit).items()})
    if result.trial is not None:
        summary = _flat(result.trial.gait.summary, "")
        against = _flat(result.trial.against_truth or {}, "")
        found.update({f"trial.{name}": value for name, value in {**summary, **against}.items()})
    return found


def _of_unit(unit: UnitResult) -> Figures:
    identification, overall = unit.identification, unit.validation.overall
    found: Figures = {}
    for name, parameter in identification.parameters.items():
        found[name] = _finite(parameter.value)
        found[f"{name}_sd"] = _finite(parameter.sd)
    found["fit_percent"] = _finite(identification.fit_percent)
    found.update({name: _finite(getattr(overall, name)) for name in JUDGED})
    if unit.diagnosis is not None:
        diagnosis = unit.diagnosis.to_dict()
        found["verdict"] = diagnosis["verdict"]
        found["causes"] = " ".join(cause["effect"] for cause in diagnosis["causes"])
        found["data_faults"] = " ".join(fault["kind"] for fault in diagnosis["data_faults"])
        found["explained_percent"] = diagnosis["explained_percent"]
        found["explainable_percent"] = diagnosis["explainable_percent"]
    return found


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and abs(value) < float("inf") else None


def _flat(given: Mapping[str, Any], before: str) -> Figures:
    """Numbers and words of nested tables, by dotted name; a list of words becomes one text."""
    found: Figures = {}
    for name, value in given.items():
        if isinstance(value, Mapping):
            found.update(_flat(value, f"{before}{name}."))
        elif isinstance(value, list | tuple):
            found[f"{before}{name}"] = " ".join(str(each) for each in value)
        else:
            found[f"{before}{name}"] = _finite(value) if isinstance(value, float) else value
    return found
