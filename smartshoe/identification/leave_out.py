"""Leave-one-rate-out validation: whether parameters and force hold for a loading rate that was not fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.errors import NotConvergedError, NotIdentifiableError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of
from smartshoe.identification._experiment import Experiment, prepare
from smartshoe.identification._identification import Identification
from smartshoe.identification._identifier import identify
from smartshoe.models.first_order import lag, shifted
from smartshoe.models.parameter import finite_or_none
from smartshoe.recording import Channel, Recording
from smartshoe.signals import loading

MOVED_SD = 5.0


@dataclass(frozen=True, eq=False)
class RateFold:
    """The fit ``found`` without the cycles of one rate, with force errors in N on those cycles and on the fitted ones.

    Where `identify` refused without that rate, ``found`` is None, ``refused`` says why, and the errors are NaN.
    """

    rate_n_per_s: float
    cycles: int
    found: Identification | None
    rmse_left_out_n: float
    max_left_out_n: float
    rmse_fitted_n: float
    max_fitted_n: float
    refused: str = ""


@dataclass(frozen=True, slots=True)
class Movement:
    """A parameter over the folds: its ``value`` from all rates, ``lowest`` and ``highest`` with one rate left out.

    ``moved_sd`` is the largest distance from ``value`` in standard deviations of the fold; for a correct model it stays
    within 3.
    """

    value: float
    lowest: float
    highest: float
    moved_sd: float


@dataclass(frozen=True, eq=False)
class LeaveOneRateOut:
    """``folds`` by ascending rate, ``movements`` of a1, b0 and b1, the fit to ``everything``, and a summary."""

    folds: tuple[RateFold, ...]
    movements: Mapping[str, Movement]
    everything: Identification
    says: str

    def to_dict(self) -> dict[str, Any]:
        """The result as plain numbers for JSON, None where one is not finite."""
        return {
            "folds": [
                {
                    "rate_n_per_s": finite_or_none(fold.rate_n_per_s),
                    "cycles": fold.cycles,
                    "rmse_left_out_n": finite_or_none(fold.rmse_left_out_n),
                    "max_left_out_n": finite_or_none(fold.max_left_out_n),
                    "rmse_fitted_n": finite_or_none(fold.rmse_fitted_n),
                    "max_fitted_n": finite_or_none(fold.max_fitted_n),
                    "refused": fold.refused,
                }
                for fold in self.folds
            ],
            "movements": {
                name: {key: finite_or_none(getattr(moved, key)) for key in ("value", "lowest", "highest", "moved_sd")}
                for name, moved in self.movements.items()
            },
            "says": self.says,
        }


def leave_one_rate_out(recordings: RecordingLike | Sequence[RecordingLike], **options: Any) -> LeaveOneRateOut:
    """Identify once without each loading rate (rates within 10 % count as one); ``options`` are those of `identify`.

    A cycle is left out together with the rest after it. A recording with nothing else is left out entirely; its reading
    at no load is then the mean over its rest before the first ramp, or that of the other recordings where it has none.
    Errors are of force: in the forward direction the reading's error passed through the compensator. Raises
    `NotIdentifiableError` where there is only one rate or each fold is refused, and the errors that `identify` raises
    for all recordings together.
    """
    several = _in_one_unit(recordings_of(recordings))
    counted: Mapping[str, Mask] = dict(options.pop("counted", None) or {})
    everything = identify(several, counted=counted, **options)
    experiments, _ = prepare(several, counted, on_one_step=False)
    cycles = [loading.cycles(one.time_s, one.load_n) for one in experiments]
    rates = loading.by_rate([cycle for found in cycles for cycle in found])
    if len(rates) < 2:
        raise NotIdentifiableError(
            f"{several[0].label}: the load cycles are of {len(rates)} rate, so that none can be left out: record a"
            " second loading rate"
        )
    folds = []
    for rate, group in rates.items():
        members = {id(cycle) for cycle in group}
        left_out = [_span_of(experiment, found, members) for experiment, found in zip(experiments, cycles, strict=True)]
        folds.append(_fold(rate, len(group), several, experiments, cycles, left_out, members, options))
    refused = [fold for fold in folds if fold.found is None]
    if len(refused) == len(folds):
        raise NotIdentifiableError(
            f"{several[0].label}: without any one rate the fit is refused, as without {refused[0].rate_n_per_s:g} N/s:"
            f" {refused[0].refused}"
        )
    movements = {}
    for name in ("a1", "b0", "b1"):
        value = everything.parameters[name].value
        fold_values = [fold.found.parameters[name] for fold in folds if fold.found is not None]
        movements[name] = Movement(
            value,
            min(one.value for one in fold_values),
            max(one.value for one in fold_values),
            max(abs(one.value - value) / one.sd if one.sd > 0 else 0.0 for one in fold_values),
        )
    worst = max(movements, key=lambda name: movements[name].moved_sd)
    moved = movements[worst]
    if moved.moved_sd > MOVED_SD:
        says = (
            f"{worst} runs from {moved.lowest:.4g} to {moved.highest:.4g} as one rate or another is left out, up to"
            f" {moved.moved_sd:.0f} of its standard deviations: the model is wrong, whatever its fit in percent"
        )
    else:
        says = f"no parameter moves by more than {moved.moved_sd:.1f} standard deviations as one rate is left out"
    if refused:
        named = " or ".join(f"{fold.rate_n_per_s:g} N/s" for fold in refused)
        says += f"; without {named} the fit is refused"
    return LeaveOneRateOut(tuple(folds), movements, everything, says)


def _in_one_unit(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings with readings in the first one's unit, so that leaving that one out does not change the unit."""
    same = []
    for recording in recordings:
        sensor, unit = recording.sensor, recordings[0].sensor.unit
        if sensor.unit != unit:
            values = np.where(sensor.present, sensor.in_unit(unit), np.nan)
            recording = recording.with_channel(Channel.from_values(sensor.name, values, unit, sensor.role))
        same.append(recording)
    return same


