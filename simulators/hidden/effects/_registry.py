"""Describes a hideable effect: family, stage, amount, the options or law that produce it, its random parameters.

Each family's file in this package lists its effects; `simulators.hidden.effects` collects them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simulators.hidden.effects._law import Law
from simulators.instruments.presets import effective_area_m2
from simulators.plant.bladder_parameters import X_OVER_NRT

SHARE_OF_RANGE = 0.7  # of the sensor's range at full-scale load; leaves room for effects that raise the reading

Options = dict[str, Any]
Draws = dict[str, float]
Drawing = Callable[[np.random.Generator, "Subject"], Draws]


def merged(*options: Options) -> Options:
    """Nested tables merged into one; later ones take precedence."""
    whole: Options = {}
    for option in options:
        for key, value in option.items():
            both = isinstance(value, dict) and isinstance(whole.get(key), dict)
            whole[key] = merged(whole[key], value) if both else value
    return whole


@dataclass(frozen=True)
class Subject:
    """The unit that receives effects: its plain options, and its sensor's range."""

    name: str
    k1: float
    k2: float
    c: float
    range_mbar: float
    duration_s: float = 100.0

    @property
    def full_scale_mbar(self) -> float:
        """Reading in mbar at full-scale load."""
        return SHARE_OF_RANGE * self.range_mbar

    @property
    def effective_area_m2(self) -> float:
        """The effective area in m² that gives this reading at full-scale load."""
        return effective_area_m2(self.k1, SHARE_OF_RANGE / 0.85 * self.range_mbar * 100.0)

    @property
    def time_constant_s(self) -> float:
        """Time constant in s of the pressure's own relaxation under a held load (eq. 2-4 of Chinimilli 2016)."""
        K1, K2 = self.k1 * X_OVER_NRT, self.k2 * X_OVER_NRT
        return self.c / self.k2 * (1.0 + K1 + K2) / (1.0 + K1)

    def options(self) -> Options:
        """Machine options of the plain unit, without noise; converter and load channel have room for its effects."""
        return {
            "unit": self.name,
            "bladder": {"k1": self.k1, "k2": self.k2, "c": self.c, "effective_area_m2": self.effective_area_m2},
            "sensor": {
                "range_mbar": self.range_mbar,
                "noise_percent": 0.0,
                "over_range_percent": 12.5,
                "lag_s": 1e-4,
                "bidirectional": True,
            },
            "daq": {"bits": 14, "load_zero_v": 1.0, "load_full_scale_n": 1250.0},
        }


@dataclass(frozen=True)
class Hideable:
    """One effect that can be hidden.

    ``options(amount, draws, subject)`` are the machine options that switch its first law on, with ``amount`` from 0
    (nothing) to ``largest`` in ``unit``; ``draw`` draws its further parameters. ``catalogue`` gives the parameters of
    the catalogue's equation that correspond to the first law, as far as the two are comparable (named as there with the
    unit appended; no unit: a share); its last argument is the sampling rate. ``law`` and ``says`` name the first law,
    ``laws`` are the others. ``bends`` is what a departure of the first law warps: the load that the unit feels or the
    pressure that the sensor feels; None where there is nothing to warp. ``needs_zero``: only a baseline without a
    constant reveals it.
    """

    name: str
    family: str
    stage: str
    parameter: str
    unit: str
    typical: float
    largest: float
    options: Callable[[float, Draws, Subject], Options]
    draw: Drawing = lambda rng, subject: {}
    inside: bool = True
    needs_zero: bool = False
    law: str = "plain"
    says: str = ""
    source: str = ""
    bends: str | None = None
    catalogue: Callable[[float, Draws, Subject, float], Mapping[str, float]] = lambda a, d, s, hz: {}
    laws: tuple[Law, ...] = field(default=())

    def named(self, law: str) -> Law | None:
        """The law of this name; None for the first one, which the machine's options produce."""
        if law == self.law:
            return None
        return next(other for other in self.laws if other.name == law)

    @property
    def law_names(self) -> tuple[str, ...]:
        """The names of all laws, the first one first."""
        return (self.law, *(other.name for other in self.laws))


def uniform(**bounds: tuple[float, float]) -> Drawing:
    """Draws parameters uniformly within bounds."""
    return lambda rng, subject: {name: float(rng.uniform(*b)) for name, b in bounds.items()}


def log_uniform(**bounds: tuple[float, float]) -> Drawing:
    """Draws parameters uniformly in the logarithm, within bounds."""
    return lambda rng, subject: {
        name: float(np.exp(rng.uniform(np.log(b[0]), np.log(b[1])))) for name, b in bounds.items()
    }


def both(*drawings: Drawing) -> Drawing:
    """Draws the parameters of all ``drawings`` in turn."""
    return lambda rng, subject: {key: value for draw in drawings for key, value in draw(rng, subject).items()}


def signed(more: Drawing = lambda rng, subject: {}) -> Drawing:
    """Draws a sign, then the parameters of ``more``."""

    def draw(rng: np.random.Generator, subject: Subject) -> Draws:
        return {"sign": float(rng.choice([-1.0, 1.0])), **more(rng, subject)}

    return draw


def bladder(**given: Any) -> Options:
    """A machine's options that set these options of the bladder."""
    return {"bladder": given}


def sensor(**given: Any) -> Options:
    """A machine's options that set these options of the sensor."""
    return {"sensor": given}


def reading(**given: Any) -> Options:
    """A machine's options that set these options of the reading's channel in the logger."""
    return {"daq": {"reading": given}}
