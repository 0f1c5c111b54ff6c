"""Every number that integrity and diagnosis decide by, in one record: unit, meaning and origin beside each."""

from __future__ import annotations

import math
from dataclasses import Field, dataclass, field, fields, replace
from itertools import pairwise
from numbers import Integral, Real
from typing import Any

from smartshoe.errors import UsageError


def threshold(
    value: Any, unit: str, meaning: str, origin: str, least: float | None = None, most: float = math.inf
) -> Any:
    """A field of `Thresholds` with its documentation, from ``least`` to ``most``; above 0 where ``least`` is None."""
    documented = {"unit": unit, "meaning": meaning, "origin": origin}
    return field(default=value, metadata={**documented, "least": least, "most": most})


PROTOCOL_S = 300.0  # the length of recordings for which all ranges of times were chosen


def stretch_by(longest_s: float) -> float:
    """How many times longer than `PROTOCOL_S` recordings of up to ``longest_s`` are, at least once."""
    return max(longest_s / PROTOCOL_S, 1.0)


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The numbers that a diagnosis decides by. Carried in the result and printed in the page; `described` lists them.

    Raises `UsageError` for numbers by which nothing can be decided: not finite, beyond the bounds, a count that is not
    whole, time constants that do not rise.
    """

    material: float = threshold(
        2e-4, "share of full scale", "smallest error of the reading that counts", "chosen: 0.02 %", most=0.5
    )
    imperfection: float = threshold(
        2e-4,
        "share of full scale",
        "standard deviation of what any effect adds to a good unit",
        "0.02 % of full scale",
    )
    departure: float = threshold(
        0.25,
        "share of an effect's size",
        "standard deviation by which a real law departs from an equation of its kind",
        "two simulated worlds: 0.05 to 0.4",
        least=0.0,
    )
    strength_sd: float = threshold(
        0.03,
        "share of full scale",
        "prior standard deviation of an effect's size, and of a recording's own gain",
        "effects of 0.1 to 10 %",
    )
    false_name: float = threshold(
        0.02, "probability", "chance of naming an effect that is not there", "chosen: 2 %", most=1.0
    )
    unknown_past: float = threshold(
        0.05,
        "share of full scale",
        "load that a unit may remember from before a recording that begins at rest",
        "judgement",
        least=0.0,
    )
    foreign_zero: float = threshold(
        0.3,
        "share of full scale",
        "reading at no load from which on it is how the sensor counts, and no offset",
        "judgement",
    )
    zero_sd: float = threshold(
        4e-4, "share of full scale", "standard deviation of a rest's zero", "load cells: 0.02 % of rating", least=0.0
    )
    linear: float = threshold(
        0.01,
        "share of full scale",
        "largest effect for which one linearisation of the model serves",
        "its square: 1e-4",
    )
    tolerable: float = threshold(
        1.5e-3,
        "share of full scale",
        "error that small imperfections of a good unit add up to; "
        "a larger effect is named beside another cause where it is likelier there than not",
        "three effects of 0.08 % each: 0.14 %",
        least=0.0,
    )
    extrapolates: float = threshold(
        10.0,
        "ratio",
        "times by which an effect may be larger on held-out data than on fitted data to be trusted; "
        "times by which a zero's shift may exceed a drift and be of it",
        "an order of magnitude",
        least=1.0,
    )
    validated: float = threshold(
        0.5,
        "standard errors",
        "gain on recordings left out in turn that an effect must have",
        "two to one, one-sided",
        least=-math.inf,
    )
    foreseen: float = threshold(
        0.25,
        "share of squared error",
        "share of the baseline's squared error, over recordings left out in turn, that an extension must remove",
        "a law of the usual departure",
        least=0.0,
    )
    alike: float = threshold(
        3.0,
        "times imperfection",
        "difference of two models below which they read the same, and the simpler is taken",
        "judgement",
    )
    law_departure: float = threshold(
        0.4,
        "share of an effect's size",
        "departure from an equation beyond which it is not its law",
        "effects depart by 5 to 40 %",
    )
    equivalent_odds: float = threshold(
        0.3, "odds", "odds above which another law, or a kind, cannot be ruled out", "about 1 in 4"
    )
    kind_odds: tuple[float, ...] = threshold(
        (2.77, -1.12, -0.99, -2.22),
        "log odds",
        "a kind's log odds: intercept; per log of what no equation explains over its size; "
        "per standard deviation of its departure; for its likeness to another effect that is there",
        "logistic regression on the effects in 661 simulated cases of two worlds",
        least=-math.inf,
    )
    least_confidence: float = threshold(
        0.75, "probability", "confidence from which on a kind is sure", "three to one for being right"
    )
    still_per_s: float = threshold(
        0.004, "full scales a second", "change of the load below which it is held", "3 N/s on 800 N"
    )
    memory_s: tuple[float, ...] = threshold(
        (0.3, 3.0, 30.0),
        "s",
        "time constants by which a law may depart; slower or faster arms of the wall are an effect",
        "one a decade of the protocols",
    )
    held_out_every: int = threshold(
        3,
        "load cycles",
        "one in so many judges and fits nothing, where no recording is held out",
        "two thirds to fit",
        least=2,
    )
    # What an experiment can show at all.
    false_alarm: float = threshold(
        1e-4,
        "probability",
        "chance that one test finds a fault in a sound recording",
        "ten tests, a thousand recordings",
        most=1.0,
    )
    faulty_share: float = threshold(
        0.05,
        "share of samples",
        "share of samples beyond which a fault is how the logger works",
        "5 %, as convention has it",
        most=1.0,
    )
    least_samples: int = threshold(
        100, "samples", "fewest samples that tell anything", "quantiles of 5 % rest on five samples"
    )
    follows: float = threshold(
        0.3,
        "share of variance",
        "share of the reading's variance that the load must explain",
        "measured sensors: 0.33 and more",
        most=1.0,
    )
    clear: float = threshold(2.0, "ratio", "ratio from which on two sizes differ for certain", "judgement", least=1.0)
    same: float = threshold(
        0.25, "share", "difference up to which two rates, peaks or gains are alike", "judgement", most=0.9
    )
    standing: float = threshold(
        0.02,
        "share of the span",
        "movement up to which a load, or a reading that is lost, stands still",
        "judgement",
        least=1e-4,  # a static curve has a bin for each such share
        most=0.5,
    )
    echo_s: float = threshold(
        0.1, "s", "time within which a reading answers a corner of its load", "slowest sensor known"
    )
    local: int = threshold(64, "samples", "samples over which a local scale is taken", "a median to 15 %", least=4)
    bins: int = threshold(4000, "bins", "bins to which long recordings are thinned to look for lags", "speed", least=10)
    hold_s: float = threshold(3.0, "s", "shortest hold that shows creep", "the paper's holds of 5 s")
    idle_s: float = threshold(60.0, "s", "shortest rest that shows ageing and recovery", "judgement")

    def lasting(self, longest_s: float) -> Thresholds:
        """The numbers for recordings of up to ``longest_s``: ``memory_s`` goes on for each decade beyond the usual."""
        decades = int(math.log10(stretch_by(longest_s)))
        longer = tuple(self.memory_s[-1] * 10.0**k for k in range(1, decades + 1))
        return replace(self, memory_s=(*self.memory_s, *longer)) if longer else self

    def __post_init__(self) -> None:
        """Refuse numbers by which nothing can be decided."""
        for one in fields(self):
            given, several = getattr(self, one.name), isinstance(one.default, tuple)
            for value in given if several and isinstance(given, tuple) else (given,):
                if not _is_within(value, one):
                    raise UsageError(f"{one.name} is {value!r}: give a {_asked(one)} ({one.metadata['unit']})")
        if not isinstance(self.kind_odds, tuple) or len(self.kind_odds) != 4:
            raise UsageError(f"kind_odds is {self.kind_odds!r}: give a tuple of four numbers (log odds)")
        rises = isinstance(self.memory_s, tuple) and all(a < b for a, b in pairwise(self.memory_s))
        if not (self.memory_s and rises):
            raise UsageError(
                f"memory_s is {self.memory_s!r}: give a tuple of numbers that rise, such as (0.3, 3.0, 30.0)"
            )

    @property
    def few(self) -> int:
        """How many samples or runs are more than chance: a ``faulty_share`` of ``least_samples``."""
        return max(round(self.faulty_share * self.least_samples), 1)

    @property
    def sensor_lag_s(self) -> float:
        """The longest lag that may be the sensor's own, in s; a longer one is of two clocks."""
        return self.clear * self.echo_s

    @property
    def settled_s(self) -> float:
        """Time in s after which the lag of any sensor is over, and a reading has come to its zero."""
        return self.clear * self.sensor_lag_s

    @property
    def lasting_s(self) -> float:
        """Time in s from which on a change is a drift: clearly longer than the shortest hold that shows creep."""
        return self.clear * self.hold_s

    @property
    def cycle(self) -> float:
        """Share of the span by which a load must rise and fall to make a cycle: well beyond standing still."""
        return self.clear**2 * self.standing


