"""The force that a model's inverse gives back, and which of two models a unit is compensated by."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from smartshoe.arrays import Array
from smartshoe.calibration import ExtendedCompensator
from smartshoe.diagnosis._held_out import own_of
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel


@dataclass(frozen=True, slots=True)
class ForceError:
    """Root mean square errors in N of the compensated force against the load; NaN where there is nothing."""

    fitted_n: float
    held_out_n: float


def force_error(fine: Sequence[Session], model: ExtendedModel) -> ForceError:
    """Of ``model`` run backwards over what was fitted, and over what is held out."""
    off = [_off_n(session, model) for session in fine]
    fitted = [one[session.fitted] for one, session in zip(off, fine, strict=True)]
    judged = [one[session.judged] for one, session in zip(off, fine, strict=True)]
    return ForceError(_rms(fitted), _rms(judged))


def undoes(extended: ForceError, plain: ForceError, thresholds: Thresholds) -> bool:
    """Whether the extended model's inverse gives the load of what was fitted back hardly worse than the plain one's.

    A curve that hardly rises, or a gain that nearly vanishes, follows the reading and tells no load: its inverse makes
    more of all that is left.
    """
    return not extended.fitted_n > (1.0 + thresholds.standing) * plain.fitted_n


def force_of(plain: ForceError, extended: ForceError, thresholds: Thresholds) -> str | None:
    """What is said of an extended model that gives the load back worse than the plain one does."""
    if not undoes(extended, plain, thresholds):
        return (
            "the extended model fits the reading but gives a worse force: on what was fitted it is off by"
            f" {extended.fitted_n:.3g} N, the baseline by {plain.fitted_n:.3g} N; so the calibration compensates by the"
            " baseline, and its twin simulates with the effects"
        )
    if extended.held_out_n > (1.0 + thresholds.standing) * plain.held_out_n:
        return (
            "the force that the extended model gives back is worse than the baseline's on held-out data"
            f" ({plain.held_out_n:.3g} to {extended.held_out_n:.3g} N), since undoing its effects amplifies what is"
            " left: compensate by the baseline"
        )
    return None


def not_undone_of(model: ExtendedModel, step_s: float) -> list[str]:
    """What is said of effects that no compensator can take off a stream of readings."""
    passed_over = ExtendedCompensator(model, 1.0 / step_s).not_inverted
    return [f"no compensator takes off the {name.replace('_', ' ')}, since {why}" for name, why in passed_over.items()]


def _off_n(session: Session, model: ExtendedModel) -> Array:
    """(n,) compensated force less load in N; the recording's own offset and past are no part of the reading."""
    compensator, undone = ExtendedCompensator(model, 1.0 / session.conditions.step_s), model
    for name in compensator.not_inverted:  # what is not taken off is the offset's as far as it is one
        undone = undone.without(name)
    _, own = own_of(session, undone, session.reading - undone.simulate(session.conditions))
    force_n = compensator.apply((session.reading - own) * model.full_scale_reading)
    return force_n - session.conditions.load * model.full_scale_load_n


def _rms(parts: Sequence[Array]) -> float:
    count = sum(one.size for one in parts)
    return math.sqrt(sum(float(one @ one) for one in parts) / count) if count else math.nan
