"""An effect's parameters as a person reads them: in SI and the reading's unit, with intervals."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.diagnosis._likelihood import Fit
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._sensitivity import logged_channels
from smartshoe.models.effects.effect import EffectParameter
from smartshoe.models.parameter import Parameter
from smartshoe.signals.noise import NORMAL_95


def parameters_of(fit: Fit, name: str, scale: Scale) -> dict[str, Parameter]:
    """The effect's parameters by name; intervals are clipped to the parameters' bounds.

    Parameters that need a channel which was not logged are left out.
    """
    return {key: _parameter(fit, k, scale) for k, owner, key in _reported(fit) if owner == name}


def joint_parameters(fit: Fit, scale: Scale) -> tuple[dict[str, Parameter], tuple[tuple[float, ...], ...]]:
    """All effects' parameters as ``effect.parameter``, and their covariance in the same units and order."""
    reported = _reported(fit)
    found = {f"{owner}.{key}": _parameter(fit, k, scale) for k, owner, key in reported}
    places = [k for k, _, _ in reported]
    factors = [_scaled(fit.model.parameters[k][1], scale, fit.model.gain)[0] for k in places]
    part = fit.covariance[np.ix_(places, places)] * np.outer(factors, factors)
    return found, tuple(tuple(float(value) for value in row) for row in part)


def _reported(fit: Fit) -> list[tuple[int, str, str]]:
    """Place in theta, effect and name of the effects' parameters, without those whose channel is missing."""
    has = {"", *logged_channels(fit.likelihood.sessions)}
    return [
        (k, owner, parameter.name)
        for k, (owner, parameter) in enumerate(fit.model.parameters)
        if owner != "baseline" and parameter.channel in has
    ]


def _parameter(fit: Fit, k: int, scale: Scale) -> Parameter:
    """The parameter at ``k`` in theta in its unit, its interval clipped to its bounds."""
    parameter, value = fit.model.parameters[k][1], fit.model.theta[k]
    factor, unit = _scaled(parameter, scale, fit.model.gain)
    variance = float(fit.covariance[k, k])
    sd = math.sqrt(max(variance, 0.0)) if variance else math.inf  # a parameter without influence is undetermined
    low, high = max(value - NORMAL_95 * sd, parameter.lower), min(value + NORMAL_95 * sd, parameter.upper)
    return in_unit(float(value), sd, (float(low), float(high)), factor, unit)


def in_unit(value: float, sd: float, ci95: tuple[float, float], factor: float, unit: str) -> Parameter:
    """A parameter in ``unit`` from a share of full scale; ``factor`` is negative where the reading falls with load."""
    low, high = sorted(bound * factor for bound in ci95)
    return Parameter(value * factor, sd * abs(factor), (low, high), unit)


def _scaled(parameter: EffectParameter, scale: Scale, gain: float) -> tuple[float, str]:
    """Factor and unit of a parameter given in shares of full scale; shares of the chain come out ``gain`` times larger.

    A strength has the sign of the reading; a level or a width that belongs to the equation's shape is a size.
    """
    factor, unit = 1.0, parameter.unit
    if "FS_reading" in unit:
        span = abs(scale.reading) if parameter.null is None else scale.reading
        factor, unit = factor * gain * span, unit.replace("FS_reading", scale.unit.symbol)
    if "FS_load" in unit:
        inverse = "/FS_load" in unit
        factor = factor / scale.load_n if inverse else factor * scale.load_n
        unit = unit.replace("FS_load", "N")
    return (factor if np.isfinite(factor) else 1.0), unit
