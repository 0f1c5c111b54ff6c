"""The shape of an effect: a block at one place of the measurement chain, with parameters that have a null value.

*The chain's units.* Loads are shares of the full-scale load (f = 1 at full scale). Pressures are the same shares: the
linear core has static gain 1, so that a held load f gives the pressure f, and the sensor's gain (reading per share)
stands at the chain's end. So every strength is a share of full scale.
"""

from __future__ import annotations

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
    ("FS_reading/s"), which a report turns into newtons and the reading's own unit.
    ``null``: the value at which the effect is the identity; None for a parameter of shape (a time constant, an
    exponent), which means nothing while the strength is null. ``lower`` and ``upper`` are bounds, a physical sign
    among them. ``size``: a typical value, or change from null; the step of derivatives is a small part of it.
    ``prior_sd``: standard deviation of a Gaussian prior about the null value, which a fit takes as one more row of its
    likelihood; None for a parameter that the data alone decide. ``channel``: what must be logged for the parameter to
    do anything ("temperature"); '' where it needs nothing but load and time. ``absent``: its value in files of models
    from before it was known; None where every file holds it. ``kind_ends``: the bounds at which an
    effect turns into one of another kind, as a relaxation into a drift where its time constant grows beyond all holds;
    '' where a bound is only as far as anybody has seen. ``natural``: bounds that are no end of what was seen but of
    what there is, as of a share none and all are: the equation is itself there.
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

    def is_stretched(self, value: float) -> bool:
        """Whether a value lies at a bound that is not a natural one."""
        below, above = self.natural not in ("lower", "both"), self.natural not in ("upper", "both")
        return (below and value <= self.lower) or (above and value >= self.upper)

    def is_where_kind_ends(self, value: float) -> bool:
        """Whether a value lies at a bound beyond which the effect is of another kind."""
        above, below = self.kind_ends in ("upper", "both"), self.kind_ends in ("lower", "both")
        return (above and value >= self.upper) or (below and value <= self.lower)


LEAST_CHANGE_K = 0.2  # below a cheap probe's noise and steps: such a channel says that the temperature stood still
MOST_KEPT = 6  # of one name: a law's own, and those with one of its shape's numbers moved


@dataclass(frozen=True, eq=False)
class Conditions:
    """What a block may know beside its signal: one session (the unit at rest and zeroed before) on an even grid.

    ``time_s`` (n,) from the session's start, step ``step_s``; ``load`` (n,) the measured load as a share of full
    scale; ``load_noise`` its noise's standard deviation; ``before`` what an earlier recording left behind (largest
    load, cycles, time, dose) where this one continues it, and ``earlier`` (m,) the load up to then on the same step,
    (0,) where it continues none. ``temperature_k`` (n,) above the first value of the first session, and ``neighbour``
    (n,) another unit's pressure as a share of this unit's full scale, are None where not logged.
    ``relaxing`` are the share and the rate in 1/s of the model's relaxing arm while it runs, for effects that say that
    they bend beside it; None for all others, and outside a model.
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
    cache: dict[str, Array] = field(default_factory=dict, repr=False)
    """What blocks derive from the load alone (largest so far, cycles done), by name."""
    _kept: dict[str, dict[tuple[float, ...], Array]] = field(default_factory=dict, init=False, repr=False)

    def within(self, share: float, rate_per_s: float) -> Conditions:
        """The same conditions, and what was derived from them, within a model whose arm relaxes so."""
        return replace(self, relaxing=(share, rate_per_s))

    def until(self, last_s: float) -> Conditions:
        """The same with a clock that stands still from ``last_s`` on, seconds since the session began."""
        stands_s = last_s - self.before.get("time_s", 0.0)
        if not self.time_s.size or self.time_s[-1] <= stands_s:
            return self
        return replace(self, time_s=np.minimum(self.time_s, stands_s))

    def kept(self, name: str, numbers: tuple[float, ...], make: Callable[[], Array]) -> Array:
        """What ``make`` derives from these conditions and ``numbers`` alone: the last few by a name are kept.

        A fit asks for the same again wherever it moves another parameter. Nobody may write to what it gives.
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
        """(n,) the load's slope in full scales a second, central differences."""
        found = self.cache.get("rate_per_s")
        if found is None:
            found = np.gradient(self.load, self.step_s) if self.load.size > 1 else np.zeros(self.load.size)
            self.cache["rate_per_s"] = found
        return found

    @property
    def begins_warmer_k(self) -> float:
        """By how much it begins warmer than the first session did; 0 where no cheap probe would show it."""
        begins = 0.0 if self.temperature_k is None else float(self.temperature_k[0])
        return begins if abs(begins) >= LEAST_CHANGE_K else 0.0


