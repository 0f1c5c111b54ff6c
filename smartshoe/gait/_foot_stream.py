"""One foot of a long trial: takes readings in pieces, gives loads and contacts, and keeps them only while needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.gait._contact import LEAST_LOAD_N, ContactDetector, Contacts
from smartshoe.gait._estimate import BEYOND, UnitLoad, on_the_rail
from smartshoe.gait._trial import Foot
from smartshoe.recording import Channel

BACK_S, AHEAD_S = 8.0, 8.0  # on either side of a window: two of the longest strides
HORIZON_S = 600.0  # longest time for which a load waits for the next swing to give its zero


class Detector(ContactDetector):
    """A contact detector that also says up to when it has reported all contacts."""

    @property
    def known_s(self) -> float:
        """Time in s before which every contact that ended has been reported."""
        return self.start_s + self._done / self.sample_rate_hz

    @property
    def under_way(self) -> Contacts:
        """The contact that has begun and not ended, with NaN as its toe off; empty if there is none."""
        if self._open is None:
            return self._none()
        return self._contact(*self._open, np.nan, np.full(len(self.regions), np.nan))


class FootStream:
    """One run of recording of one foot.

    ``model`` is the foot as found at the start of the record, ``channels`` are its units' channels there (for their
    unit and range). Readings without a calibration are loads in a unit of their own. A load may become known some time
    after its reading, since an estimator may wait for later readings.
    """

    def __init__(self, model: Foot, channels: tuple[Channel, ...], start_s: float) -> None:
        self.model, self._channels = model, channels
        self.start_s, self.rate_hz = start_s, model.rate_hz
        self.detector = Detector(
            model.rate_hz, model.regions, start_s=start_s, least_load=LEAST_LOAD_N if model.is_force else 0.0
        )
        self._turn = -1.0 if model.turned else 1.0
        self._runs = [unit.begin() for unit in model.units]
        self._waiting = [np.zeros(0)] * len(model.units)  # loads of each unit that are not yet known for every unit
        width = len(model.units)
        self._first = 0  # index of the first sample held
        self._readings, self._load = np.zeros((0, width)), np.zeros((0, width))
        self._missing = np.zeros((0, width), dtype=bool)
        self._contacts = self.detector._none()
        self._top = np.full(width, -np.inf)  # the largest readings so far
        self._is_over = False

    def push(self, readings: Array, missing: Mask) -> Contacts:
        """Take the next readings (n, r), in the channels' units; return the contacts that end with them."""
        new = [
            run.push(np.ascontiguousarray(column), gone)[0]
            for run, column, gone in zip(self._runs, readings.T, missing.T, strict=True)
        ]
        self._readings, self._missing = np.vstack([self._readings, readings]), np.vstack([self._missing, missing])
        return self._joined(self.detector.push(self._known(new)))

    def _known(self, new: Sequence[Array]) -> Array:
        """The loads (n, r) that are now known for every unit, after the ``new`` ones of each."""
        loads = [np.concatenate(pair) for pair in zip(self._waiting, new, strict=True)]
        count = min(load.size for load in loads)
        self._waiting = [load[count:] for load in loads]
        known = self._turn * np.column_stack([load[:count] for load in loads])
        rows = slice(len(self._load), len(self._load) + count)
        readings = np.where(self._missing[rows], -np.inf, self._readings[rows])
        self._top = np.maximum(self._top, readings.max(axis=0, initial=-np.inf))
        self._load = np.vstack([self._load, known])
        return known

    def finish(self) -> Contacts:
        """Return the contacts that are completed by the end of the run."""
        self._is_over = True
        last = self.detector.push(self._known([run.finish()[0] for run in self._runs]))
        return self._joined(Contacts.joined([last, self.detector.finish()]))

    def _joined(self, new: Contacts) -> Contacts:
        self._contacts = Contacts.joined([self._contacts, new])
        return new

    @property
    def end_s(self) -> float:
        """Time in s of the sample after the last one held."""
        return self.start_s + (self._first + len(self._load)) / self.rate_hz

    def settled_s(self) -> float:
        """Time in s up to which contacts, and the floors on either side of it, will no longer change."""
        if self._is_over:
            return np.inf
        known_s = self.detector.known_s - AHEAD_S
        floor_s = self._contacts.floor_time_s
        last_s = float(floor_s[-1]) if floor_s.size else self.start_s
        return known_s if known_s - last_s > HORIZON_S else min(known_s, last_s)

    def _hold_floor(self, until_s: float) -> None:
        """After a long time without a swing, repeat the last floor at ``until_s``: what was reported stays valid."""
        floor_s, floor = self._contacts.floor_time_s, self._contacts.floor
        if not self._is_over and floor_s.size and until_s > floor_s[-1]:
            self._contacts = replace(
                self._contacts,
                floor_time_s=np.append(floor_s, until_s),
                floor=np.vstack([floor, floor[-1:]]),
            )

    def window(self, start_s: float, end_s: float) -> tuple[Foot, Contacts]:
        """The foot from `BACK_S` before ``start_s`` to `AHEAD_S` after ``end_s``, with its contacts and floors."""
        first, stop = self._places(start_s - BACK_S, end_s + AHEAD_S)
        time_s = self.start_s + np.arange(self._first + first, self._first + stop) / self.rate_hz
        units = tuple(self._unit(k, slice(first, stop)) for k in range(len(self.model.units)))
        own = Contacts.joined([self._contacts, self.detector.under_way])
        begins = np.where(np.isfinite(own.strike_s), own.strike_s, -np.inf)
        ends = np.where(np.isfinite(own.toe_off_s), own.toe_off_s, np.inf)
        inside = (ends > start_s - BACK_S) & (begins < end_s + AHEAD_S)
        return replace(self.model, time_s=time_s, units=units), _chosen(own, inside, slice(None))

    def forget(self, until_s: float) -> None:
        """Drop all that a window starting at ``until_s`` does not need."""
        self._hold_floor(until_s)
        first, _ = self._places(until_s - BACK_S - 1.0, until_s)
        self._first += first
        self._readings, self._load = self._readings[first:].copy(), self._load[first:].copy()
        self._missing = self._missing[first:].copy()
        own = self._contacts
        keep = ~(own.toe_off_s < until_s - BACK_S - 1.0)
        floors = int(np.searchsorted(own.floor_time_s, until_s - BACK_S - 1.0))
        self._contacts = _chosen(own, keep, slice(max(floors - 1, 0), None))

    def _places(self, start_s: float, end_s: float) -> tuple[int, int]:
        """Indices, among the samples held, of the first sample from ``start_s`` on and from ``end_s`` on."""

        def place(at_s: float) -> int:
            if not np.isfinite(at_s):
                return len(self._load)
            return int(np.clip(np.ceil((at_s - self.start_s) * self.rate_hz - 1e-6) - self._first, 0, len(self._load)))

        return place(start_s), place(end_s)

    def _unit(self, column: int, rows: slice) -> UnitLoad:
        """The loads of one unit in the given rows, with samples on the rail or beyond the calibration marked."""
        model, load = self.model.units[column], self._load[rows, column]
        missing = self._missing[rows, column]
        readings, nothing = self._readings[rows, column], np.zeros(load.size, dtype=bool)
        saturated = nothing
        if readings.size and readings.max() >= self._top[column]:  # a value exceeded earlier is not the rail
            channel = replace(self._channels[column], values=readings, missing=missing if missing.any() else None)
            saturated = on_the_rail(channel)
        beyond = load > BEYOND * model.range_n if model.range_n else nothing
        return replace(model, load=load, missing=missing, saturated=saturated, beyond=beyond, sd_n=None)


def _chosen(contacts: Contacts, which: Mask, floors: slice) -> Contacts:
    return Contacts(
        contacts.regions, contacts.strike_s[which], contacts.toe_off_s[which], contacts.onset_s[which],
        contacts.release_s[which], contacts.floor_time_s[floors], contacts.floor[floors],
    )  # fmt: skip
