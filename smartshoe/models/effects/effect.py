"""What an effect is: a block at one place of the measurement chain, with parameters of which the strengths may be null.

*The chain's units.* Loads are shares of the full-scale load (f = 1 at full scale). Pressures are the same shares: the
linear core has static gain 1, so that a held load f gives the pressure f, and the sensor's gain (reading per share)
stands at the chain's end. So every strength is a share of full scale.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache
from typing import ClassVar, Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.models.core import Core
from smartshoe.models.effects.exposure import CLOCK, LATER_CYCLES, Exposure
from smartshoe.models.elements import Arm, Element

Place = Literal["machine", "contact", "wall", "core", "gas", "sensor", "logger"]
PLACES: tuple[Place, ...] = ("machine", "contact", "wall", "core", "gas", "sensor", "logger")
"""Order of the chain. "wall" blocks turn the load that acts on the tube, "core" ones add states to the linear network
of wall and gas, "gas" ones turn the pressure in the tube, "sensor" ones what the sensor makes of it."""


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """One number of an effect.

    ``unit``: SI, or with the words FS_load and FS_reading for a share of the full-scale load or reading
    ("FS_reading/s"), which a report turns into newtons and the reading's own unit. ``null``: the value at which the
    effect is the identity; None for a parameter of shape (a time constant, an exponent), which has no meaning while the
    strength is null. ``lower``, ``upper``: bounds, a physical sign among them. ``size``: a typical value, or change
    from null; the step of a derivative is a small part of it. ``prior_sd``: standard deviation of a Gaussian prior
    about the null value, which a fit takes as one more row of its likelihood; None for a parameter that the data alone
    decide. ``channel``: what must be logged for the parameter to do anything ("temperature"); '' where load and time
    suffice. ``absent``: its value in files of models that are older than the parameter; None where every file holds it.
    ``kind_ends``: the bounds at which the effect turns into one of another kind, as a relaxation with a time constant
    beyond all holds into a drift; '' where a bound is only the farthest that was seen. ``natural``: the bounds of what
    can be at all, as none and all of a share: at these the equation still holds. ``farthest``: a bound beyond
    ``lower`` or ``upper`` for models whose fit ended there; a search with such a width bends the law towards what is
    none.
    """

    name: str
    unit: str
    says: str
    null: float | None
    lower: float
    upper: float
    size: float
    prior_sd: float | None = None
    channel: Exposure | Literal[""] = ""
    kind_ends: Literal["", "lower", "upper", "both"] = ""
    absent: float | None = None
    natural: Literal["", "lower", "upper", "both"] = ""
    farthest: float | None = None

    def is_stretched(self, value: float) -> bool:
        """Whether a value lies at a bound that is not a natural one."""
        below, above = self.natural not in ("lower", "both"), self.natural not in ("upper", "both")
        return (below and value <= self.lower) or (above and value >= self.upper)

    @property
    def widened(self) -> EffectParameter:
        """The parameter with ``farthest`` for the bound on its side."""
        if self.farthest is None:
            return self
        lower, upper = min(self.farthest, self.lower), max(self.farthest, self.upper)
        return replace(self, lower=lower, upper=upper, farthest=None)

    def stretched(self, by: float) -> EffectParameter:
        """The parameter, a time, with longer bounds."""
        farthest = None if self.farthest is None else by * self.farthest
        return replace(self, upper=by * self.upper, farthest=farthest)

    def is_where_kind_ends(self, value: float) -> bool:
        """Whether a value lies at a bound beyond which the effect is of another kind."""
        above, below = self.kind_ends in ("upper", "both"), self.kind_ends in ("lower", "both")
        return (above and value >= self.upper) or (below and value <= self.lower)


LEAST_CHANGE_K = 0.2  # noise and steps of a cheap probe: a smaller change counts as no change
MOST_KEPT = 6  # arrays cached by one name: a law's own, and those with one of its shape parameters moved


@dataclass(frozen=True, eq=False)
class Conditions:
    """What a block may know beside its signal: one session (the unit at rest and zeroed before) on an even grid.

    ``time_s`` (n,) from the session's start at a step of ``step_s``; ``load`` (n,) the measured load as a share of full
    scale; ``load_noise`` the standard deviation of its noise, and ``load_noise_left`` (n,) the share of its variance
    that is left where the load was smoothed, if that is known. ``before``: what an earlier recording left behind
    (largest load, cycles, time, dose) where this one continues it; ``earlier`` (m,): the load up to then on the same
    step, (0,) where it continues none. ``temperature_k`` (n,) above the first value of the first session, and
    ``neighbour`` (n,), the pressure of another unit as a share of this unit's full scale, are None where not logged.
    ``relaxing``: share and rate in 1/s of the model's relaxing arm, for effects that bend beside it; None for all
    others, and outside a model.
    """

    time_s: Array
    load: Array
    step_s: float
    load_noise: float = 0.0
    temperature_k: Array | None = None
    neighbour: Array | None = None
    before: Mapping[str, float] = field(default_factory=dict)
    earlier: Array = field(default_factory=lambda: np.zeros(0))
    relaxing: tuple[float, float] | None = None
    load_noise_left: Array | None = None
    cache: dict[str, Array] = field(default_factory=dict, repr=False)
    """What blocks derive from the load alone (largest so far, cycles done), by name."""
    _kept: dict[str, dict[tuple[float, ...], Array]] = field(default_factory=dict, init=False, repr=False)

    def within(self, share: float, rate_per_s: float) -> Conditions:
        """The same conditions, with all that was derived from them, in a model with such a relaxing arm."""
        return replace(self, relaxing=(share, rate_per_s))

    def until(self, last_s: float) -> Conditions:
        """The same with a clock that stands still from ``last_s`` seconds after the session began."""
        stands_s = last_s - self.before.get("time_s", 0.0)
        if not self.time_s.size or self.time_s[-1] <= stands_s:
            return self
        return replace(self, time_s=np.minimum(self.time_s, stands_s))

    def kept(self, name: str, numbers: tuple[float, ...], make: Callable[[], Array]) -> Array:
        """Array that ``make`` derives from these conditions and ``numbers`` alone; the last few by a name are cached.

        A fit asks for the same one again whenever it moves another parameter. Nobody may write to the array.
        """
        known = self._kept.setdefault(name, {})
        found = known.pop(numbers, None)
        if found is None:
            found = make()
            if len(known) >= MOST_KEPT:
                known.pop(next(iter(known)))
        known[numbers] = found  # the last asked for stands last
        return found

    @property
    def rate_per_s(self) -> Array:
        """(n,) the load's slope in full scales a second, by central differences."""
        found = self.cache.get("rate_per_s")
        if found is None:
            found = np.gradient(self.load, self.step_s) if self.load.size > 1 else np.zeros(self.load.size)
            self.cache["rate_per_s"] = found
        return found

    @property
    def begins_warmer_k(self) -> float:
        """How much warmer in K the recording begins than the first session; 0 where a cheap probe would not show it."""
        begins = 0.0 if self.temperature_k is None else float(self.temperature_k[0])
        return begins if abs(begins) >= LEAST_CHANGE_K else 0.0


