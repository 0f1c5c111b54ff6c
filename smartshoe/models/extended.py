"""The standard linear solid with effects: the whole measurement chain, simulated forward."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
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
    EffectParameter("relaxation_rate", "1/s", "k2/c, the paper's a1", None, 0.01, 50.0, 0.2),
)
DERIVATIVE_STEP = 1e-3  # of a parameter's size


@dataclass(frozen=True, eq=False)
class Part:
    """An effect in a model, with the values of its parameters.

    ``until_s``: seconds since a session began from which on it stays as it is by then, where it goes with the clock.
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
        """Each parameter with its value."""
        return [(one, float(value)) for one, value in zip(self.effect.parameters, self.values, strict=True)]

    @property
    def kind_ends_at(self) -> tuple[tuple[EffectParameter, float], ...]:
        """The parameters whose values lie where it turns into an effect of another kind."""
        return tuple((one, value) for one, value in self.valued if one.is_where_kind_ends(value))

    @property
    def bends_too_little(self) -> bool:
        """Whether it is a curve's law whose strength lies at the end of its range: the unit may bend farther.

        Not where its kind ends, beyond which it is any curve.
        """
        ends = (one.is_stretched(value) for one, value in self.valued if one.null is not None and value != one.null)
        is_law = self.effect.is_memoryless and not (self.effect.is_flexible or self.kind_ends_at)
        return is_law and any(ends)


