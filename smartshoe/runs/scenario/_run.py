"""Runs a scenario: devices, protocols, identification, validation, diagnosis, and the trial."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.calibration import Calibration
from smartshoe.calibration.validation import Validation, validate
from smartshoe.devices import TestMachine, open_machine
from smartshoe.errors import InputError, LimitError, OptionError, SmartShoeError
from smartshoe.files.logs import read
from smartshoe.identification import Identification, identify
from smartshoe.protocol import Protocol
from smartshoe.recording import Recording
from smartshoe.runs.scenario._schema import DiagnoseTable, Scenario, ScenarioText
from smartshoe.runs.scenario._trial import RecordedTrial, TrialResult, analyse_trial, opened_shoe, record_trial
from smartshoe.version import __version__

if TYPE_CHECKING:
    from smartshoe.diagnosis import Diagnosis

Progress = Callable[[str], None]


def _silent(_: str) -> None:
    return None


@dataclass(frozen=True, eq=False)
class UnitResult:
    """The result for one unit: its recordings by experiment, and the result of each step."""

    name: str
    recordings: dict[str, Recording]
    identification: Identification
    calibration: Calibration
    validation: Validation
    fitted: tuple[str, ...]
    judged: tuple[str, ...]
    truth: dict[str, Any] = field(default_factory=dict)
    diagnosis: Diagnosis | None = None

    @cached_property
    def identified(self) -> dict[str, Any]:
        """`Identification.to_dict`, computed once for result, page and terminal."""
        return self.identification.to_dict()

    def to_dict(self) -> dict[str, Any]:
        """The unit's part of ``result.json``."""
        return {
            "unit": self.name,
            "recordings": {
                name: {
                    "samples": len(recording),
                    "duration_s": recording.duration_s,
                    "source": recording.source,
                }
                for name, recording in self.recordings.items()
            },
            "fitted": list(self.fitted),
            "judged": list(self.judged),
            "device": self.truth,
            "identification": self.identified,
            "validation": self.validation.to_dict(),
            "diagnosis": self.diagnosis.to_dict() if self.diagnosis else None,
        }


@dataclass(frozen=True, eq=False)
class ScenarioResult:
    """The results of all units of a scenario, and of its trial."""

    scenario: Scenario
    source: Path
    units: tuple[UnitResult, ...]
    trial: TrialResult | None = None

    def to_dict(self) -> dict[str, Any]:
        """The whole result in schema ``smartshoe.run/1``."""
        trial = {"trial": self.trial.to_dict()} if self.trial is not None else {}
        return {
            "schema": "smartshoe.run/1",
            "scenario": self.source.name,
            "title": self.scenario.title,
            "seed": self.scenario.seed,
            "version": __version__,
            "units": [unit.to_dict() for unit in self.units],
            **trial,
        }


def _seed_of(scenario: Scenario, name: str) -> int:
    """A seed for one unit, from its name only, so that adding a unit does not change the others' noise."""
    return int(np.random.SeedSequence([scenario.seed, zlib.crc32(name.encode())]).generate_state(1)[0])


def protocols_of(scenario: Scenario, source: ScenarioText) -> dict[str, Protocol]:
    """The scenario's protocols by name; raises `ScenarioError` for one that exceeds its limits."""
    built: dict[str, Protocol] = {}
    for name, table in scenario.protocol.items():
        try:
            built[name] = table.build(name)
        except LimitError as error:
            raise source.error(("protocol", name), str(error)) from error
    return built


def noise_of(scenario: Scenario, source: ScenarioText) -> tuple[str, float] | None:
    """The unit with the largest ``sensor.noise_percent`` above zero and that value; None if no unit states one.

    Raises `ScenarioError` for a value that is not a number from 0 on.
    """
    stated = _stated(scenario, source, "sensor", "noise_percent")
    largest, name = max(stated, key=lambda one: one[0], default=(0.0, ""))
    return (name, largest) if largest > 0.0 else None


def sample_rate_of(scenario: Scenario, source: ScenarioText) -> float | None:
    """The lowest ``daq.sample_rate_hz`` above zero that a unit states; None if no unit states one."""
    stated = _stated(scenario, source, "daq", "sample_rate_hz")
    return min((rate for rate, _ in stated if rate > 0.0), default=None)


