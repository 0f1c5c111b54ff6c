"""Standing: half of body weight on each foot, sway, and rising on tiptoe with the push that this takes.

Shares of flat standing after Cavanagh et al. 1987 (heel 60.5 %, midfoot 7.8 %, forefoot 28.1 %, toes 3.6 %), with the
forefoot on its two coils. The total is body weight plus mass times the acceleration of the body, which rises and falls
only on tiptoe: over a rise its mean is body weight.

*Left out:* breathing and heart beat (below 1 % of body weight), steps taken to keep balance, handrails.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulators.people._stances import smooth_step
from simulators.people.person import Person
from simulators.people.shape import COLUMNS
from smartshoe.arrays import Array
from smartshoe.recording import REGIONS

FLAT = {"heel": 0.60, "meta4": 0.16, "meta1": 0.16, "toe": 0.08}
RAISED = {"heel": 0.0, "meta4": 0.34, "meta1": 0.41, "toe": 0.25}
HEEL_RISE_M = 0.06
GRAVITY_M_PER_S2 = 9.81
SWAY_BAND_HZ = (0.05, 1.2)
WAVES = 24
SIDEWAYS = 0.5  # sway between left and right, relative to that between heel and forefoot


@dataclass(frozen=True, eq=False)
class Sway:
    """Slow coloured noise of unit variance: waves of random phase with a spectrum that falls with frequency."""

    frequency_hz: Array
    phase: Array

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Sway:
        """A sway with random phases."""
        low, high = SWAY_BAND_HZ
        return cls(low * (high / low) ** rng.random(WAVES), rng.uniform(0.0, 2.0 * np.pi, WAVES))

    def at(self, time_s: Array) -> Array:
        """The noise (n,) at the times (n,)."""
        weight = self.frequency_hz**-0.5
        weight = weight / np.sqrt(0.5 * np.sum(weight**2))
        made = np.zeros(time_s.shape)
        for frequency_hz, phase, amplitude in zip(self.frequency_hz, self.phase, weight, strict=True):
            made += amplitude * np.sin(2.0 * np.pi * frequency_hz * time_s + phase)
        return made


@dataclass(frozen=True, slots=True)
class Lift:
    """A stay on tiptoe: the heels rise from ``begin_s`` on and are down again at ``end_s``."""

    begin_s: float
    end_s: float
    rise_s: float
    sway_cv: float

    def height(self, time_s: Array) -> Array:
        """The height (n,) of the heels as a share: 0 flat, 1 on the toes."""
        up = smooth_step((time_s - self.begin_s) / self.rise_s)
        return np.asarray(up * (1.0 - smooth_step((time_s - self.end_s + self.rise_s) / self.rise_s)))

    def push(self, time_s: Array) -> Array:
        """The upward acceleration (n,) in m/s^2: the second derivative of `height` times the heel's rise."""

        def bend(share: Array) -> Array:
            s = np.clip(share, 0.0, 1.0)
            return s * (60.0 - 180.0 * s + 120.0 * s**2)

        up = bend((time_s - self.begin_s) / self.rise_s)
        down = bend((time_s - self.end_s + self.rise_s) / self.rise_s)
        return np.asarray((up - down) * HEEL_RISE_M / self.rise_s**2)


@dataclass(frozen=True, eq=False)
class StandingStay:
    """A period on both feet. Left and right each land within ``on_s`` (2, 2) and lift within ``off_s`` (2, 2)."""

    person: Person
    coverage: float
    sway_cv: float
    sways: tuple[Sway, Sway]
    lifts: tuple[Lift, ...]
    on_s: Array
    off_s: Array

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last time in s at which anything is loaded."""
        return float(self.on_s.min()), float(self.off_s.max())

    def loads_n(self, time_s: Array) -> Array:
        """Loads (n, 2, 5) in N at the times (n,): left and right, columns as in `COLUMNS`."""
        loads = np.zeros((time_s.size, 2, len(COLUMNS)))
        begin_s, end_s = self.span_s
        first, last = np.searchsorted(time_s, [begin_s, end_s])
        if first == last:
            return loads
        now = time_s[first:last]
        raised, push, sway_cv = np.zeros(now.size), np.zeros(now.size), np.full(now.size, self.sway_cv)
        for lift in self.lifts:
            height = lift.height(now)
            raised += height
            push += lift.push(now)
            sway_cv += (lift.sway_cv - self.sway_cv) * height
        whole_n = self.person.body_weight_n * (1.0 + push / GRAVITY_M_PER_S2)
        fore = 1.0 + sway_cv * self.sways[0].at(now)
        side = 0.25 * self.person.load_asymmetry + 0.5 * SIDEWAYS * sway_cv * self.sways[1].at(now)
        shares = self._shares(fore, raised)
        for foot, share in enumerate((0.5 - side, 0.5 + side)):
            held = _within(now, self.on_s[foot], self.off_s[foot])
            loads[first:last, foot] = (whole_n * share * held)[:, None] * shares
        return loads

    def _shares(self, sway: Array, raised: Array) -> Array:
        """Shares (n, 5) of a foot's load: those of the coils, and the part that passes beside them."""
        heel = np.clip(FLAT["heel"] * sway, 0.0, 1.0)
        toe = np.clip(RAISED["toe"] * (2.0 - sway), 0.0, 1.0)
        made = np.empty((sway.size, len(COLUMNS)))
        for column, region in enumerate(REGIONS):
            flat = heel if region == "heel" else (1.0 - heel) * FLAT[region] / (1.0 - FLAT["heel"])
            # On tiptoe the sway is between the toe and the balls of the foot.
            up = toe if region == "toe" else (1.0 - toe) * RAISED[region] / (1.0 - RAISED["toe"])
            made[:, column] = self.coverage * (flat * (1.0 - raised) + up * raised)
        made[:, -1] = 1.0 - self.coverage
        return made


def _within(time_s: Array, on_s: Array, off_s: Array) -> Array:
    """The share (n,) of its load that a foot carries: it lands within ``on_s`` and lifts within ``off_s``."""

    def ramp(span: Array) -> Array:
        if span[1] <= span[0]:
            return np.asarray(time_s >= span[0], dtype=float)
        return smooth_step((time_s - span[0]) / (span[1] - span[0]))

    return np.asarray(ramp(on_s) * (1.0 - ramp(off_s)))
