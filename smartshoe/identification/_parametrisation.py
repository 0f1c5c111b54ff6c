"""The parameters of the fit: three free coefficients, or springs and damper of the solid (grey box).

In either case the error is written in (ln alpha, p1, p2): the pole, the high-frequency gain and the static gain of the
response in the fitted direction, which are far less correlated than the coefficients of Chinimilli 2016 (13).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.identification._experiment import Direction
from smartshoe.models import X_OVER_NRT

Structure = Literal["free", "grey_box"]
GREY_NAMES = ("k1", "k2", "c", "x_over_nrt")
GREY_FIXED = {"c": 1.0, "x_over_nrt": X_OVER_NRT}  # as in the paper
SAME = np.eye(3)
LEAST = 1e-9  # lower bound of k2 and c, which must stay positive


@dataclass(frozen=True, eq=False)
class Shape:
    """``values`` (alpha, p1, p2), and the derivative (3, k) of (ln alpha, p1, p2) over the free parameters."""

    alpha: float
    p1: float
    p2: float
    slope: Array


@dataclass(frozen=True)
class FreeForm:
    """The free structure, theta = (ln alpha, p1, p2)."""

    direction: Direction
    names: tuple[str, ...] = ("ln_alpha", "p1", "p2")

    @property
    def size(self) -> int:
        """The number of parameters: three."""
        return 3

    def bounds(self) -> tuple[Array, Array]:
        """Bounds (3,) that only keep the exponential finite."""
        return np.array([-30.0, -np.inf, -np.inf]), np.array([30.0, np.inf, np.inf])

    def shape(self, theta: Array) -> Shape:
        """The response (alpha, p1, p2) at ``theta``, with its derivative."""
        return Shape(float(np.exp(theta[0])), float(theta[1]), float(theta[2]), SAME)

    def coefficients(self, theta: Array) -> tuple[Array, Array]:
        """(a1, b0, b1) of Chinimilli 2016 (13), and their derivative (3, 3)."""
        return coefficients_of(self.shape(theta), self.direction)

    def from_coefficients(self, a1: float, b0: float, b1: float) -> Array:
        """theta for given a1, b0, b1."""
        if self.direction == "inverse":
            return np.array([np.log(a1), b0, b1 / a1])
        return np.array([np.log(abs(b1 / b0)), 1 / b0, a1 / b1])


@dataclass(frozen=True)
class GreyBox:
    """The grey box; theta holds those of k1, k2, c and X = x0^2/(nRT) that are not ``fixed``.

    ``scale`` is N per reading unit of force.
    """

    direction: Direction
    scale: float
    fixed: Mapping[str, float]
    limits: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        for name in (*self.fixed, *self.limits):
            if name not in GREY_NAMES:
                raise UsageError(f"{name!r} is no parameter of the grey box: use {', '.join(GREY_NAMES)}")
        for name, value in self.fixed.items():
            if not np.isfinite(value) or (name != "k1" and value <= 0):
                raise UsageError(f"{name} is fixed at {value:g}: give a finite number above 0")
        for name, (low, high) in self.limits.items():
            if not low < high:
                raise UsageError(f"{name} is bounded by {low:g} and {high:g}: give a lower and a higher number")
        if len(self.names) == 4:
            raise UsageError("k1, k2, c and x_over_nrt are four for three coefficients: fix one of them")
        if not self.names:
            raise UsageError("k1, k2, c and x_over_nrt are all fixed: leave one free")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters, in the order of theta."""
        return tuple(name for name in GREY_NAMES if name not in self.fixed)

    @property
    def size(self) -> int:
        """The number of free parameters."""
        return len(self.names)

    def bounds(self) -> tuple[Array, Array]:
        """The user's bounds, with k2, c and X kept positive."""
        limits = [
            (max(low, LEAST) if name != "k1" else low, high)
            for name in self.names
            for low, high in [self.limits.get(name, (-np.inf, np.inf))]
        ]
        low, high = np.array(limits, dtype=float).T
        return low, high

    def _all(self, theta: Array) -> tuple[float, float, float, float]:
        values = {**self.fixed, **dict(zip(self.names, (float(value) for value in theta), strict=False))}
        k1, k2, c, x = (values[name] for name in GREY_NAMES)
        return k1, k2, c, x

    def coefficients(self, theta: Array) -> tuple[Array, Array]:
        """(a1, b0, b1) by Chinimilli 2016 (3), (4), (14), and their derivative (3, k) over theta."""
        k1, k2, c, x = self._all(theta)
        a1, static = k2 / c, self.scale * (1 + k1 * x)
        values = np.array([a1, self.scale * (1 + (k1 + k2) * x), a1 * static])
        s = self.scale
        slopes = {
            "k1": [0.0, s * x, a1 * s * x],
            "k2": [1 / c, s * x, static / c],
            "c": [-a1 / c, 0.0, -a1 * static / c],
            "x_over_nrt": [0.0, s * (k1 + k2), a1 * s * k1],
        }
        return values, np.array([slopes[name] for name in self.names]).T

    def solid(self, theta: Array) -> tuple[Array, Array]:
        """(k1, k2, c) and their derivative (3, k) over theta, with zero rows for fixed ones."""
        names = self.names
        slope = np.array([[1.0 if name == own else 0.0 for own in names] for name in GREY_NAMES[:3]])
        return np.array(self._all(theta)[:3]), slope.reshape(3, len(names))

    def shape(self, theta: Array) -> Shape:
        """The response (alpha, p1, p2) at ``theta``, with its derivative."""
        (a1, b0, b1), slope = self.coefficients(theta)
        static = b1 / a1
        static_slope = (slope[2] - static * slope[0]) / a1
        if self.direction == "inverse":
            return Shape(float(a1), float(b0), float(static), np.stack([slope[0] / a1, slope[1], static_slope]))
        return Shape(
            float(b1 / b0),
            float(1 / b0),
            float(1 / static),
            np.stack([slope[2] / b1 - slope[1] / b0, -slope[1] / b0**2, -static_slope / static**2]),
        )

    def from_coefficients(self, a1: float, b0: float, b1: float) -> Array:
        """theta near a1, b0, b1: exact where three parameters are free, otherwise a starting point."""
        free = self.names
        x = self.fixed.get("x_over_nrt", X_OVER_NRT)
        static = b1 / (a1 * self.scale)
        k1 = self.fixed.get("k1", (static - 1) / x)
        if "x_over_nrt" in free and abs(k1) > LEAST:
            x = max((static - 1) / k1, LEAST)
        c = self.fixed.get("c", 0.0)
        k2 = self.fixed.get("k2", a1 * c if c else (b0 / self.scale - static) / x)
        start = {"k1": k1, "k2": max(k2, LEAST), "c": c or max(k2 / a1, LEAST), "x_over_nrt": x}
        theta = np.array([start[name] for name in free])
        low, high = self.bounds()
        inside: Array = np.clip(theta, low, high)
        return inside


Parametrisation = FreeForm | GreyBox


def coefficients_of(shape: Shape, direction: Direction) -> tuple[Array, Array]:
    """(a1, b0, b1) of the response, and their derivative (3, 3) over (ln alpha, p1, p2)."""
    alpha, p1, p2 = shape.alpha, shape.p1, shape.p2
    if direction == "inverse":
        return np.array([alpha, p1, p2 * alpha]), np.array([[alpha, 0, 0], [0, 1, 0], [p2 * alpha, 0, alpha]])
    a1, b0, b1 = alpha * p2 / p1, 1 / p1, alpha / p1
    slope = np.array([[a1, -a1 / p1, alpha / p1], [0.0, -b0 / p1, 0.0], [b1, -b1 / p1, 0.0]])
    return np.array([a1, b0, b1]), slope
