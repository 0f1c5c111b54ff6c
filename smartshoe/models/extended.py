"""`ExtendedModel`: the standard linear solid with effects, the whole measurement chain simulated forward.

The model also gives the derivatives of its reading. Each is a difference between two runs of the chain, of which the
second begins at the first block that the parameter moves.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.models.core import USUAL_WALL_RATIO, Core, network
from smartshoe.models.effects.catalogue import effect, refuse_other_size
from smartshoe.models.effects.effect import PLACES, Conditions, CoreEffect, Effect, EffectParameter
from smartshoe.models.elements import Arm, Element

BASELINE = (
    EffectParameter("gain", "FS_reading", "reading of a held full-scale load", None, 1e-3, 1e3, 1.0),
    EffectParameter("relaxing_share", "1", "k2/(k1 + gas): share of the load that relaxes", None, -0.9, 50.0, 0.1),
    # The pole is the rate over 1 + share, so that this bound leaves a sensor that only lags its pole of 50/s.
    EffectParameter("relaxation_rate", "1/s", "k2/c, the paper's a1", None, 0.01, 2550.0, 0.2),
)
DERIVATIVE_STEP = 1e-3  # of a parameter's size


@cache
def _baseline_parameters(slowest_per_s: float) -> tuple[EffectParameter, ...]:
    """The baseline's parameters where its relaxation rate may be as low as ``slowest_per_s``."""
    *others, rate = BASELINE
    return (*others, replace(rate, lower=slowest_per_s))


@dataclass(frozen=True, eq=False)
class Part:
    """An effect in a model, with the ``values`` of its parameters in their order.

    ``until_s``: seconds since a session began after which a part that goes with the clock stays as it is by then.
    """

    effect: Effect
    values: Array
    until_s: float = math.inf

    @property
    def name(self) -> str:
        """The name of the effect."""
        return self.effect.name

    @property
    def valued(self) -> list[tuple[EffectParameter, float]]:
        """Each parameter of the effect with its value."""
        return [(one, float(value)) for one, value in zip(self.effect.parameters, self.values, strict=True)]

    @property
    def kind_ends_at(self) -> list[tuple[EffectParameter, float]]:
        """The parameters, with their values, that lie where the effect turns into one of another kind."""
        return self.effect.kind_ends_at(self.values)

    @property
    def bends_too_little(self) -> bool:
        """Whether it is a law of a curve, with a strength at the end of its range: the unit may bend farther than that.

        Not where the effect's kind ends there, beyond which it may be any curve.
        """
        at_ends = (one.is_stretched(value) for one, value in self.valued if one.null is not None and value != one.null)
        is_law = self.effect.is_memoryless and not (self.effect.is_flexible or self.kind_ends_at)
        return is_law and any(at_ends)


