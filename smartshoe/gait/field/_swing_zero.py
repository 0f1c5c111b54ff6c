"""`SwingZero`: corrects the zero of a foot's units in swing, when they bear no load."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.gait.field._swings import swings

WINDOW_S, HOP_S = 4.0, 0.5  # window, two strides of a slow walk, and the interval at which it is searched
AGREEING, WITHIN_S = 3, 10.0  # number of swings, and the time within which they must agree before the zero moves
AGREE = 0.03  # of the rise: how far the levels of these swings may differ
SLEW_PER_S = 0.001  # of full scale: 8 K in ten minutes move sealed air by a quarter of that
MOST = 0.35  # of full scale: 8 K are 16 % of what 800 N read in a 200 mbar range, 32 % in the toe's 100 mbar
LEAST_RISE = 0.15  # of full scale, all units together: no sway of a standing person makes that


class SwingZero:
    """Takes forces of one foot's units as a stream and returns them less their zero, which is updated only in swing.

    The zero moves when three swings within ten seconds agree, each a flat valley of 0.15 to 1 s between two stances. It
    moves by at most ``slew_per_s`` of full scale and stays within ``most`` of it. A lasting load (standing, a bag in
    the shoe, a foot that rests for more than a second) has no such valleys and is never taken for a zero. A load that
    is the same in every swing (tight lacing) is.

    Feed it compensated forces: raw readings still contain the silicone's relaxation in swing.
    """

    def __init__(
        self,
        units: int = 4,
        *,
        sample_rate_hz: float,
        full_scale: float = 800.0,
        slew_per_s: float = SLEW_PER_S,
        most: float = MOST,
    ) -> None:
        for name, value in (("sample_rate_hz", sample_rate_hz), ("full_scale", full_scale), ("slew_per_s", slew_per_s)):
            if not (np.isfinite(value) and value > 0.0):
                raise UsageError(f"{name} is {value:g}: give a number above 0")
        if units < 1:
            raise UsageError(f"{units} units: give the units of one foot, one at least")
        self.sample_rate_hz, self.full_scale = float(sample_rate_hz), float(full_scale)
        self.slew, self.most = slew_per_s * full_scale, most * full_scale
        self._hop = max(1, round(HOP_S * sample_rate_hz))
        self._window = max(2, round(WINDOW_S * sample_rate_hz))
        self._units = units
        self.reset()

    def reset(self) -> None:
        """Start anew with a zero of 0."""
        self.zero: Array = np.zeros(self._units)
        self.swings = 0
        self._recent = np.empty((0, self._units))
        self._last = np.zeros(self._units)
        self._count = 0
        self._used = 0
        self._moved_at = 0
        self._levels: list[tuple[int, Array, float]] = []

    def push(self, forces: ArrayLike) -> Array:
        """Forces (n, units) less the zero known at each sample; how the stream is divided makes no difference.

        A value that is not finite is replaced by the last one. Raises `UsageError` for another number of units.
        """
        block = np.atleast_2d(np.asarray(forces, dtype=float))
        if block.ndim != 2 or block.shape[1] != self._units:
            raise UsageError(f"forces are of shape {block.shape}: give (samples, {self._units})")
        block = self._held(block)
        out = np.empty_like(block)
        at = 0
        while at < block.shape[0]:
            take = min(self._hop - self._count % self._hop, block.shape[0] - at)
            part = block[at : at + take]
            out[at : at + take] = part - self.zero
            self._recent = np.concatenate([self._recent, part])[-self._window :]
            self._count += take
            at += take
            if self._count % self._hop == 0:
                self._find_swings()
        return out

    def _held(self, block: Array) -> Array:
        """The block with values that are not finite replaced by the last finite one."""
        finite = np.isfinite(block)
        if not finite.all():
            whole = np.vstack([self._last, block])
            there = np.vstack([np.ones(self._units, dtype=bool), finite])
            index = np.maximum.accumulate(np.where(there, np.arange(whole.shape[0])[:, None], 0), axis=0)
            block = np.take_along_axis(whole, index, axis=0)[1:]
        if block.shape[0]:
            self._last = block[-1].copy()
        return block

    def _find_swings(self) -> None:
        """Find new swings in the recent forces and use their levels."""
        first = self._count - self._recent.shape[0]
        total = self._recent.sum(axis=1)
        for swing in swings(total, self.sample_rate_hz, LEAST_RISE * self.full_scale):
            if first + swing.start < self._used:
                continue
            self._used = first + swing.stop
            rise = float(np.quantile(total, 0.98) - np.quantile(total, 0.02))
            self._levels.append((self._used, self._recent[swing.middle].mean(axis=0), rise))
            self._update_zero()

    def _update_zero(self) -> None:
        """Move the zero towards the level of the last swings if they agree."""
        oldest = self._used - round(WITHIN_S * self.sample_rate_hz)
        self._levels = [level for level in self._levels if level[0] >= oldest][-AGREEING:]
        if len(self._levels) < AGREEING:
            return
        seen = np.array([level for _, level, _ in self._levels])
        rise = min(level[2] for level in self._levels)
        if float(np.ptp(seen, axis=0).max()) > AGREE * rise:
            return
        self.swings += 1
        # A pause counts as ten seconds at most: a drift during it is corrected gradually from here on.
        passed = min(self._used - self._moved_at, self._used - oldest)
        most = self.slew * passed / self.sample_rate_hz
        step = np.clip(np.median(seen, axis=0) - self.zero, -most, most)
        self.zero = np.clip(self.zero + step, -self.most, self.most)
        self._moved_at = self._used
