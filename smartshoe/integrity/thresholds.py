"""Every number that integrity and diagnosis decide by, in one record: unit, meaning and origin beside each."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import Any

from smartshoe.errors import UsageError


def threshold(value: Any, unit: str, meaning: str, origin: str) -> Any:
    """A field of `Thresholds` with its documentation."""
    return field(default=value, metadata={"unit": unit, "meaning": meaning, "origin": origin})


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What a diagnosis decides by. Carried in the result and printed in the page; `described` lists it.

    Raises `UsageError` for what is no number, and for a ``material`` that is not above 0.
    """

    material: float = threshold(
        2e-4, "share of full scale", "what moves the reading by less counts for nothing", "contract, section 4"
    )
    departure: float = threshold(
        0.25,
        "share of an effect's size",
        "standard deviation by which a real law departs from an equation of its kind",
        "second laboratory and own truths: 0.05 to 0.4",
    )
    strength_sd: float = threshold(
        0.03,
        "share of full scale",
        "prior standard deviation of an effect that is there, and of a gain of a recording's own",
        "effects.md: 0.1 to 10 %",
    )
    false_name: float = threshold(0.02, "probability", "of an effect where there is none", "issue: floor of 2 %")
    unknown_past: float = threshold(
        0.05, "share of full scale", "load that an arm may remember at the start of a recording", "judgement"
    )
    foreign_zero: float = threshold(
        0.3,
        "share of full scale",
        "a reading at no load beyond it is a convention of the sensor's, no offset",
        "judgement",
    )
    zero_sd: float = threshold(
        4e-4, "share of full scale", "how well a recording's rest is known to be zero", "load cells: 0.02 % of rating"
    )
    linear: float = threshold(
        0.01, "share of full scale", "an effect up to which one linearisation serves for all", "squares: 1e-4"
    )
    tolerable: float = threshold(
        1.5e-3,
        "share of full scale",
        "structure that small imperfections of a good unit add up to; a larger effect is named beside another cause"
        " where it is likelier there than not",
        "three effects of 0.08 % each: 0.14 %",
    )
    extrapolates: float = threshold(
        10.0,
        "ratio",
        "of an effect in what is held out to that in what is fitted, beyond which it is no knowledge; of a zero's shift"
        " to a drift beside it, within which one may be of the other",
        "an order of magnitude",
    )
    validated: float = threshold(
        0.5, "standard errors", "by which an effect must better what is left out", "two to one, one-sided"
    )
    foreseen: float = threshold(
        0.25,
        "share of squared error",
        "of the baseline's, where recordings are left out in turn, that an extension must do away with",
        "a law of the usual departure",
    )
    alike: float = threshold(
        3.0, "times material", "two models whose readings differ by less are one, and the simpler is taken", "judgement"
    )
    law_departure: float = threshold(
        0.4, "share of an effect's size", "a departure from which on the law is unsure", "effects.md: 5 to 40 %"
    )
    equivalent_odds: float = threshold(
        0.3,
        "odds",
        "of another law, or of the one kind that is named, from which on it cannot be ruled out",
        "about 1 in 4",
    )
    kind_odds: tuple[float, ...] = threshold(
        (2.77, -1.12, -0.99, -1.09, -2.22),
        "log odds",
        "of a kind: intercept; per log of what no equation follows over its size; per standard deviation of its"
        " departure; where no law of it follows; for its likeness to another effect that is there",
        "logistic regression on the effects that were fitted to 661 cases of two worlds",
    )
    least_confidence: float = threshold(
        0.75,
        "probability",
        "of the kind; below it a cause is named for its size alone; of a zero that is never seen",
        "three to one for being right",
    )
    named_odds: float = threshold(
        0.5,
        "log odds",
        "by which a kind beyond least_confidence is likelier for being named: what else speaks against it has not",
        "1,489 names of two worlds",
    )
    still_per_s: float = threshold(0.004, "full scales a second", "slower is a hold", "3 N/s on 800 N")
    memory_s: tuple[float, ...] = threshold(
        (0.3, 3.0, 30.0),
        "s",
        "time constants by which a law may follow otherwise; an arm beyond them follows an effect",
        "one a decade of the protocols",
    )
    held_out_every: int = threshold(
        3, "load cycles", "of which one judges and fits nothing, where no recording is held out", "two thirds to fit"
    )
    # What an experiment can show at all.
    false_alarm: float = threshold(
        1e-4,
        "probability",
        "that one test finds a fault in a sound recording",
        "ten tests, a thousand recordings",
    )
    faulty_share: float = threshold(
        0.05, "share of samples", "more of them are how a logger works and no fault", "5 %, as convention has it"
    )
    least_samples: int = threshold(100, "samples", "fewer tell nothing", "quantiles of 5 % rest on five samples")
    follows: float = threshold(
        0.3, "share of variance", "of a reading that its load must explain", "measured sensors: 0.33 and more"
    )
    clear: float = threshold(2.0, "ratio", "between two sizes that differ for certain", "judgement")
    same: float = threshold(0.25, "share", "by which two rates, peaks or gains of one kind may differ", "judgement")
    standing: float = threshold(
        0.02, "share of the span", "within which a load, or a reading that is lost, stands still", "judgement"
    )
    echo_s: float = threshold(0.1, "s", "within which a reading answers a corner of its load", "slowest sensor known")
    local: int = threshold(64, "samples", "over which a local scale is taken", "a median to 15 %")
    bins: int = threshold(4000, "bins", "to which long recordings are thinned where lags are looked for", "speed")
    hold_s: float = threshold(3.0, "s", "shortest hold that shows creep", "the paper's holds of 5 s")
    idle_s: float = threshold(60.0, "s", "shortest rest that shows ageing and recovery", "judgement")

    def __post_init__(self) -> None:
        """Refuse what nothing can be decided by."""
        for one in fields(self):
            given = getattr(self, one.name)
            for value in given if isinstance(given, tuple) else (given,):
                if isinstance(value, bool) or not isinstance(value, Real) or math.isnan(value):
                    raise UsageError(f"{one.name} is {value!r}: give a number ({one.metadata['unit']})")
        if not 0.0 < self.material < math.inf:
            raise UsageError(f"material is {self.material:g}: give a share of full scale above 0, such as 0.0002")

    @property
    def few(self) -> int:
        """How many samples or runs are no chance: a ``faulty_share`` of the fewest samples."""
        return max(round(self.faulty_share * self.least_samples), 1)

    @property
    def sensor_lag_s(self) -> float:
        """A shorter lag may be the sensor's own, a longer one is of two clocks: clear of any echo."""
        return self.clear * self.echo_s

    @property
    def settled_s(self) -> float:
        """When any sensor's lag is over: a reading has come to its zero."""
        return self.clear * self.sensor_lag_s

    @property
    def lasting_s(self) -> float:
        """What lasts as long is no matter of moments, but a drift: clear of the shortest hold that shows creep."""
        return self.clear * self.hold_s

    @property
    def cycle(self) -> float:
        """Share by which a load rises and falls in a cycle: clear of what is clear of standing still."""
        return self.clear**2 * self.standing


def decided_by(given: Thresholds | None, material: float | None = None) -> Thresholds:
    """``given`` or the usual, with ``material`` where there is one; `UsageError` for what are no thresholds."""
    if given is not None and not isinstance(given, Thresholds):
        raise UsageError(f"thresholds is of type {type(given).__name__}: give Thresholds, or none for the usual ones")
    decided = Thresholds() if given is None else given
    return decided if material is None else replace(decided, material=material)


def described(given: Thresholds) -> list[dict[str, Any]]:
    """Name, value, unit, meaning and origin of each."""
    return [{"name": f.name, "value": getattr(given, f.name), **f.metadata} for f in fields(given)]


def largest_of_noise(count: int, thresholds: Thresholds) -> float:
    """What the largest of ``count`` normal deviates exceeds, in standard deviations, by a false alarm only."""
    from scipy.special import ndtri

    return -float(ndtri(0.5 * thresholds.false_alarm / count))