class Inverse(ABC):
    """A block's inverse, run on a stream: the same numbers for any chunking."""

    @abstractmethod
    def push(self, signal: Array, time_s: Array) -> Array:
        """What went into the block (n,) from what came out of it (n,), at ``time_s`` (n,) since the session began."""

    def reset(self) -> None:  # noqa: B027 - a block without memory has nothing to forget
        """Forget the past."""

    @abstractmethod
    def c_step(self, name: str) -> CStep:
        """The same as C99, for the export; ``name`` is unique in the chain and goes before every identifier."""

    def c_single(self, name: str) -> CStep:
        """`c_step` in the form that loses least in single precision: written in doubles, turned into floats later."""
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

    ``arm`` is the baseline's; ``noise`` the rms of what comes in that is none of the load, a share of full scale.
    """

    arm: Arm
    noise: float = 0.0


class Effect(ABC):
    """One effect of the catalogue; a subclass a file, one instance a class.

    ``shapes``: points of a grid over the parameters without a null value, where the screen takes sensitivities.
    ``needs``: channels without which it cannot be seen ("neighbour").
    ``exposed_by``: what a protocol must hold, in the words of `smartshoe.models.effects.exposure`.
    ``separated_by``: neighbour's name to the words for what tells it from this one, any of them; the neighbour says
    the same of this one.
    ``is_physical``: False for noise and faults of the data, which are never a cause by their waveform.
    ``is_latency``: True where the reading comes late, or early, and is changed in nothing else.
    ``is_seen_at_rest``: True where the reading without load shows the effect's size.
    ``shifts``: "load" or "reading" where the effect adds its one value to it, whatever the time and the load.
    ``between_clocks``: "lag" or "rate" where the one value of a latency is what two clocks differ by.
    ``is_drift``: True where it goes on with the time since the session began, whatever the load; on a stream it is
    undone by a `Memoryless` inverse, if at all.
    ``is_leak``: True where air leaves the tube, so that an inverse sums up what is gone from the readings.
    ``clips``: a reading that it moves tells no load any more.
    ``why_not_undone``: half a sentence for a physical effect without an inverse.
    ``is_flexible``: True for a block that follows any member of its family and is none: it is never named as a cause;
    ``is_refinement`` where it follows members of other families too, and so tells no kind.
    ``why_unnamed``: of a block that follows what no law of the catalogue does, what the reading then does.
    ``is_steep_undone``: True where half a spacing of single precision in a signal moves the load by 3e-7 of full scale.
    ``is_memoryless``: True where the reading is a function of the present load alone.
    ``bends_beside_arm``: True where it looks at ``conditions.relaxing``, which a model tells such effects only.
    ``imitates``: another family, of which this effect counts as a member where no fault of the data speaks for it.
    ``branch``: which of its family's, where that has several that may be there together and be told for one another.
    ``never_fades``: True where what past loads left behind stays as it is until the next ones, as friction does.
    ``mechanism``: what effects of several families are limits of, so that one's departure looks like another.
    ``of_either_sign``: what it and its strength say where the strength may have either sign, as the reading of any
    other sensor than a gas's pressure may fall as well as creep up in holds; None of one whose sign is what it is.
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
        """The block's output (n,) for its input (n,); ``values`` in the order of ``parameters``. Never in place."""

    def inverse(self, values: Array, step_s: float) -> Inverse | None:
        """The streaming inverse, None where there is none (a delay, noise, a signal lost to saturation)."""
        return None

    def inverse_within(self, chain: ChainContext, values: Array, step_s: float) -> Inverse | None:
        """The same in a chain, for what bends beside its arm, or must not remember its noise."""
        return self.inverse(values, step_s)

    @property
    def kind(self) -> str:
        """The family that it is a law of, or counts as one of."""
        return self.imitates or self.family

    @property
    def needs_cycles(self) -> bool:
        """Whether it is a memory that nothing but later load cycles show."""
        return not self.is_memoryless and bool(self.exposed_by) and self.exposed_by <= LATER_CYCLES

    @property
    def goes_with_the_clock(self) -> bool:
        """Whether it goes with time, or with what was borne so far, by what its neighbours are told from it."""
        return any(words & CLOCK for words in self.separated_by.values())

    def of_any_sensor(self) -> Effect:
        """The same of a reading that is no pressure: stress, and what a polymer conducts, may give way in holds."""
        return self if self.of_either_sign is None else _of_either_sign(self, *self.of_either_sign)

    def departs_by(self, values: Array) -> float:
        """Of a block that follows what no law does: by what share of itself it differs from a law."""
        return 1.0

    def falling_at(self, rate_per_s: float, wall_ratio: float) -> Array | None:
        """The parameters by which the reading of a held load falls at a rate, None of one that makes none fall so.

        ``wall_ratio``: 1 + k1 x0^2/(nRT), how stiff the wall is beside the gas.
        """
        return None

    def late_s(self, values: Array, time_s: float) -> float:
        """By how much a reading of a steady ramp is late ``time_s`` into a recording, of one that ``is_latency``."""
        return 0.0

    def delay_s(self, values: Array) -> float:
        """The constant time by which it makes a reading late, and which a whole recording can be shifted back by."""
        return 0.0

    def shapes_with(self, channels: Collection[str]) -> tuple[Mapping[str, float], ...]:
        """``shapes`` where these are logged: those that differ by what needs another channel are one."""
        inert = {p.name for p in self.parameters if p.channel and p.channel not in channels}
        seen: dict[tuple[tuple[str, float], ...], Mapping[str, float]] = {}
        for shape in self.shapes:
            seen.setdefault(tuple((key, value) for key, value in shape.items() if key not in inert), shape)
        return tuple(seen.values())

    def start(self, shape: Mapping[str, float] | None = None) -> Array:
        """Null strengths with the shape parameters at ``shape``, or at the first of ``shapes``."""
        at = {**self.shapes[0], **(shape or {})}
        missing = [p.name for p in self.parameters if p.null is None and p.name not in at]
        if missing:
            raise UsageError(f"effect {self.name}: shape parameter {missing[0]} has no value")
        return np.array([at[p.name] if p.null is None else p.null for p in self.parameters], dtype=float)

    def begun(
        self, shape: Mapping[str, float] | None = None, sizes: float = 0.5, logged: Collection[str] = ()
    ) -> Array:
        """As `start`, with each strength ``sizes`` typical ones away from null, on the side that physics allows.

        Those of a channel that is not ``logged`` stay at null: nothing would move them from where they begin.
        """
        values = self.start(shape)
        for k, p in enumerate(self.parameters):
            if p.null is not None and (not p.channel or p.channel in logged):
                values[k] = min(max(p.null + (sizes if p.upper > p.null else -sizes) * p.size, p.lower), p.upper)
        return values

    def is_null(self, values: Array) -> bool:
        """Whether every strength is at its null value."""
        return all(p.null is None or value == p.null for p, value in zip(self.parameters, values, strict=True))


@cache
def _of_either_sign(effect: Effect, says: str, of_strength: str) -> Effect:
    """``effect`` with as much room on the other side of null."""
    strengths = (
        one if one.null is None else replace(one, says=of_strength, lower=2.0 * one.null - one.upper)
        for one in effect.parameters
    )
    made = copy(effect)
    vars(made).update(says=says, parameters=tuple(strengths))
    return made


class CoreEffect(Effect):
    """An effect that adds states to the linear network of wall and gas (`smartshoe.models.core`)."""

    place: ClassVar[Place] = "core"

    @abstractmethod
    def elements(self, values: Array) -> tuple[Element, ...]:
        """What it adds to the network."""

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The network with these elements alone: no relaxation of the baseline, unit static gain."""
        return Core(self.elements(values)).simulate(signal, conditions.step_s)
