"""Estimators by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smartshoe.calibration.estimators.estimate import Estimator
from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from smartshoe.calibration.calibration import Calibration

NAMES = ("static", "lead", "inverse", "kalman", "smoother", "imm")


def estimator(
    name: str, calibration: Calibration, sample_rate_hz: float | None = None, *, noise_sd: float | None = None
) -> Estimator:
    """The estimator ``name`` for a unit's ``calibration`` at ``sample_rate_hz`` (the calibration's own where None).

    ``static`` is b1/a1 (reading - offset); ``lead`` the paper's filter; ``inverse`` that of the extended model;
    ``kalman``, ``smoother`` and ``imm`` are of the linear part, with a variance that follows the load. ``noise_sd`` in
    the reading's unit is found from the readings where it is None. Raises `UsageError` for another name.
    """
    rate_hz = calibration.sample_rate_hz if sample_rate_hz is None else sample_rate_hz
    if not rate_hz > 0.0:
        raise UsageError(f"sample_rate_hz is {rate_hz:g}: give a rate above 0 Hz")
    if name == "static":
        from smartshoe.calibration.estimators.filters import StaticGain

        return StaticGain(calibration, noise_sd)
    if name in ("lead", "inverse"):
        from smartshoe.calibration.estimators import filters

        return (filters.lead if name == "lead" else filters.inverse)(calibration, rate_hz, noise_sd)
    if name in ("kalman", "smoother"):
        from smartshoe.calibration.estimators.kalman import Kalman

        return Kalman(calibration, rate_hz, smooth=name == "smoother", noise_sd=noise_sd)
    if name == "imm":
        from smartshoe.calibration.estimators.imm import InteractingModels

        return InteractingModels(calibration, rate_hz, noise_sd=noise_sd)
    raise UsageError(f"estimator {name!r} is not known: use one of {', '.join(NAMES)}")
