"""Running sums of a trial's strides and samples, added at once or window by window."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.gait._contact import Contacts
from smartshoe.gait._strides import Stride
from smartshoe.gait.summary import asymmetry, both_down, steps_of

OF_STRIDES = ("time_s", "stance_percent", "peak_n", "impulse_n_s", "loading_rate_n_per_s")


@dataclass
class Moments:
    """Count, mean and spread of numbers that come in groups (Chan, Golub and LeVeque 1979, eq. 2.1)."""

    count: int = 0
    mean: float = 0.0
    squares: float = 0.0

    def add(self, values: ArrayLike) -> None:
        """Add more values (n,)."""
        values = np.asarray(values, dtype=float)
        if values.size == 0:
            return
        mean, count = float(values.mean()), self.count + values.size
        away = mean - self.mean
        self.squares += float(((values - mean) ** 2).sum()) + away**2 * self.count * values.size / count
        self.mean += away * values.size / count
        self.count = count

    @property
    def sd(self) -> float:
        """Sample standard deviation; 0 for fewer than two values."""
        return float(np.sqrt(self.squares / (self.count - 1))) if self.count > 1 else 0.0

    def spread(self) -> dict[str, float | None]:
        """Mean and coefficient of variation in percent, as in the summary."""
        if not self.count:
            return {"mean": None, "cv_percent": None}
        return {"mean": self.mean, "cv_percent": 100.0 * self.sd / self.mean if self.count > 1 and self.mean else None}


@dataclass
class StrideSums:
    """Sums over strides of one kind, walking or running, without gaps."""

    feet: Sequence[str]
    of: dict[str, dict[str, Moments]] = field(default_factory=dict)
    double: Moments = field(default_factory=Moments)
    flight: Moments = field(default_factory=Moments)
    orders: Counter[tuple[str, ...]] = field(default_factory=Counter)
    earlier: int = 0
    compared: int = 0

    def __post_init__(self) -> None:
        for name in (*OF_STRIDES, "step_time_s", "stance_time_s"):
            self.of[name] = {foot: Moments() for foot in self.feet}

    @property
    def count(self) -> int:
        """Number of strides of both feet."""
        return sum(own.count for own in self.of["time_s"].values())

    def add(self, contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> None:
        """Add strides, with the contacts of both feet around them."""
        if not strides:
            return
        for foot in self.feet:
            own = [stride for stride in strides if stride.foot == foot]
            for name in OF_STRIDES:
                self.of[name][foot].add([v for stride in own if (v := getattr(stride, name)) is not None])
            self.of["stance_time_s"][foot].add([0.01 * s.stance_percent * s.time_s for s in own])
        for foot, step_s in steps_of(contacts, strides).items():
            self.of["step_time_s"][foot].add(step_s)
        both = both_down(contacts, strides)
        if both is not None:
            self.double.add(np.full(len(strides), both[0]))
            self.flight.add(np.full(len(strides), both[1]))
        self._order(contacts, strides)

    def _order(self, contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> None:
        """Count the orders in which units are loaded, and how often the fourth metatarsal precedes the first."""
        for foot, own in contacts.items():
            onset_s = own.onset_s[np.isin(own.strike_s, [s.start_s for s in strides if s.foot == foot])]
            seen = np.isfinite(onset_s)
            rows = np.argsort(onset_s[seen.all(axis=1)], axis=1, kind="stable")
            self.orders.update(tuple(own.regions[index] for index in row) for row in rows)
            meta4, meta1 = own.of_region("meta4"), own.of_region("meta1")
            if meta4 is not None and meta1 is not None:
                both = onset_s[seen[:, meta4] & seen[:, meta1]]
                self.compared += len(both)
                self.earlier += int(np.count_nonzero(both[:, meta4] < both[:, meta1]))

    def summary(self) -> dict[str, Any]:
        """The summary figures by name, as in the JSON output."""

        def sided(left: float | None, right: float | None) -> float | None:
            return None if left is None or right is None else asymmetry(left, right)

        spread = {name: {foot: own.spread() for foot, own in feet.items()} for name, feet in self.of.items()}
        both = len(self.feet) == 2
        asymmetries = {
            label: sided(*(spread[name][foot]["mean"] for foot in ("left", "right"))) if both else None
            for label, name in (
                ("stance_time", "stance_time_s"), ("step_time", "step_time_s"), ("peak", "peak_n"),
                ("impulse", "impulse_n_s"), ("loading_rate", "loading_rate_n_per_s"),
            )
        }  # fmt: skip
        leading = asymmetries["impulse"] if asymmetries["impulse"] is not None else asymmetries["stance_time"]
        every_s = sum(own.mean * own.count for own in self.of["time_s"].values())
        order, most = min(self.orders.items(), key=lambda item: (-item[1], item[0]), default=((), 0))
        return {
            "cadence_steps_per_min": 120.0 * self.count / every_s if every_s else None,
            "stride_time_s": spread["time_s"],
            "stance_percent": {foot: own["mean"] for foot, own in spread["stance_percent"].items()},
            "double_support_percent": self.double.mean if self.double.count else None,
            "asymmetry_percent": None if leading is None else abs(leading),
            "order_of_contact": list(order),
            "flight_percent": self.flight.mean if self.flight.count else None,
            "step_time_s": spread["step_time_s"] if both else {},
            "peak_n": spread["peak_n"],
            "impulse_n_s": spread["impulse_n_s"],
            "loading_rate_n_per_s": spread["loading_rate_n_per_s"],
            "right_over_left_percent": asymmetries,
            "strides": {foot: own.count for foot, own in self.of["time_s"].items()},
            "order_of_contact_percent": 100.0 * most / self.orders.total() if most else None,
            "meta4_before_meta1_percent": 100.0 * self.earlier / self.compared if self.compared else None,
        }


@dataclass
class BlockMeans:
    """Mean of a stream of samples, and the spread of the means of successive blocks of ``size`` samples."""

    size: int
    total: float = 0.0
    count: int = 0
    means: Moments = field(default_factory=Moments)
    _rest: Array = field(default_factory=lambda: np.zeros(0))

    def add(self, values: Array) -> None:
        """Add more samples (n,)."""
        self.total += float(values.sum())
        self.count += values.size
        rest = np.concatenate([self._rest, values])
        whole = rest.size // self.size * self.size
        self.means.add(rest[:whole].reshape(-1, self.size).mean(axis=1))
        self._rest = rest[whole:]


def weighted_mean(parts: Iterable[tuple[float, float]]) -> float | None:
    """The weighted mean of pairs (value, weight); None if the weights sum to zero."""
    held = list(parts)
    whole = sum(weight for _, weight in held)
    return sum(value * weight for value, weight in held) / whole if whole > 0.0 else None