def _is_within(value: object, one: Field[Any]) -> bool:
    """Whether ``value`` is a finite number of the field's kind, within its bounds."""
    if isinstance(value, bool) or not isinstance(value, Integral if isinstance(one.default, int) else Real):
        return False
    least, number = one.metadata["least"], float(value)
    return (
        math.isfinite(number)
        and number <= one.metadata["most"]
        and (number > 0.0 if least is None else number >= least)
    )


def _asked(one: Field[Any]) -> str:
    """The numbers that a field takes, in words."""
    least, most = one.metadata["least"], one.metadata["most"]
    kind = "whole number" if isinstance(one.default, int) else "number"
    if least == -math.inf:
        return kind
    lowest = "above 0" if least is None else f"of at least {least:g}"
    return f"{kind} {lowest}" + (f" and at most {most:g}" if math.isfinite(most) else "")


def decided_by(given: Thresholds | None, material: float | None = None) -> Thresholds:
    """``given`` or the usual thresholds, with ``material`` where it is given; raises `UsageError` for anything else.

    A smaller ``material`` than usual is asked for units that are better than usual: their imperfections, and what these
    add up to, are then smaller by the same factor. A larger one is asked for usual units, of which only large effects
    matter.
    """
    if given is not None and not isinstance(given, Thresholds):
        raise UsageError(f"thresholds is of type {type(given).__name__}: give Thresholds, or none for the usual ones")
    decided = Thresholds() if given is None else given
    if material is None:
        return decided
    asked = replace(decided, material=material)
    finer = min(material / decided.material, 1.0)
    return replace(asked, imperfection=finer * asked.imperfection, tolerable=finer * asked.tolerable)


def described(given: Thresholds) -> list[dict[str, Any]]:
    """Name, value, unit, meaning and origin of each threshold; where it is not the usual one, the usual one as well."""
    return [_described(one, getattr(given, one.name)) for one in fields(given)]


def _described(one: Field[Any], value: Any) -> dict[str, Any]:
    said, usual = one.metadata, one.default
    origin = said["origin"] if value == usual else f"as asked for; usual is {usual} ({said['origin']})"
    return {"name": one.name, "value": value, "unit": said["unit"], "meaning": said["meaning"], "origin": origin}


def largest_of_noise(count: int, thresholds: Thresholds, freedom: float = math.inf) -> float:
    """How many standard deviations the largest size among ``count`` normal deviates exceeds by a false alarm only.

    ``freedom``: degrees of freedom of the standard deviation, where that is estimated (Student's t).
    """
    from scipy.special import ndtri, stdtrit

    tail = 0.5 * thresholds.false_alarm / count
    return -float(ndtri(tail) if math.isinf(freedom) else stdtrit(freedom, tail))
