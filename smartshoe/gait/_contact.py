"""Finds a foot's contacts with the ground, block by block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.errors import InputError, UsageError
from smartshoe.gait._edges import Edges, Floors, Shapes, find_edges, floors_of
from smartshoe.gait._swing import cut
from smartshoe.recording import REGIONS

LEAST_LOAD_N = 25.0  # a load that varies less contains no step
WINDOW_S, MARGIN_S = 20.0, 3.0
APART_S = 0.05


@dataclass(frozen=True, eq=False)
class Contacts:
    """A foot's m contacts in order of time, and the zero level read in the swings beside them.

    ``strike_s`` and ``toe_off_s`` (m,): from when to when the foot bears more than 2 % of body weight, as far as its
    units measure it (`smartshoe.gait._edges`); this is close to a force plate's threshold of 10 to 20 N. NaN where the
    contact began before the record or lasts beyond it. ``onset_s`` and ``release_s`` (m, r): the same, at the same
    level, for each unit in ``regions``; NaN where not seen. ``floor_time_s`` (k,) and ``floor`` (k, r): what each unit
    reads in swing, in the unit of the loads.
    """

    regions: tuple[str, ...]
    strike_s: Array
    toe_off_s: Array
    onset_s: Array
    release_s: Array
    floor_time_s: Array
    floor: Array

    def __len__(self) -> int:
        return int(self.strike_s.size)

    @classmethod
    def joined(cls, parts: Sequence[Contacts]) -> Contacts:
        """Concatenate contacts of consecutive parts of a signal."""
        names = ("strike_s", "toe_off_s", "onset_s", "release_s", "floor_time_s", "floor")
        return cls(parts[0].regions, *(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def of_region(self, name: str) -> int | None:
        """The column of a region; None if the shoe has no such unit."""
        return self.regions.index(name) if name in self.regions else None

    @property
    def foot_flat_s(self) -> Array:
        """(m,) times at which the first metatarsal unit is loaded after the heel; NaN where the heel is not first."""
        heel, fore = self.of_region("heel"), self._metatarsals()
        if heel is None or not fore:
            return np.full(len(self), np.nan)
        first = _least(self.onset_s[:, fore])
        with np.errstate(invalid="ignore"):
            return np.where(first > self.onset_s[:, heel], first, np.nan)

    @property
    def heel_off_s(self) -> Array:
        """(m,) times at which the heel's load ends while the forefoot still bears load; NaN where it does not."""
        heel, fore = self.of_region("heel"), self._metatarsals()
        if heel is None or not fore:
            return np.full(len(self), np.nan)
        last = -_least(-self.release_s[:, fore])
        with np.errstate(invalid="ignore"):
            return np.where(self.release_s[:, heel] < last, self.release_s[:, heel], np.nan)

    def _metatarsals(self) -> list[int]:
        return [index for index, name in enumerate(self.regions) if name in ("meta1", "meta4")]


def _least(values: Array) -> Array:
    """Minimum (m,) of each row of ``values`` (m, c), ignoring NaN; NaN for a row of NaN."""
    least = np.where(np.isfinite(values), values, np.inf).min(axis=1)
    return np.where(np.isfinite(least), least, np.nan)