def _stated(scenario: Scenario, source: ScenarioText, table: str, key: str) -> list[tuple[float, str]]:
    """Values that units state, in their own options or the machine's, under a key of a table, with the units' names."""
    found: list[tuple[float, str]] = []
    for index, unit in enumerate(scenario.unit):
        options = {**scenario.machine.options, **unit.options}.get(table)
        given = options.get(key) if isinstance(options, dict) else None
        if given is None:
            continue
        if isinstance(given, bool) or not isinstance(given, int | float) or not 0.0 <= given < math.inf:
            at = ("unit", index) if table in unit.options else ("machine",)
            raise source.error((*at, table, key), f"is {given!r}: give a number from 0 on")
        found.append((float(given), unit.name))
    return found


def _record(
    scenario: Scenario, source: ScenarioText, index: int, protocols: dict[str, Protocol], progress: Progress
) -> dict[str, Recording]:
    unit = scenario.unit[index]
    if unit.recordings:
        found: dict[str, Recording] = {}
        for name in unit.recordings:
            path = Path(name) if Path(name).is_absolute() else source.path.parent / name
            if not path.exists():
                raise InputError(
                    f"{path} does not exist: copy the scenario beside your recordings and name them in it, or make"
                    " these there with smartshoe simulate scenarios/calibration.toml --out FOLDER"
                )
            progress(f"{unit.name}: reading {path.name}")
            found[path.stem] = read(
                path,
                time=unit.columns.time,
                force=unit.columns.force,
                sensors=[unit.columns.sensor] if unit.columns.sensor else [],
                unit=unit.name,
                name=path.stem,
            )
        return found
    recordings: dict[str, Recording] = {}
    with _machine_of(scenario, source, index) as machine:
        # All protocols are checked before the first one moves the machine.
        _check_protocols(machine, protocols, source)
        for name, protocol in protocols.items():
            progress(f"{unit.name}: {name}")
            recordings[name] = machine.run(protocol)
    return recordings


def _machine_of(scenario: Scenario, source: ScenarioText, index: int) -> TestMachine:
    """The machine with the unit under it; raises `ScenarioError` for an unknown or invalid option."""
    unit = scenario.unit[index]
    options = _beside(source, {**scenario.machine.options, **unit.options})
    try:
        return open_machine(scenario.machine.backend, unit=unit.name, seed=_seed_of(scenario, unit.name), **options)
    except OptionError as error:
        in_machine = error.keys[:1] != () and error.keys[0] in {*scenario.machine.options} - {*unit.options}
        raise source.from_option(error, ("machine",) if in_machine else ("unit", index)) from error


def _check_protocols(machine: TestMachine, protocols: dict[str, Protocol], source: ScenarioText) -> None:
    for name, protocol in protocols.items():
        try:
            machine.check(protocol)
        except LimitError as error:
            raise source.error(("protocol", name), str(error)) from error


def check_simulated(scenario: Scenario, source: ScenarioText) -> None:
    """Open every simulated device of the scenario and check its protocols, without moving anything.

    So a misspelt option is reported before the first experiment. Devices that are not simulated are left alone. Raises
    `ScenarioError`, which points into the scenario.
    """
    check_machines(scenario, source)
    if scenario.trial is not None and scenario.trial.shoe.startswith("sim:"):
        with opened_shoe(scenario, source, scenario.seed):
            pass


def check_machines(scenario: Scenario, source: ScenarioText) -> None:
    """Check the simulated machines alone and their protocols, as in `check_simulated`."""
    protocols = protocols_of(scenario, source)
    if scenario.machine.backend.startswith("sim:"):
        for index, unit in enumerate(scenario.unit):
            if not unit.recordings:
                with _machine_of(scenario, source, index) as machine:
                    _check_protocols(machine, protocols, source)


def _beside(source: ScenarioText, options: dict[str, Any]) -> dict[str, Any]:
    """``options`` in which the calibration file of a twin is looked up in the scenario's folder, as recordings are."""
    bladder = options.get("bladder")
    if not isinstance(bladder, dict) or not isinstance(bladder.get("twin"), str):
        return options
    return {**options, "bladder": {**bladder, "twin": str(source.path.parent / bladder["twin"])}}