class Inverse(ABC):
    """The inverse of a block, run on a stream; it gives the same numbers however the stream is cut into chunks."""

    @abstractmethod
    def push(self, signal: Array, time_s: Array) -> Array:
        """The block's input (n,) from its output ``signal`` (n,), at ``time_s`` (n,) since the session began."""

    def reset(self) -> None:  # noqa: B027 - a block without memory has nothing to forget
        """Forget the past."""

    @abstractmethod
    def c_step(self, name: str) -> CStep:
        """The inverse as C99, for the export; ``name`` is unique in the chain and precedes every identifier."""

    def c_single(self, name: str) -> CStep:
        """`c_step` in the form that loses least in single precision; written in doubles, turned into floats later."""
        return self.c_step(name)


@dataclass(frozen=True, slots=True)
class CStep:
    """C99 that turns the double ``x`` in place at the double time ``t`` in s (``f`` is the filter's struct).

    ``states``: members of the struct (doubles) with their initial values, read and written as ``f->member``;
    ``body``: statements, constants written with 17 digits.
    """

    states: Mapping[str, float]
    body: str


@dataclass(frozen=True, slots=True)
class ChainContext:
    """What an inverse may know of the chain that it stands in.

    ``arm``: the baseline's relaxing arm. ``noise``: rms, as a share of full scale, of what is in the signal but not of
    the load.
    """

    arm: Arm
    noise: float = 0.0


