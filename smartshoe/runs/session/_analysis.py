"""From a session's raw data to its result: the streams are joined, identified, validated and diagnosed.

The result depends on the raw data and the plan alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from smartshoe.calibration import Calibration
from smartshoe.calibration.validation import Validation, validate
from smartshoe.devices.joining import Alignment, join_with_clocks
from smartshoe.errors import InputError, NotIdentifiableError, SmartShoeError
from smartshoe.identification import Identification, identify
from smartshoe.recording import Recording
from smartshoe.runs.session._folder import Attempt, SessionFolder
from smartshoe.runs.session._plan import SessionPlan
from smartshoe.version import __version__

if TYPE_CHECKING:
    from smartshoe.diagnosis import Diagnosis
    from smartshoe.identification.leave_out import LeaveOneRateOut

Progress = Callable[[str], None]
SLOWER = 0.9


def _silent(_: str) -> None:
    return None


@dataclass(frozen=True, eq=False)
class SessionResult:
    """The result of a session.

    ``recordings`` maps an experiment to load and reading on one time base, ``clocks`` to the alignment of the machine's
    clock with the shoe's.
    """

    plan: SessionPlan
    attempts: tuple[Attempt, ...]
    recordings: dict[str, Recording]
    clocks: dict[str, Alignment]
    identification: Identification
    calibration: Calibration
    validation: Validation
    diagnosis: Diagnosis | None
    without_a_rate: LeaveOneRateOut | None = None

    @property
    def clocks_said(self) -> list[str]:
        """The alignment of the two clocks in words, for each experiment."""
        return [
            f"{name}: beside the shoe's the machine's clock is {clocks.says}" for name, clocks in self.clocks.items()
        ]

    def to_dict(self) -> dict[str, Any]:
        """The result in schema ``smartshoe.session/1``; the same session always gives identical bits."""
        return {
            "schema": "smartshoe.session/1",
            "unit": self.plan.unit,
            "serial_number": self.plan.serial_number,
            "created": self.plan.created,
            "version": __version__,
            "experiments": [self._experiment(name, recording) for name, recording in self.recordings.items()],
            "attempts": [
                {
                    "experiment": attempt.experiment,
                    "attempt": attempt.number,
                    "state": attempt.state,
                    "samples": attempt.samples,
                    "findings": attempt.findings,
                    "events": len(attempt.events),
                }
                for attempt in self.attempts
            ],
            "identification": {
                **self.identification.to_dict(),
                **({"leave_one_rate_out": self.without_a_rate.to_dict()} if self.without_a_rate else {}),
            },
            "validation": self.validation.to_dict(),
            "diagnosis": self.diagnosis.to_dict() if self.diagnosis else None,
            "calibration": self.calibration.to_dict(),
        }

    def _experiment(self, name: str, recording: Recording) -> dict[str, Any]:
        clocks = self.clocks[name]
        return {
            "name": name,
            "samples": len(recording),
            "duration_s": recording.duration_s,
            "join": {
                "delay_s": {"value": clocks.delay_s, "sd": clocks.delay_sd_s},
                "rate_ppm": {"value": 1e6 * clocks.rate, "sd": 1e6 * clocks.rate_sd},
            },
        }


def joined(plan: SessionPlan, attempt: Attempt, *, to_fit: bool = False) -> tuple[Recording, Alignment]:
    """Load and the unit's reading at the shoe's samples, and the clocks; raises `InputError` if they do not match.

    With ``to_fit`` the samples are those of whichever is slower, so that noise stays white and error bars are valid.
    """
    stream = attempt.stream()
    others = [channel.name for channel in stream.sensors if channel.name != plan.unit]
    own = replace(stream.without(*others), unit=plan.unit)
    load = attempt.load()
    coarser = to_fit and load.sample_rate_hz < SLOWER * own.sample_rate_hz
    found, clocks = join_with_clocks(load, own, ticks="machine" if coarser else "logger")
    source = f"{attempt.experiment}, attempt {attempt.number}"
    return replace(found, name=attempt.experiment, unit=plan.unit, source=source), clocks


def analyse(folder: SessionFolder, progress: Progress = _silent) -> SessionResult:
    """Compute the result from what ``folder`` holds.

    Raises `InputError` if an experiment is not done, otherwise what the steps raise.
    """
    plan = folder.plan
    attempts = folder.attempts()
    accepted = {attempt.experiment: attempt for attempt in attempts if attempt.state == "accepted"}
    missing = [protocol.name for protocol in plan.protocols if protocol.name not in accepted]
    if missing:
        raise InputError(
            f"{folder.path}: {', '.join(missing)} is not recorded yet: go on with smartshoe calibrate --resume"
            f" {folder.path}"
        )
    try:
        progress("joining the shoe's stream and the machine's log")
        both = {p.name: joined(plan, accepted[p.name]) for p in plan.protocols}
        recordings = {name: recording for name, (recording, _) in both.items()}
        several = list(recordings.values())
        progress("identifying")
        found, without_a_rate = _identified([joined(plan, accepted[p.name], to_fit=True)[0] for p in plan.protocols])
        calibration = replace(
            found.calibration(created=plan.created),
            serial_number=plan.serial_number,
            sample_rate_hz=several[0].sample_rate_hz,
        )
        progress("validating")
        validation = validate(several, calibration)
        diagnosis = None
        if plan.diagnosed:
            from smartshoe.diagnosis import diagnose

            diagnosis = diagnose(several, progress=progress)
    except SmartShoeError as error:
        error.args = (f"{folder.path}: {error}",)
        raise
    clocks = {name: found_clocks for name, (_, found_clocks) in both.items()}
    return SessionResult(
        plan=plan,
        attempts=tuple(attempts),
        recordings=recordings,
        clocks=clocks,
        identification=found,
        calibration=calibration,
        validation=validation,
        diagnosis=diagnosis,
        without_a_rate=without_a_rate,
    )


def _identified(recordings: list[Recording]) -> tuple[Identification, LeaveOneRateOut | None]:
    """The fit to all recordings, and its leave-one-rate-out result if they contain more than one loading rate."""
    from smartshoe.identification.leave_out import leave_one_rate_out

    try:
        left_out = leave_one_rate_out(recordings)
    except NotIdentifiableError:
        return identify(recordings), None
    return left_out.everything, left_out