def simulate(scenario: Scenario, source: ScenarioText, progress: Progress = _silent) -> dict[str, dict[str, Recording]]:
    """Run only the machines: recordings by unit and experiment."""
    protocols = protocols_of(scenario, source)
    return {
        unit.name: _record(scenario, source, index, protocols, progress) for index, unit in enumerate(scenario.unit)
    }


def simulate_trial(scenario: Scenario, source: ScenarioText, progress: Progress = _silent) -> RecordedTrial | None:
    """Run only the shoes: the recording of the scenario's trial; None if there is no ``[trial]``."""
    if scenario.trial is None:
        return None
    progress(f"{scenario.trial.name}: recording")
    return record_trial(scenario, source, _seed_of(scenario, f"trial/{scenario.trial.name}"))


def _chosen(recordings: dict[str, Recording], use: tuple[str, ...]) -> tuple[str, ...]:
    names = tuple(name for name in use if name in recordings)
    return names or tuple(recordings)


def diagnosed_on(recordings: dict[str, Recording], settings: DiagnoseTable) -> list[Recording]:
    """The recordings that a diagnosis is fitted to: those named in ``use``, or all that are not held out."""
    held_out = set(settings.hold_out)
    used = settings.use or tuple(name for name in recordings if name not in held_out)
    return [recordings[name] for name in used if name in recordings]


def _diagnosed(recordings: dict[str, Recording], settings: DiagnoseTable) -> Diagnosis:
    from smartshoe.diagnosis import diagnose

    # Without their source recordings are named by experiment, not by the machine they all come from.
    named = {name: one if Path(one.source).is_file() else replace(one, source="") for name, one in recordings.items()}
    return diagnose(
        diagnosed_on(named, settings),
        hold_out=[named[name] for name in settings.hold_out if name in named],
        material=settings.material_percent / 100.0,
    )


def steps_of(scenario: Scenario) -> int:
    """How often `run` reports its progress."""
    pressed = sum(len(unit.recordings) or len(scenario.protocol) for unit in scenario.unit)
    of_each = 2 + (scenario.diagnose is not None)
    return pressed + of_each * len(scenario.unit) + 2 * (scenario.trial is not None)


def run(scenario: Scenario, source: ScenarioText, progress: Progress = _silent) -> ScenarioResult:
    """Run devices, then identification, calibration and validation of each unit, then the trial.

    Raises what the steps raise, with the unit's name in front.
    """
    settings = scenario.identify
    results: list[UnitResult] = []
    # Before the fits, so that an impossible trial is refused at once.
    recorded = simulate_trial(scenario, source, progress)
    if recorded is not None:
        calibrated = {unit.name for unit in scenario.unit}
        surplus = [channel.name for channel in recorded.recording.sensors if channel.name not in calibrated]
        if surplus:
            raise source.error(("trial",), f"{', '.join(surplus)} would not be calibrated: add a [[unit]] for each")
    for name, recordings in simulate(scenario, source, progress).items():
        fitted = _chosen(recordings, settings.use)
        judged = _chosen(recordings, scenario.validate_.use)
        progress(f"{name}: identifying")
        try:
            found = identify(
                [recordings[key] for key in fitted],
                direction=settings.direction,
                method=settings.method,
                structure=settings.structure,
                offset=settings.offset,
                delay=settings.delay,
                initial_state=settings.initial_state,
                prefilter_rad_s=settings.prefilter_rad_s,
            )
            calibration = found.calibration()
            progress(f"{name}: validating")
            validation = validate([recordings[key] for key in judged], calibration)
            diagnosis = None
            if scenario.diagnose is not None:
                progress(f"{name}: diagnosing")
                diagnosis = _diagnosed(recordings, scenario.diagnose)
        except SmartShoeError as error:
            error.args = (f"{source.path}, unit {name}: {error}",)
            raise
        truth = next(unit.options for unit in scenario.unit if unit.name == name)
        results.append(
            UnitResult(name, recordings, found, calibration, validation, fitted, judged, dict(truth), diagnosis)
        )
    trial = None
    if recorded is not None and scenario.trial is not None:
        progress(f"{scenario.trial.name}: events, strides, forces")
        trial = analyse_trial(scenario.trial, recorded, [unit.calibration for unit in results])
    return ScenarioResult(scenario, source.path, tuple(results), trial)