class Effect(ABC):
    """One effect of the catalogue; a subclass a file, one instance a class.

    ``shapes``: points of a grid over the parameters without a null value, at which the score test takes sensitivities.
    ``needs``: channels without which it cannot be seen ("neighbour").
    ``exposed_by``: what a protocol must hold to show it, in the words of `smartshoe.models.effects.exposure`.
    ``separated_by``: by another effect's name, the words for what tells the two apart, any of them suffices.
    ``is_physical``: False for noise and faults of the data, which are never named as a cause by their waveform.
    ``is_latency``: True where the reading comes late, or early, and is not changed otherwise.
    ``is_seen_at_rest``: True where the reading without load shows the effect's size.
    ``shifts``: "load" or "reading" where the effect adds its one value to it, whatever the time and the load.
    ``between_clocks``: "lag" or "rate" where the one value of a latency is a difference of two clocks.
    ``is_drift``: True where it goes on with the time since the session began, whatever the load; on a stream it is
    undone by a `Memoryless` inverse, if at all.
    ``is_leak``: True where air leaves the tube, so that an inverse sums up from the readings what has left.
    ``clips``: True where it may leave so little slope (`slope_left`) that a reading no longer tells the load.
    ``why_not_undone``: half a sentence for a physical effect without an inverse, or for values at which it has none.
    ``is_flexible``: True for a block that follows any member of its family; it is never named as a cause.
    ``is_refinement``: True where such a block follows members of other families too, so that it tells no kind.
    ``why_unnamed``: of a block that follows what no law of the catalogue does, what the reading then does.
    ``is_catch_all``: True of such a block that follows a part of what is left in most data, whatever that is of; it is
    sought only where it does more by itself than any other effect.
    ``is_steep_undone``: True where half a spacing of single precision in a signal moves the load by 3e-7 of full scale.
    ``is_memoryless``: True where the reading is a function of the present load alone.
    ``bends_beside_arm``: True where it needs ``conditions.relaxing``, which a model gives to such effects only.
    ``imitates``: another family, of which the effect counts as a member where no fault of the data speaks for it.
    ``branch``: a part of its family, where that has several effects that may be there together and be mistaken for one
    another.
    ``never_fades``: True where what past loads left behind stays until the next ones, as in friction.
    ``mechanism``: what effects of several families are limits of, so that the departure of one looks like another.
    ``of_either_sign``: what the effect and its strength say where the strength may have either sign, as the reading
    of any sensor but a gas's pressure may fall as well as creep up in holds; None where the sign is fixed.
    """

    name: ClassVar[str]
    family: ClassVar[str]
    stage: ClassVar[str]
    place: ClassVar[Place]
    says: ClassVar[str]
    parameters: ClassVar[tuple[EffectParameter, ...]]
    shapes: ClassVar[tuple[Mapping[str, float], ...]] = ({},)
    needs: ClassVar[frozenset[str]] = frozenset()
    exposed_by: ClassVar[frozenset[Exposure]] = frozenset()
    separated_by: ClassVar[Mapping[str, frozenset[Exposure]]] = {}
    is_physical: ClassVar[bool] = True
    is_latency: ClassVar[bool] = False
    is_seen_at_rest: ClassVar[bool] = False
    shifts: ClassVar[Literal["load", "reading"] | None] = None
    between_clocks: ClassVar[Literal["lag", "rate"] | None] = None
    is_drift: ClassVar[bool] = False
    is_leak: ClassVar[bool] = False
    clips: ClassVar[bool] = False
    why_not_undone: ClassVar[str] = ""
    is_flexible: ClassVar[bool] = False
    why_unnamed: ClassVar[str] = ""
    is_catch_all: ClassVar[bool] = False
    is_memoryless: ClassVar[bool] = False
    bends_beside_arm: ClassVar[bool] = False
    imitates: ClassVar[str] = ""
    branch: ClassVar[str] = ""
    never_fades: ClassVar[bool] = False
    mechanism: ClassVar[str] = ""
    is_refinement: ClassVar[bool] = False
    is_steep_undone: ClassVar[bool] = False
    of_either_sign: ClassVar[tuple[str, str] | None] = None

    @abstractmethod
    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The block's output (n,) for its input ``signal`` (n,); ``values`` in the parameters' order. Not in place."""

    def inverse(self, values: Array, step_s: float) -> Inverse | None:
        """The inverse on a stream; None where there is none (a delay, noise, a signal lost to saturation)."""
        return None

    def inverse_within(self, chain: ChainContext, values: Array, step_s: float) -> Inverse | None:
        """`inverse` for a place in a ``chain``: for effects that bend beside its arm or remember reversals."""
        return self.inverse(values, step_s)

    def slope_left(self, signal: Array, values: Array) -> Array:
        """(n,) slope of the output over the input ``signal`` (n,) of an effect that ``clips``; 0 where it says none."""
        return np.zeros_like(signal)

    @property
    def kind(self) -> str:
        """The family of which the effect is a law, or counts as one."""
        return self.imitates or self.family

    @property
    def needs_cycles(self) -> bool:
        """Whether it is a memory that only later load cycles show."""
        return not self.is_memoryless and bool(self.exposed_by) and self.exposed_by <= LATER_CYCLES

    @property
    def goes_with_the_clock(self) -> bool:
        """Whether it goes with time, or with what was borne so far, by what tells its neighbours from it."""
        return any(words & CLOCK for words in self.separated_by.values())

    def of_any_sensor(self) -> Effect:
        """The effect for a reading that is no pressure: stress, or the conduction of a polymer, may fall in holds."""
        return self if self.of_either_sign is None else _of_either_sign(self, *self.of_either_sign)

    def lasting(self, stretch: float) -> Effect:
        """The effect for recordings ``stretch`` times longer than usual: its slowest time constants grow in proportion.

        Shapes that are searched are added up to there, from a factor of two to one of four apart.
        """
        slow = {p.name for p in self.parameters if p.unit == "s" and p.null is None}
        if stretch <= 1.0 or not slow:
            return self
        longer = tuple(p.stretched(stretch) if p.name in slow else p for p in self.parameters)
        count = math.ceil(math.log(stretch, 4.0)) if stretch >= 2.0 else 0
        more = [
            {name: value * stretch ** (k / count) if name in slow else value for name, value in slowest.items()}
            for k in range(1, count + 1)
            for slowest in self._slowest_shapes(slow)
        ]
        return _variant(self, parameters=longer, shapes=(*self.shapes, *more))

    def _slowest_shapes(self, slow: Collection[str]) -> list[Mapping[str, float]]:
        """The shapes of the longest times of the parameters named ``slow``."""
        times = [tuple(shape[name] for name in slow if name in shape) for shape in self.shapes]
        return [shape for shape, time in zip(self.shapes, times, strict=True) if time and time == max(times)]

    def widened_at(self, values: Array) -> Effect:
        """The effect with each bound that ``values`` lie at moved to the ``farthest``; itself where there is none."""
        wider = tuple(
            p.widened if not p.widened.is_stretched(v) and p.is_stretched(v) else p
            for p, v in zip(self.parameters, map(float, values), strict=True)
        )
        return self if wider == self.parameters else _variant(self, parameters=wider)

    def of_at_most(self, value: float) -> Effect:
        """The effect, of one parameter, with bounds at null and at ``value``."""
        (strength,) = self.parameters
        null = strength.null or 0.0
        return _variant(self, parameters=(replace(strength, lower=min(null, value), upper=max(null, value)),))

    def departs_by(self, values: Array) -> float:
        """By what share of itself the effect differs from a law, of a block that follows what no law does."""
        return 1.0

    def falling_at(self, rate_per_s: float, wall_ratio: float) -> Array | None:
        """Values by which the reading of a held load falls at ``rate_per_s``; None if the effect makes none fall so.

        ``wall_ratio``: 1 + k1 x0^2/(nRT), how stiff wall and gas are over the gas alone.
        """
        return None

    def late_s(self, values: Array, time_s: float) -> float:
        """How late in s the reading of a steady ramp is ``time_s`` into a recording, if the effect ``is_latency``."""
        return 0.0

    def delay_s(self, values: Array) -> float:
        """The constant time in s by which the reading is late, and by which a whole recording can be shifted back."""
        return 0.0

    def shapes_with(self, channels: Collection[str]) -> tuple[Mapping[str, float], ...]:
        """``shapes`` where these ``channels`` are logged; those that differ only by another channel count as one."""
        inert = {p.name for p in self.parameters if p.channel and p.channel not in channels}
        seen: dict[tuple[tuple[str, float], ...], Mapping[str, float]] = {}
        for shape in self.shapes:
            seen.setdefault(tuple((key, value) for key, value in shape.items() if key not in inert), shape)
        return tuple(seen.values())

    def start(self, shape: Mapping[str, float] | None = None) -> Array:
        """Null strengths, with the shape parameters at ``shape``, or at the first of ``shapes``."""
        at = {**self.shapes[0], **(shape or {})}
        missing = [p.name for p in self.parameters if p.null is None and p.name not in at]
        if missing:
            raise UsageError(f"effect {self.name}: shape parameter {missing[0]} has no value")
        return np.array([at[p.name] if p.null is None else p.null for p in self.parameters], dtype=float)

    def begun(
        self, shape: Mapping[str, float] | None = None, sizes: float = 0.5, logged: Collection[str] = ()
    ) -> Array:
        """As `start`, with each strength ``sizes`` typical sizes away from null, on the side that physics allows.

        A strength that needs a channel which is not ``logged`` stays null: no data would move it from where a fit
        begins.
        """
        values = self.start(shape)
        for k, p in enumerate(self.parameters):
            if p.null is not None and (not p.channel or p.channel in logged):
                values[k] = min(max(p.null + (sizes if p.upper > p.null else -sizes) * p.size, p.lower), p.upper)
        return values

    def kind_ends_at(self, values: Array) -> list[tuple[EffectParameter, float]]:
        """The parameters, with their ``values`` (k,), that lie where the effect turns into one of another kind."""
        valued = ((one, float(value)) for one, value in zip(self.parameters, values, strict=True))
        return [(one, value) for one, value in valued if one.is_where_kind_ends(value)]

    def is_null(self, values: Array) -> bool:
        """Whether every strength is at its null value."""
        return all(p.null is None or value == p.null for p, value in zip(self.parameters, values, strict=True))


@cache
def _of_either_sign(effect: Effect, says: str, of_strength: str) -> Effect:
    """``effect`` with its strengths' bounds as far from null on the other side as on the usual one."""
    strengths = (
        one if one.null is None else replace(one, says=of_strength, lower=2.0 * one.null - one.upper)
        for one in effect.parameters
    )
    return _variant(effect, says=says, parameters=tuple(strengths))


def _variant(effect: Effect, **traits: object) -> Effect:
    """``effect`` with other ``traits``."""
    variant = copy(effect)
    vars(variant).update(traits)
    return variant


class CoreEffect(Effect):
    """An effect that adds states to the linear network of wall and gas (`smartshoe.models.core`)."""

    place: ClassVar[Place] = "core"

    @abstractmethod
    def elements(self, values: Array) -> tuple[Element, ...]:
        """The elements that it adds to the network."""

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The output (n,) of a network of these elements alone: without the baseline's arm, of static gain 1."""
        return Core(self.elements(values)).simulate(signal, conditions.step_s)