@dataclass(frozen=True, eq=False)
class ExtendedModel:
    """The standard linear solid (Chinimilli 2016, equation 2) with effects, ``parts``, at their places of the chain.

    ``gain`` is the reading of a held full-scale load as a share of ``full_scale_reading`` (in ``reading_unit``);
    ``relaxing_share`` kappa and ``relaxation_rate_per_s`` a give p/f = (s + a)/((1 + kappa) s + a). ``wall_ratio`` is
    N of `smartshoe.models.core`, which matters for leaks and heat only. ``noise`` is the rms, a share of
    ``full_scale_reading``, of what readings hold besides: its inverse remembers no reversal that may be of it.
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

    # -- parameters as one vector ------------------------------------------------------------------------------
    @cached_property
    def parameters(self) -> tuple[tuple[str, EffectParameter], ...]:
        """(effect's name or "baseline", parameter) in the order of `theta`."""
        own = [("baseline", parameter) for parameter in BASELINE]
        return (*own, *((part.name, parameter) for part in self.parts for parameter in part.effect.parameters))

    @property
    def pole_per_s(self) -> float:
        """a/(1 + kappa): the rate at which what an earlier load left in the relaxing arm fades from the reading."""
        return self.relaxation_rate_per_s / (1.0 + self.relaxing_share)

    @property
    def theta(self) -> Array:
        """Every parameter's value (p,)."""
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
        """This model with one more effect, itself or its name, at null where ``values`` are not given."""
        added = effect(added) if isinstance(added, str) else added
        part = Part(added, added.start() if values is None else np.array(values, dtype=float))
        return replace(self, parts=(*self.parts, part))

    def part(self, name: str) -> Part:
        """The effect ``name`` in it; KeyError where it is not."""
        return {part.name: part for part in self.parts}[name]

    def without(self, *names: str) -> ExtendedModel:
        """This model without the named effects; itself where it has none of them."""
        kept = tuple(part for part in self.parts if part.name not in names)
        return replace(self, parts=kept) if len(kept) < len(self.parts) else self

    def held_after(self, last_s: float, but: Collection[str]) -> ExtendedModel:
        """This model with its drifts, ``but`` for these, as they are ``last_s`` into a session from then on.

        Itself where there are none to hold.
        """
        held = {part.name for part in self.parts if part.effect.is_drift and part.name not in but}
        parts = (replace(part, until_s=last_s) if part.name in held else part for part in self.parts)
        return replace(self, parts=tuple(parts)) if held else self

    def held_as(self, other: ExtendedModel) -> ExtendedModel:
        """This model with the drifts that it shares with another held when they are there."""
        until_s = {part.name: part.until_s for part in other.parts}
        return replace(
            self, parts=tuple(replace(part, until_s=until_s.get(part.name, part.until_s)) for part in self.parts)
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The effects in it."""
        return tuple(part.name for part in self.parts)

    # -- the chain -----------------------------------------------------------------------------------------------
    @cached_property
    def core(self) -> Core:
        """The linear network of wall and gas."""
        elements: list[Element] = [Arm(self.relaxing_share, self.relaxation_rate_per_s)]
        for part in self.parts:
            if isinstance(part.effect, CoreEffect):
                elements += part.effect.elements(part.values)
        return network(tuple(elements), self.wall_ratio)

    @cached_property
    def chain(self) -> tuple[Part | None, ...]:
        """The blocks in the order in which the signal passes them; None stands for the core."""
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
        """The reading's share (n,) from the ``signal`` (n,) into block ``first``; ``core``: another's, alike."""
        for part in self.chain[first:]:
            if inputs is not None:
                inputs.append(signal)
            if part is None:
                signal = _through(core or self.core, signal, conditions)
            else:
                given = self._around(conditions) if part.effect.bends_beside_arm else conditions
                signal = part.effect.apply(signal, given.until(part.until_s), part.values)
                refuse_other_size(part.name, signal, conditions.load.size)
        return self.gain * signal

    def _around(self, conditions: Conditions) -> Conditions:
        """``conditions`` with the relaxing arm: blocks that bend a spring beside it solve the balance of both."""
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
        """For each parameter but the gain."""
        theta, made = self.theta, []
        place_of = {part.name: k for k, part in enumerate(self.chain) if part is not None}
        core = self.chain.index(None)
        # What the arm is felt by first: a block that bends beside it, or the core.
        arm = next(k for k, part in enumerate(self.chain) if part is None or part.effect.bends_beside_arm)
        for j, (owner, parameter) in enumerate(self.parameters):
            if j == 0:
                continue
            step = derivative_step(parameter, theta[j])
            moved = theta.copy()
            moved[j] += step
            first = arm if owner == "baseline" else place_of.get(owner, core)
            trial = self.at(moved)
            alike = first != core and owner != "baseline"  # this parameter does not touch the core
            made.append(Extension(step, trial, first, self.core if alike else None))
        return tuple(made)

    def sensitivities(
        self, conditions: Conditions, trace: Trace | None = None, out: Array | None = None
    ) -> tuple[Array, Array]:
        """The reading (n,) and its derivatives (n, p) with respect to `theta`, by one-sided differences.

        The chain is run anew only from the first block that a parameter moves.
        ``trace``: this model's own under the same conditions, where it is known; ``out`` takes the derivatives.
        """
        trace = trace or self.trace(conditions)
        out = np.empty((trace[0].size, 1 + len(self._varied)), order="F") if out is None else out
        np.divide(trace[0], self.gain, out=out[:, 0])
        self.column_of(self._varied, conditions, trace, out[:, 1:])
        return trace[0], out

    def own_sensitivities(self, name: str, conditions: Conditions, trace: Trace) -> Array:
        """Of these derivatives those (n, k) with respect to the parameters of the effect ``name``."""
        own = [by for by, (owner, _) in zip(self._varied, self.parameters[1:], strict=True) if owner == name]
        return self.column_of(own, conditions, trace)

    def trace(self, conditions: Conditions) -> Trace:
        """The reading (n,), and what goes into each block of the chain, the chain's end last."""
        inputs: list[Array] = []
        reading = self._run(conditions.load, conditions, 0, inputs)
        return reading, [*inputs, reading / self.gain]

    def extended_by(self, added: Effect, start: Array) -> Extensions:
        """A small step of each strength of an effect that is not in it yet; ``start``: null strengths and a shape."""
        made = []
        for j, parameter in enumerate(added.parameters):
            if parameter.null is None:
                continue
            step = derivative_step(parameter, start[j])
            moved = start.copy()
            moved[j] += step
            trial, in_core = self.with_part(added, moved), isinstance(added, CoreEffect)
            names = [None if part is None else part.name for part in trial.chain]
            first = names.index(None if in_core else added.name)
            made.append(Extension(step, trial, first, None if in_core else self.core))
        return tuple(made)

    def column_of(
        self, by: Sequence[Extension], conditions: Conditions, trace: Trace, out: Array | None = None
    ) -> Array:
        """Derivatives (n, k) of the reading with respect to what ``by`` moves; ``trace`` is the model's own."""
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
        """The model that `to_dict` described; raises `UsageError` for an effect that is not known, `KeyError`."""
        held = given.get("held_after_s", {})
        plain = {key: given[key] for key in given if key not in ("effects", "held_after_s")}
        parts = []
        for name, values in given["effects"].items():
            stored = np.array([_stored(p, values) for p in effect(name).parameters])
            parts.append(Part(effect(name), stored, held.get(name, math.inf)))
        return cls(**plain, parts=tuple(parts))


def _through(core: Core, signal: Array, conditions: Conditions) -> Array:
    """What comes out of a core (n,) for a ``signal`` (n,) after the load that went before the recording.

    That load as it was measured: what blocks before the core would make of it is small in a memory.
    """
    earlier = conditions.earlier
    if not earlier.size:
        return core.simulate(signal, conditions.step_s)
    return core.simulate(np.concatenate([earlier, signal]), conditions.step_s)[earlier.size :]


def _stored(parameter: EffectParameter, values: Mapping[str, float]) -> float:
    """A parameter's value in a file, also in one from before the parameter was known."""
    return values[parameter.name] if parameter.absent is None else values.get(parameter.name, parameter.absent)


def derivative_step(parameter: EffectParameter, value: float) -> float:
    """A small step that stays within the parameter's bounds."""
    if parameter.null is None:
        step = DERIVATIVE_STEP * abs(value) or DERIVATIVE_STEP * parameter.size
    else:
        step = DERIVATIVE_STEP * max(parameter.size, abs(value - parameter.null))
    return -step if value + step > parameter.upper else step


@dataclass(frozen=True, eq=False)
class Extension:
    """A model with one parameter moved by ``step``: the ``first`` block that it moves, the ``core`` where it stays."""

    step: float
    model: ExtendedModel
    first: int
    core: Core | None

    def slope(self, reading: Array, inputs: Sequence[Array], conditions: Conditions, out: Array) -> None:
        """The reading's derivative, into ``out`` (n,); ``inputs``: what goes into each block of what did not move."""
        moved = self.model._run(inputs[self.first], conditions, self.first, core=self.core)
        np.subtract(moved, reading, out=out)
        out /= self.step


Extensions = tuple[Extension, ...]
Trace = tuple[Array, list[Array]]