class ContactDetector:
    """Finds the contacts of one foot from its units' loads on an even time base, in whole signals and in streams.

    Offset, drift and body weight do not matter: thresholds are shares of the foot's own loads above its own floor in
    swing. Loads are examined ``window_s`` at a time with 3 s on either side, counted from the first sample, so that
    blocks of any size give the same numbers; a contact is reported within ``window_s`` + 3 s of its end.
    ``least_load``, in the loads' unit, is the smallest variation that can be a step (0 for uncalibrated readings).
    """

    def __init__(
        self,
        sample_rate_hz: float,
        regions: Sequence[str] = REGIONS,
        *,
        start_s: float = 0.0,
        least_load: float = LEAST_LOAD_N,
        window_s: float = WINDOW_S,
    ) -> None:
        if not sample_rate_hz > 0.0 or not window_s >= MARGIN_S:
            raise UsageError(
                f"sample_rate_hz is {sample_rate_hz:g} and window_s {window_s:g}: give a rate above 0 and"
                f" {MARGIN_S:g} s or more"
            )
        self.sample_rate_hz, self.regions, self.start_s = float(sample_rate_hz), tuple(regions), float(start_s)
        self.least_load, self.window_s = float(least_load), float(window_s)
        self.reset()

    def reset(self) -> None:
        """Start anew, as if nothing had been pushed."""
        self._core = max(8, round(self.window_s * self.sample_rate_hz))
        self._margin = max(4, round(MARGIN_S * self.sample_rate_hz))
        self._waiting: list[Array] = []
        self._held = 0  # samples held
        self._first = 0  # index of the first sample held
        self._done = 0  # index up to which edges have been reported
        self._last_edge = -np.inf
        self._last_floor = -np.inf
        self._rising_next: bool | None = None
        self._open: tuple[float, Array] | None = None
        self._scale: float | None = None
        self._floor: float | None = None
        self._shapes = Shapes.usual(len(self.regions))

    @property
    def held_samples(self) -> int:
        """Number of samples that wait for later ones; bounded, however long the stream."""
        return self._held

    def apply(self, loads: ArrayLike) -> Contacts:
        """Contacts of a whole signal (n, r). The state of a stream under way in `push` is not touched."""
        fresh = ContactDetector(
            self.sample_rate_hz, self.regions, start_s=self.start_s, least_load=self.least_load, window_s=self.window_s
        )
        return Contacts.joined([fresh.push(loads), fresh.finish()])

    def push(self, loads: ArrayLike) -> Contacts:
        """Take the next loads (n, r), which must be finite, and return the contacts that end with them."""
        block = np.asarray(loads, dtype=float)
        if block.ndim != 2 or block.shape[1] != len(self.regions):
            raise InputError(f"loads have shape {block.shape}: give one column for each of {', '.join(self.regions)}")
        if not np.isfinite(block).all():
            raise InputError("loads hold numbers that are not finite: hold the last load and mask what is missing")
        self._waiting.append(block)
        self._held += block.shape[0]
        found = [self._none()]
        while self._first + self._held >= self._done + self._core + self._margin:
            found.append(self._step(self._done + self._core))
        return Contacts.joined(found)

    def finish(self) -> Contacts:
        """The contacts completed by the end of the signal; the last one has no toe off if the foot is still down."""
        found = [self._none()]
        end = self._first + self._held
        if end > self._done:
            found.append(self._step(end))
        if self._open is not None:
            found.append(self._contact(*self._open, np.nan, np.full(len(self.regions), np.nan)))
            self._open = None
        return Contacts.joined(found)

    def _none(self) -> Contacts:
        """No contacts and no floors."""
        r = len(self.regions)
        return Contacts(
            self.regions, np.zeros(0), np.zeros(0), np.zeros((0, r)), np.zeros((0, r)), np.zeros(0), np.zeros((0, r))
        )

    def _contact(self, strike_s: float, onset_s: Array, toe_off_s: float, release_s: Array) -> Contacts:
        none = self._none()
        return Contacts(
            self.regions, np.array([strike_s]), np.array([toe_off_s]), onset_s[None], release_s[None],
            none.floor_time_s, none.floor,
        )  # fmt: skip

    def _step(self, core_end: int) -> Contacts:
        """Find the contacts up to sample ``core_end`` and drop samples that are no longer needed."""
        held = self._waiting[0] if len(self._waiting) == 1 else np.concatenate(self._waiting)
        window = held[: core_end + self._margin - self._first]
        contacts = self._found_in(window, core_end)
        self._done = core_end
        keep = max(0, core_end - self._margin - self._first)
        self._waiting = [held[keep:]]
        self._held -= keep
        self._first += keep
        return contacts

    def _found_in(self, window: Array, core_end: int) -> Contacts:
        """The contacts and floors of a window whose core ends at sample ``core_end``; updates scale and floor."""
        found = cut(window.sum(axis=1), self.sample_rate_hz, self.least_load, self._scale, self._floor)
        if found is None:
            return self._none()
        floors = floors_of(window, found, self.sample_rate_hz)
        edges = find_edges(window, found, floors, self.sample_rate_hz, self._shapes)
        parts = [self._new_floors(floors, core_end)]
        parts += self._paired(edges, core_end)
        if edges.scale > 0.0:
            self._scale = edges.scale
        level = np.concatenate([floors[0].load.sum(axis=1), floors[1].load.sum(axis=1)])
        if np.isfinite(level).any():
            self._floor = float(np.nanmedian(level))
        return Contacts.joined(parts)

    def _time(self, place: Array | float) -> Array:
        return np.asarray(self.start_s + (np.asarray(place) + self._first) / self.sample_rate_hz)

    def _new_floors(self, floors: tuple[Floors, Floors], core_end: int) -> Contacts:
        """The floors before ``core_end`` that were not reported yet."""
        place = np.column_stack([floors[0].place, floors[1].place]).ravel()
        load = np.stack([floors[0].load, floors[1].load], axis=1).reshape(-1, len(self.regions))
        new = (place + self._first > self._last_floor + 1.0) & (place + self._first < core_end)
        new &= np.isfinite(load).all(axis=1)
        if new.any():
            self._last_floor = float(place[new][-1] + self._first)
        none = self._none()
        return Contacts(
            self.regions, none.strike_s, none.toe_off_s, none.onset_s, none.release_s, self._time(place[new]), load[new]
        )

    def _paired(self, edges: Edges, core_end: int) -> list[Contacts]:
        """Pair heel strikes with toe offs before ``core_end``; edges that are too close or out of turn are dropped."""
        ended: list[Contacts] = []
        place_s, unit_s = self._time(edges.place), self._time(edges.units)
        nowhere = np.full(len(self.regions), np.nan)
        for k in range(edges.coarse.size):
            at, rises = edges.coarse[k] + self._first, bool(edges.rises[k])
            if at >= core_end or at <= self._last_edge + APART_S * self.sample_rate_hz:
                continue
            if self._rising_next is not None and rises != self._rising_next:
                continue
            self._last_edge, self._rising_next = float(at), not rises
            if rises:
                self._open = (float(place_s[k]), unit_s[k])
            else:
                strike_s, onset_s = self._open if self._open is not None else (np.nan, nowhere)
                ended.append(self._contact(strike_s, onset_s, float(place_s[k]), unit_s[k]))
                self._open = None
        return ended