def _span_of(experiment: Experiment, found: list[loading.Cycle], members: set[int]) -> Mask:
    """(n,) mask of the samples of the cycles in ``members``, each up to the next cycle."""
    span = np.zeros(experiment.time_s.size, dtype=bool)
    stops = [cycle.start for cycle in found[1:]] + [span.size]
    for cycle, stop in zip(found, stops, strict=True):
        if id(cycle) in members:
            span[cycle.start : max(stop, cycle.stop)] = True
    return span


def _fold(
    rate: float,
    count: int,
    recordings: Sequence[Recording],
    experiments: Sequence[Experiment],
    cycles: Sequence[list[loading.Cycle]],
    left_out: Sequence[Mask],
    members: set[int],
    options: Mapping[str, Any],
) -> RateFold:
    whole = [bool(found) and all(id(cycle) in members for cycle in found) for found in cycles]
    # Names as `identify` will use them: made unique over all recordings before some are left out.
    named = [replace(one, name=experiment.name) for one, experiment in zip(recordings, experiments, strict=True)]
    others = [index for index, gone in enumerate(whole) if not gone]
    masks = {experiments[index].name: experiments[index].mask & ~left_out[index] for index in others}
    try:
        found = identify([named[index] for index in others], counted=masks, **options)
    except (NotIdentifiableError, NotConvergedError) as refusal:
        # That identification depends on one rate is a result in itself; the other folds remain valid.
        return RateFold(rate, count, None, *(4 * (float("nan"),)), refused=str(refusal))
    outside: list[Array] = []
    inside: list[Array] = []
    for index, experiment in enumerate(experiments):
        if whole[index]:
            error = _error_of_unseen(found, experiment, cycles[index][0].start)
        else:
            error = _force_error(found, experiment, found.errors[experiment.name])
        outside.append(error[experiment.mask & left_out[index]])
        if not whole[index]:
            inside.append(error[masks[experiment.name]])
    return RateFold(rate, count, found, *_figures(outside), *_figures(inside))


def _figures(errors: Sequence[Array]) -> tuple[float, float]:
    """Root mean square and largest absolute value; NaN where there are no samples."""
    error = np.concatenate(errors)
    if not error.size:
        return float("nan"), float("nan")
    return float(np.sqrt(np.mean(error**2))), float(np.max(np.abs(error)))


def _compensated(found: Identification, reading: Array, experiment: Experiment) -> Array:
    """(n,) force of a reading relative to its zero: (b0 s + b1)/(s + a1), started in steady state."""
    a1, b0, b1 = found.coefficients
    slow = lag(reading, a1, experiment.step)
    force_n: Array = b0 * (reading - slow) + b1 / a1 * slow
    return force_n


def _force_error(found: Identification, experiment: Experiment, error: Array) -> Array:
    """The model's error (n,) converted to force, model minus measured."""
    if found.direction == "inverse":
        return error
    # For reading = force/G the force estimate is G reading: its error is minus G times the reading's error.
    return -_compensated(found, error, experiment)


def _error_of_unseen(found: Identification, experiment: Experiment, first_ramp: int) -> Array:
    """Force error (n,) of a recording that the fit did not use at all."""
    a1, _, b1 = found.coefficients
    load_zero_n = float(np.mean([one.value for one in found.load_offsets.values()]))
    rest = experiment.mask.copy()
    rest[first_ramp:] = False
    offset = found.offset
    if rest.any():
        offset = float(np.mean(experiment.reading[rest] - (experiment.load_n[rest] - load_zero_n) * a1 / b1))
    reading, _ = shifted(experiment.reading - offset, experiment.time_s, experiment.step, found.delay_s.value)
    if rest.any():
        # The filter starts from its first value, which should not carry the noise of a single sample.
        reading[0] = float(np.mean(reading[rest]))
    error: Array = _compensated(found, reading, experiment) + load_zero_n - experiment.load_n
    return error
