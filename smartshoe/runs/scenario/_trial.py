"""A scenario's trial: a person in calibrated shoes; raw and corrected forces are compared with the truth, if known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices import Shoe, open_shoe
from smartshoe.errors import OptionError, UsageError
from smartshoe.recording import Channel, Recording
from smartshoe.runs.scenario._against_truth import compare
from smartshoe.runs.scenario._schema import Scenario, ScenarioText, TrialTable
from smartshoe.units import NEWTON

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration
    from smartshoe.gait import GaitResult


WORN = ("bladder", "sensor")  # keys of a unit that a shoe needs, too; the others are for the testing machine


class TrialEvent(Protocol):
    """A true event of a simulated trial."""

    @property
    def time_s(self) -> float:
        """The event's time on the recording's clock."""

    @property
    def foot(self) -> str:
        """The event's foot, one of the truth's ``feet``."""

    @property
    def event(self) -> str:
        """The kind of event, as in `smartshoe.gait`."""


class TrialTruth(Protocol):
    """What a simulated shoe knows beside its readings, as its attribute ``truth``; a real shoe has none.

    ``load_n`` (n, units) is in the recording's order of units; ``foot_n`` (n, feet) includes the load beside the units.
    """

    @property
    def time_s(self) -> Array:
        """The recording's times (n,)."""

    @property
    def load_n(self) -> Array:
        """Each unit's load (n, units) in N."""

    @property
    def foot_n(self) -> Array:
        """Each foot's whole force (n, feet) in N."""

    @property
    def feet(self) -> tuple[str, ...]:
        """The feet, in the order of ``foot_n``."""

    @property
    def events(self) -> Sequence[TrialEvent]:
        """All events, in order."""

    @property
    def body_weight_n(self) -> float:
        """The person's weight in N."""


@dataclass(frozen=True, eq=False)
class RecordedTrial:
    """What the shoes recorded, and the truth if they are simulated."""

    recording: Recording
    truth: TrialTruth | None

    def true_loads(self) -> Recording | None:
        """The true loads as a plain table: each unit's, and each foot's whole (``left_total``); None if unknown."""
        truth = self.truth
        if truth is None:
            return None
        names = [channel.name for channel in self.recording.sensors]
        channels = {
            name: Channel.from_values(name, truth.load_n[:, column], NEWTON, "sensor")
            for column, name in enumerate(names)
        }
        for column, foot in enumerate(truth.feet):
            name = f"{foot}_total"
            channels[name] = Channel.from_values(name, truth.foot_n[:, column], NEWTON)
        return Recording(truth.time_s, channels, f"{self.recording.name}_truth")


@dataclass(frozen=True, eq=False)
class TrialResult:
    """A trial analysed with calibrated units.

    ``raw_foot_n`` maps a foot to its force (n,) in N by the static gains alone, divided by the coverage.
    ``against_truth`` is the result of `smartshoe.runs.scenario._against_truth.compare`, None if the truth is unknown.
    """

    name: str
    shoe: str
    recorded: RecordedTrial
    gait: GaitResult
    raw_foot_n: Mapping[str, Array]
    against_truth: Mapping[str, Any] | None

    @property
    def recording(self) -> Recording:
        """What the shoes recorded."""
        return self.recorded.recording

    def totals_n(self) -> dict[str, Array]:
        """Both feet's force (n,) in N at the recording's times: "raw", "corrected" and, if known, "truth"."""
        time_s = self.recording.time_s
        found = {"raw": np.sum(list(self.raw_foot_n.values()), axis=0)} if self.raw_foot_n else {}
        if self.gait.total_n is not None:
            found["corrected"] = np.interp(time_s, self.gait.total_time_s, self.gait.total_n)
        if self.recorded.truth is not None:
            found["truth"] = self.recorded.truth.foot_n.sum(axis=1)
        return found

    def to_dict(self) -> dict[str, Any]:
        """The trial's part of ``result.json``; ``gait`` is in schema smartshoe.gait/1."""
        return {
            "name": self.name,
            "shoe": self.shoe,
            "samples": len(self.recording),
            "duration_s": self.recording.duration_s,
            "against_truth": dict(self.against_truth) if self.against_truth is not None else None,
            "gait": self.gait.to_dict(),
        }


def record_trial(scenario: Scenario, source: ScenarioText, seed: int) -> RecordedTrial:
    """Record the scenario's trial with its shoe; raises `ScenarioError` for an unknown shoe or option."""
    table = scenario.trial
    if table is None:
        raise UsageError(f"{source.path} has no [trial]: add one")
    with opened_shoe(scenario, source, seed) as shoe:
        try:
            recording = shoe.record(name=table.name)
        except UsageError as error:
            raise source.error(("trial",), str(error)) from error
    return RecordedTrial(recording, getattr(shoe, "truth", None))


def opened_shoe(scenario: Scenario, source: ScenarioText, seed: int) -> Shoe:
    """The trial's shoe, not started yet; raises `ScenarioError` for an unknown shoe or option."""
    table = scenario.trial or TrialTable()
    options = {"seed": seed, **table.options}
    if table.shoe.startswith("sim:"):
        worn = {unit.name: {k: v for k, v in unit.options.items() if k in WORN} for unit in scenario.unit}
        options = {"units": worn, **options}
    try:
        return open_shoe(_beside(source, table.shoe), **options)
    except OptionError as error:
        raise source.from_option(error, ("trial",)) from error
    except UsageError as error:
        raise source.error(("trial", "shoe"), str(error)) from error


def _beside(source: ScenarioText, shoe: str) -> str:
    """The shoe's address, in which a file to replay is looked up in the scenario's folder, as recordings are."""
    scheme, _, target = shoe.partition(":")
    return f"replay:{source.path.parent / target}" if scheme == "replay" else shoe


def analyse_trial(table: TrialTable, recorded: RecordedTrial, calibrations: Sequence[Calibration]) -> TrialResult:
    """Analyse the trial with the calibrations; raises what `smartshoe.gait.analyse` raises."""
    from smartshoe.gait import Coverage, analyse

    given = table.gait
    coverage = Coverage.midfoot(given.coverage) if given.coverage_course == "midfoot" else Coverage(given.coverage)
    found = analyse([recorded.recording], calibrations, given.body_weight_n, coverage)
    raw_n = static_forces(recorded.recording, calibrations, given.coverage)
    truth = recorded.truth
    against = None
    if truth is not None and set(raw_n) == set(truth.feet) == set(found.feet):
        against = compare(recorded.recording, truth, found, raw_n)
    return TrialResult(table.name, table.shoe, recorded, found, raw_n, against)


def static_forces(recording: Recording, calibrations: Sequence[Calibration], coverage: float) -> dict[str, Array]:
    """Each foot's force (n,) in N by the static gains b1/a1 alone, without dynamic compensation."""
    by_unit = {calibration.unit: calibration for calibration in calibrations}
    found: dict[str, Array] = {}
    for channel in recording.sensors:
        side = channel.name.partition("_")[0]
        calibration = by_unit.get(channel.name)
        if calibration is None or channel.unit.quantity != calibration.reading_unit.quantity:
            continue
        gain = calibration.b1 / calibration.a1
        force_n = gain * (channel.in_unit(calibration.reading_unit) - calibration.offset) / coverage
        found[side] = found[side] + force_n if side in found else force_n
    return found