@dataclass(frozen=True, eq=False)
class ExtendedModel:
    """The standard linear solid (Chinimilli 2016, equation 2) with effects, ``parts``, at their places of the chain.

    ``gain`` is the reading of a held full-scale load, as a share of ``full_scale_reading`` (in ``reading_unit``).
    ``relaxing_share`` kappa and ``relaxation_rate_per_s`` a give p/f = (s + a)/((1 + kappa) s + a). ``wall_ratio`` is N
    of `smartshoe.models.core` and matters for leaks and heat only. ``noise`` is the rms of the noise in the readings,
    as a share of ``full_scale_reading``: the model's inverse takes no swing within that noise for a reversal of the
    load. ``slowest_per_s`` is the least relaxation rate that a fit may take, less where recordings are long.
    """

    gain: float
    relaxing_share: float
    relaxation_rate_per_s: float
    full_scale_load_n: float
    full_scale_reading: float
    reading_unit: str
    parts: tuple[Part, ...] = ()
    wall_ratio: float = USUAL_WALL_RATIO
    noise: float = 0.0
    slowest_per_s: float = BASELINE[2].lower

    # -- parameters as one vector ------------------------------------------------------------------------------
    @cached_property
    def parameters(self) -> tuple[tuple[str, EffectParameter], ...]:
        """(name of the effect or "baseline", parameter) in the order of `theta`."""
        own = [("baseline", one) for one in _baseline_parameters(self.slowest_per_s)]
        return (*own, *((part.name, parameter) for part in self.parts for parameter in part.effect.parameters))

    @property
    def pole_per_s(self) -> float:
        """a/(1 + kappa) in 1/s: the rate at which an earlier load in the relaxing arm fades from the reading."""
        return self.relaxation_rate_per_s / (1.0 + self.relaxing_share)

    @property
    def theta(self) -> Array:
        """The values (p,) of all parameters, the baseline's first."""
        baseline = [self.gain, self.relaxing_share, self.relaxation_rate_per_s]
        return np.concatenate([baseline, *(part.values for part in self.parts)])

    def at(self, theta: Array) -> ExtendedModel:
        """The same chain with the parameters ``theta`` (p,)."""
        parts, k = [], len(BASELINE)
        for part in self.parts:
            count = len(part.effect.parameters)
            parts.append(replace(part, values=np.array(theta[k : k + count], dtype=float)))
            k += count
        gain, share, rate = (float(value) for value in theta[: len(BASELINE)])
        return replace(self, gain=gain, relaxing_share=share, relaxation_rate_per_s=rate, parts=tuple(parts))

    def with_part(self, added: Effect | str, values: ArrayLike | None = None) -> ExtendedModel:
        """This model with one more effect, given by itself or its name; its strengths are null without ``values``."""
        added = effect(added) if isinstance(added, str) else added
        part = Part(added, added.start() if values is None else np.array(values, dtype=float))
        return replace(self, parts=(*self.parts, part))

    def part(self, name: str) -> Part:
        """The part of the effect ``name``; raises `KeyError` where the model has none."""
        return {part.name: part for part in self.parts}[name]

    @property
    def ended(self) -> tuple[str, ...]:
        """The names of effects at a bound beyond which there is a farther one."""
        return tuple(part.name for part in self.parts if part.effect.widened_at(part.values) is not part.effect)

    def freed(self, name: str) -> ExtendedModel:
        """This model with the effect ``name`` free of the bounds that it ended at (`Effect.widened_at`)."""
        at = self.part(name)
        wider = replace(at, effect=at.effect.widened_at(at.values))
        return replace(self, parts=tuple(wider if part is at else part for part in self.parts))

    def without(self, *names: str) -> ExtendedModel:
        """This model without the named effects; itself where it has none of them."""
        remaining = tuple(part for part in self.parts if part.name not in names)
        return replace(self, parts=remaining) if len(remaining) < len(self.parts) else self

    def held_after(self, last_s: float, but: Collection[str]) -> ExtendedModel:
        """This model with its drifts held from ``last_s`` seconds into a session on, all ``but`` those named.

        Itself where there are none to hold.
        """
        held = {part.name for part in self.parts if part.effect.is_drift and part.name not in but}
        parts = (replace(part, until_s=last_s) if part.name in held else part for part in self.parts)
        return replace(self, parts=tuple(parts)) if held else self

    def held_as(self, other: ExtendedModel) -> ExtendedModel:
        """This model with each drift that it shares with an ``other`` held from when the other's is."""
        until_s = {part.name: part.until_s for part in other.parts}
        return replace(
            self, parts=tuple(replace(part, until_s=until_s.get(part.name, part.until_s)) for part in self.parts)
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the effects in it."""
        return tuple(part.name for part in self.parts)

    # -- the chain -----------------------------------------------------------------------------------------------
    @cached_property
    def core(self) -> Core:
        """The linear network of wall and gas: the baseline's relaxing arm and the elements of its core effects."""
        elements: list[Element] = [Arm(self.relaxing_share, self.relaxation_rate_per_s)]
        for part in self.parts:
            if isinstance(part.effect, CoreEffect):
                elements += part.effect.elements(part.values)
        return network(tuple(elements), self.wall_ratio)

    @cached_property
    def chain(self) -> tuple[Part | None, ...]:
        """The parts outside the core in the order in which the signal passes them; None stands for the core."""
        outside = [part for part in self.parts if not isinstance(part.effect, CoreEffect)]
        core = PLACES.index("core")
        before = [part for part in outside if PLACES.index(part.effect.place) < core]
        after = [part for part in outside if PLACES.index(part.effect.place) > core]

        def order(part: Part) -> tuple[int, str]:
            return PLACES.index(part.effect.place), part.name

        return (*sorted(before, key=order), None, *sorted(after, key=order))

    def _run(
        self,
        signal: Array,
        conditions: Conditions,
        first: int = 0,
        inputs: list[Array] | None = None,
        core: Core | None = None,
    ) -> Array:
        """The reading (n,), a share of full scale, from the ``signal`` (n,) that enters block ``first`` of the chain.

        ``inputs``: takes what enters each block. ``core``: an equal core of another model, which has its modes already.
        """
        for part in self.chain[first:]:
            if inputs is not None:
                inputs.append(signal)
            if part is None:
                signal = _through(core or self.core, signal, conditions)
            else:
                seen = self._around(conditions) if part.effect.bends_beside_arm else conditions
                signal = part.effect.apply(signal, seen.until(part.until_s), part.values)
                refuse_other_size(part.name, signal, conditions.load.size)
        return self.gain * signal

    def _around(self, conditions: Conditions) -> Conditions:
        """``conditions`` with the model's relaxing arm, for blocks that bend a spring beside it.

        Such a block solves the balance of spring and arm together.
        """
        relaxing = self.relaxing_share, self.relaxation_rate_per_s
        return conditions if conditions.relaxing == relaxing else conditions.within(*relaxing)

    def simulate(self, conditions: Conditions) -> Array:
        """The reading (n,) as a share of ``full_scale_reading`` under ``conditions``."""
        return self._run(conditions.load, conditions)

    def reading(self, conditions: Conditions) -> Array:
        """The reading (n,) in ``reading_unit``."""
        return self.full_scale_reading * self.simulate(conditions)

    @cached_property
    def _varied(self) -> Extensions:
        """For each parameter but the gain, this model with that parameter moved by a small step."""
        theta, extensions = self.theta, []
        place_of = {part.name: k for k, part in enumerate(self.chain) if part is not None}
        core = self.chain.index(None)
        # The first block that the arm changes: one that bends beside the arm, or the core.
        arm = next(k for k, part in enumerate(self.chain) if part is None or part.effect.bends_beside_arm)
        for j, (owner, parameter) in enumerate(self.parameters):
            if j == 0:
                continue
            step = derivative_step(parameter, theta[j])
            moved = theta.copy()
            moved[j] += step
            first = arm if owner == "baseline" else place_of.get(owner, core)
            trial = self.at(moved)
            is_same_core = first != core and owner != "baseline"
            extensions.append(Extension(step, trial, first, self.core if is_same_core else None))
        return tuple(extensions)

    def sensitivities(
        self, conditions: Conditions, trace: Trace | None = None, out: Array | None = None
    ) -> tuple[Array, Array]:
        """The reading (n,) and its derivatives (n, p) with respect to `theta`, by one-sided differences.

        ``trace``: this model's own `trace` under the same conditions, where it is known. ``out`` (n, p) takes the
        derivatives.
        """
        trace = trace or self.trace(conditions)
        out = np.empty((trace[0].size, 1 + len(self._varied)), order="F") if out is None else out
        np.divide(trace[0], self.gain, out=out[:, 0])
        self.column_of(self._varied, conditions, trace, out[:, 1:])
        return trace[0], out

    def own_sensitivities(self, name: str, conditions: Conditions, trace: Trace) -> Array:
        """Derivatives (n, k) of the reading with respect to the parameters of the effect ``name``."""
        own = [by for by, (owner, _) in zip(self._varied, self.parameters[1:], strict=True) if owner == name]
        return self.column_of(own, conditions, trace)

    def trace(self, conditions: Conditions) -> Trace:
        """The reading (n,), and the signals (n,) that enter each block of the chain, with that at its end last."""
        inputs: list[Array] = []
        reading = self._run(conditions.load, conditions, 0, inputs)
        return reading, [*inputs, reading / self.gain]

    def extended_by(self, added: Effect, start: Array) -> Extensions:
        """This model with an effect ``added`` at a small strength: one extension for each strength of the effect.

        ``start``: the effect's null strengths and the values of its shape parameters.
        """
        extensions = []
        for j, parameter in enumerate(added.parameters):
            if parameter.null is None:
                continue
            step = derivative_step(parameter, start[j])
            moved = start.copy()
            moved[j] += step
            trial, in_core = self.with_part(added, moved), isinstance(added, CoreEffect)
            names = [None if part is None else part.name for part in trial.chain]
            first = names.index(None if in_core else added.name)
            extensions.append(Extension(step, trial, first, None if in_core else self.core))
        return tuple(extensions)

    def column_of(
        self, by: Sequence[Extension], conditions: Conditions, trace: Trace, out: Array | None = None
    ) -> Array:
        """Derivatives (n, k) of the reading by what the extensions ``by`` (k) move; ``trace``: this model's own."""
        reading, inputs = trace
        out = np.empty((reading.size, len(by)), order="F") if out is None else out
        for column, one in enumerate(by):
            one.slope(reading, inputs, conditions, out[:, column])
        return out

    # -- to and from a file ---------------------------------------------------------------------------------------
    def to_dict(self) -> dict[str, Any]:
        """The model for a calibration file; ``held_after_s`` is in it only where drifts are held."""
        held = {part.name: part.until_s for part in self.parts if math.isfinite(part.until_s)}
        return {
            "gain": self.gain,
            "relaxing_share": self.relaxing_share,
            "relaxation_rate_per_s": self.relaxation_rate_per_s,
            "full_scale_load_n": self.full_scale_load_n,
            "full_scale_reading": self.full_scale_reading,
            "reading_unit": self.reading_unit,
            "wall_ratio": self.wall_ratio,
            "noise": self.noise,
            "effects": {part.name: {parameter.name: value for parameter, value in part.valued} for part in self.parts},
            **({"held_after_s": held} if held else {}),
        }

    @classmethod
    def from_dict(cls, given: Mapping[str, Any]) -> ExtendedModel:
        """The model that `to_dict` described.

        Raises `UsageError` for an effect that is not known, and `KeyError` where a value is missing.
        """
        held = given.get("held_after_s", {})
        plain = {key: given[key] for key in given if key not in ("effects", "held_after_s")}
        parts = []
        for name, values in given["effects"].items():
            stored = np.array([_stored(p, values) for p in effect(name).parameters])
            parts.append(Part(effect(name), stored, held.get(name, math.inf)))
        return cls(**plain, parts=tuple(parts))


def _through(core: Core, signal: Array, conditions: Conditions) -> Array:
    """The output (n,) of a ``core`` for a ``signal`` (n,), with the load that went before the recording.

    That load is taken as it was measured: what blocks before the core would change of it is small in the core's memory.
    """
    earlier = conditions.earlier
    if not earlier.size:
        return core.simulate(signal, conditions.step_s)
    return core.simulate(np.concatenate([earlier, signal]), conditions.step_s)[earlier.size :]


def _stored(parameter: EffectParameter, values: Mapping[str, float]) -> float:
    """The value of a ``parameter`` in a file; its ``absent`` value where the file is older than the parameter."""
    return values[parameter.name] if parameter.absent is None else values.get(parameter.name, parameter.absent)


def derivative_step(parameter: EffectParameter, value: float) -> float:
    """A step of a parameter at ``value`` for a derivative, small and within the bounds."""
    if parameter.null is None:
        step = DERIVATIVE_STEP * abs(value) or DERIVATIVE_STEP * parameter.size
    else:
        step = DERIVATIVE_STEP * max(parameter.size, abs(value - parameter.null))
    return -step if value + step > parameter.upper else step


@dataclass(frozen=True, eq=False)
class Extension:
    """A ``model`` that differs from another in one parameter, moved by ``step``.

    ``first``: the first block of the chain that differs. ``core``: the other model's core, where it is the same; else
    None.
    """

    step: float
    model: ExtendedModel
    first: int
    core: Core | None

    def slope(self, reading: Array, inputs: Sequence[Array], conditions: Conditions, out: Array) -> None:
        """Writes the derivative of the reading with respect to the parameter into ``out`` (n,).

        ``reading`` (n,) and ``inputs`` are the `trace` of the model without the step.
        """
        moved = self.model._run(inputs[self.first], conditions, self.first, core=self.core)
        np.subtract(moved, reading, out=out)
        out /= self.step


Extensions = tuple[Extension, ...]
Trace = tuple[Array, list[Array]]
