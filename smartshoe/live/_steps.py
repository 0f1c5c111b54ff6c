"""`StepFollower`: a foot's events as they happen, for display; a little less exact than `smartshoe.gait`.

`smartshoe.gait` looks at seconds on both sides of an edge before it reports it; a page cannot wait. As there,
thresholds are shares of the foot's own rise above its own floor, but both are tracked sample by sample. Numbers for
publication come from ``smartshoe gait`` on the recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait.phases import FLAT, HEEL, PUSH, SWING

ON, OFF = 0.08, 0.05  # of the foot's rise: it is down above ON, and up below OFF
UNIT_ON, UNIT_OFF = 0.12, 0.06  # of the unit's own rise: the same for a unit
LEAST_UNIT = 0.03  # of the foot's rise: the drift of an almost unloaded unit that is ignored
FOLLOW_S = 0.5  # time constant with which the floor follows the unloaded readings
FORGET_S = 60.0  # time constant with which the highest load is forgotten
APART_S = 0.05


@dataclass(frozen=True, slots=True)
class GaitStep:
    """An ``event`` (heel_strike, foot_flat, heel_off, toe_off) of a foot at ``time_s``."""

    time_s: float
    event: str


class StepFollower:
    """One foot's phase and events from its units' loads, sample by sample.

    ``regions`` (r) are the places of the units; ``least`` is the smallest variation of the foot's load that counts as a
    step, in the unit of the loads.
    """

    def __init__(self, regions: Sequence[str], least: float) -> None:
        self.least = least
        self._heel = [k for k, region in enumerate(regions) if region == "heel"]
        self._fore = [k for k, region in enumerate(regions) if region != "heel"]
        self._floor: list[float] | None = None  # of each unit, and of their sum
        self._top: list[float] = []
        self._bears = [False] * len(regions)
        self._is_down = False
        self._changed_s = self._last_s = -np.inf
        self._was_flat = self._is_off = False

    @property
    def phase(self) -> int | None:
        """The phase as an index into `smartshoe.gait.phases.PHASES`; None before the foot has borne a load."""
        if self._floor is None or self._top[-1] - self._floor[-1] < self.least:
            return None
        if not self._is_down:
            return SWING
        heel, fore = any(self._bears[k] for k in self._heel), any(self._bears[k] for k in self._fore)
        if heel and not fore:
            return HEEL
        return PUSH if fore and self._heel and not heel else FLAT

    def push(self, time_s: Array, loads: Array) -> list[GaitStep]:
        """The events in the next ``loads`` (n, r), finite, at ``time_s`` (n,)."""
        found: list[GaitStep] = []
        table = np.column_stack([loads, loads.sum(axis=1)]).tolist()
        for at, values in zip(time_s.tolist(), table, strict=True):
            self._follow(at, values)
            found += self._judged(at, values)
        return found

    def _follow(self, at: float, values: list[float]) -> None:
        """Update the floor and the highest load of each unit, and of their sum."""
        if self._floor is None:
            self._floor, self._top = list(values), list(values)
        passed_s = min(max(at - self._last_s, 0.0), FOLLOW_S)
        self._last_s = at
        for k, value in enumerate(values):
            floor = self._floor[k]
            if value < floor:
                self._floor[k] = value
            elif not self._is_down:
                self._floor[k] = floor + (value - floor) * passed_s / FOLLOW_S
            top = self._top[k]
            self._top[k] = value if value > top else top - (top - self._floor[k]) * passed_s / FORGET_S

    def _judged(self, at: float, values: list[float]) -> list[GaitStep]:
        """Update which units bear load and whether the foot is down; returns the events at this sample."""
        assert self._floor is not None
        rise = self._top[-1] - self._floor[-1]
        share = (values[-1] - self._floor[-1]) / rise if rise >= max(self.least, 1e-9) else 0.0
        for k in range(len(self._bears)):
            own = max(self._top[k] - self._floor[k], LEAST_UNIT * rise, 1e-9)
            level = UNIT_OFF if self._bears[k] else UNIT_ON
            self._bears[k] = (values[k] - self._floor[k]) / own > level
        if at - self._changed_s >= APART_S and (share < OFF if self._is_down else share > ON):
            self._is_down, self._changed_s = not self._is_down, at
            self._was_flat = self._is_off = False
            return [GaitStep(at, "heel_strike" if self._is_down else "toe_off")]
        return self._within(at) if self._is_down else []

    def _within(self, at: float) -> list[GaitStep]:
        """The events of a foot that stays down: foot flat and heel off, each once a stance."""
        if not self._heel:
            return []
        phase = self.phase
        if phase == FLAT and not self._was_flat:
            self._was_flat = True
            return [GaitStep(at, "foot_flat")]
        if phase == PUSH and self._was_flat and not self._is_off:
            self._is_off = True
            return [GaitStep(at, "heel_off")]
        return []
