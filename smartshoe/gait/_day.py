"""`analyse_stream`: analyses a trial too long for memory, such as a day, as `analyse` does a short one.

The same detector finds contacts as the blocks arrive. Once contacts and floors on both sides of a window of `WINDOW_S`
are known, the window is analysed as a short trial is, together with some seconds on either side. Its events and strides
are reported, its numbers are added to running sums, and its samples are dropped.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, cast

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import InputError, UsageError
from smartshoe.gait._analysis import checked, given_calibrations, require_steps
from smartshoe.gait._arriving import Piece, joined_head, pieces
from smartshoe.gait._checks import trial_flags
from smartshoe.gait._contact import Contacts
from smartshoe.gait._coverage import Coverage
from smartshoe.gait._day_flags import DayFlags
from smartshoe.gait._events import Event, events_of
from smartshoe.gait._flag import Flag
from smartshoe.gait._foot_stream import FootStream
from smartshoe.gait._result import DayResult
from smartshoe.gait._strides import Stride
from smartshoe.gait._trial import Foot, feet_of
from smartshoe.gait._trial_sums import TrialSums
from smartshoe.gait._window import analyse_window
from smartshoe.recording import Channel, Recording

if TYPE_CHECKING:
    from smartshoe.calibration.folder import CalibrationsLike


WINDOW_S = 120.0
HEAD_S = 60.0  # start of the record, which shows the columns, their rate and their sign before anything is reported
LISTED = 2000  # number of strides in a result; events are listed up to the end of the last of them
PEAKS = 1000  # number of stances over which the usual peak is taken
Report = Callable[[Sequence[Event], Sequence[Stride]], None]


def analyse_stream(
    blocks: Iterable[Recording] | Sequence[Iterable[Recording]],
    calibrations: CalibrationsLike | Iterable[CalibrationsLike] = (),
    body_weight_n: float | None = None,
    coverage: float | Coverage = 1.0,
    report: Report | None = None,
    estimator: str | None = None,
) -> DayResult:
    """Analyse the trial whose recording comes in consecutive ``blocks``, in memory that does not grow with its length.

    ``blocks`` are recordings of both shoes, of any size, or a list of two iterables, one for each shoe. ``report`` is
    called with events and strides in order as they become known, some minutes after they happened. The other arguments
    are those of `analyse`, and the result agrees with that of `analyse` whatever the size of the blocks. A stop of the
    recording for more than 10 s ends the contact under way; the analysis goes on after it. An ``estimator`` takes the
    reading's noise and the load's rate of change from the first minute. Raises what `analyse` raises.
    """
    covered = checked(body_weight_n, coverage, estimator)
    sources = _sources(_several(blocks))
    feet, flags = feet_of([head for head, _ in sources], given_calibrations(calibrations), estimator)
    day = _Day(feet, sources, covered, body_weight_n, report)
    day.run()
    return day.result(flags)


def _several(blocks: Iterable[Recording] | Sequence[Iterable[Recording]]) -> list[Iterable[Recording]]:
    """One iterable of blocks for each source; a sequence of recordings is a single source."""
    if isinstance(blocks, (list, tuple)) and not any(isinstance(item, Recording) for item in blocks):
        return list(blocks)
    return [cast("Iterable[Recording]", blocks)]


def _sources(given: Sequence[Iterable[Recording]]) -> list[tuple[Recording, Iterator[Recording]]]:
    """Each source's label and channels, as the recording of its first `HEAD_S`, and all its blocks."""
    found: list[tuple[Recording, Iterator[Recording]]] = []
    for blocks in given:
        rest = iter(blocks)
        head, came = joined_head(rest, HEAD_S)
        if head is None:
            raise InputError("a stream holds no block: give one recording at least")
        found.append((head, chain(came, rest)))
    return found


class _Day:
    """The analysis of a long trial under way: one stream for each foot, running sums, and the first strides."""

    def __init__(
        self,
        feet: Mapping[str, Foot],
        sources: Sequence[tuple[Recording, Iterator[Recording]]],
        coverage: Coverage,
        body_weight_n: float | None,
        report: Report | None,
    ) -> None:
        self.feet, self.coverage, self.body_weight_n, self._report = feet, coverage, body_weight_n, report
        self.label = sources[0][0].label
        self._channels: dict[str, tuple[Channel, ...]] = {}
        self._of_source: list[list[tuple[str, slice]]] = []
        self._pieces: list[Iterator[Piece]] = []
        left = dict(feet)
        for head, blocks in sources:
            names: list[str] = []
            own: list[tuple[str, slice]] = []
            for foot in [f for f in left.values() if f.source == head.label]:
                channels = _channels_of(foot, head)
                if channels is None:
                    continue
                del left[foot.name]
                self._channels[foot.name] = channels
                own.append((foot.name, slice(len(names), len(names) + len(channels))))
                names += [channel.name for channel in channels]
            if not own:
                raise UsageError(f"two recordings are called {head.label}: give each a name of its own")
            self._of_source.append(own)
            self._pieces.append(pieces(blocks, tuple(names), feet[own[0][0]].rate_hz))
        self.sums, self.flags = TrialSums(feet, coverage.share), DayFlags()
        self._peaks: dict[str, deque[Array]] = {name: deque(maxlen=PEAKS) for name in feet}
        self._streams: dict[str, FootStream] = {}
        self._settled_s = self._run_s = 0.0
        self._events: list[Event] = []  # waiting until their window is analysed
        self._listed_events: list[Event] = []
        self._listed: list[Stride] = []
        self.event_count = self.stride_count = 0

    def run(self) -> None:
        """Analyse all pieces, one run of recording after the other.

        A run ends for both shoes when one of them stops.
        """
        ahead = dict(enumerate(next(own, None) for own in self._pieces))
        while running := {k: piece for k, piece in ahead.items() if piece is not None}:
            begin_s = max(self._at(k, piece) for k, piece in running.items())
            for k in running:
                # Both shoes are analysed together: what one recorded before the other began is skipped.
                while (late := ahead[k]) and self._at(k, late) + len(late.values) / self._rate(k) <= begin_s:
                    ahead[k] = next(self._pieces[k], None)
            running = {k: piece for k, piece in ahead.items() if piece is not None}
            self._begin(running)
            while True:
                k = min(running, key=lambda key: self._at(key, running[key]))
                piece = running[k]
                self._push(k, piece)
                ahead[k] = following = next(self._pieces[k], None)
                if piece.last or following is None:
                    break
                running[k] = following
            ended_s = self._at(k, piece) + len(piece.values) / self._rate(k)
            for other in running.keys() - {k}:
                while (late := ahead[other]) and self._at(other, late) < ended_s:
                    self._push(other, late)
                    ahead[other] = next(self._pieces[other], None)
            self._end()

    def _rate(self, source: int) -> float:
        return self.feet[self._of_source[source][0][0]].rate_hz

    def _at(self, source: int, piece: Piece) -> float:
        return piece.start_s + piece.first / self._rate(source)

    def _begin(self, running: Mapping[int, Piece]) -> None:
        """Start a run of recording with new streams."""
        self._settled_s = min(self._at(k, piece) for k, piece in running.items())
        self._streams = {
            name: FootStream(self.feet[name], self._channels[name], self._at(k, piece))
            for k, piece in running.items()
            for name, _ in self._of_source[k]
        }
        self._run_s = self._settled_s

    def _push(self, source: int, piece: Piece) -> None:
        for name, columns in self._of_source[source]:
            self._add(name, self._streams[name].push(piece.values[:, columns], piece.missing[:, columns]))
        self._settle(at_end=False)

    def _add(self, foot: str, contacts: Contacts) -> None:
        self.sums.add_contacts(foot, contacts)
        self._events += events_of({foot: contacts})

    def _end(self) -> None:
        for name, stream in self._streams.items():
            self._add(name, stream.finish())
        end_s = max(stream.end_s - 1.0 / stream.rate_hz for stream in self._streams.values())
        self.flags.add_run(self._run_s, end_s)
        self._settle(at_end=True)

    def _settle(self, *, at_end: bool) -> None:
        """Analyse all windows whose contacts and floors are known."""
        while self._streams:
            end_s = self._settled_s + WINDOW_S
            last_s = max(stream.end_s for stream in self._streams.values())
            if at_end and last_s <= end_s:
                end_s = np.inf
            elif not at_end and min(stream.settled_s() for stream in self._streams.values()) < end_s:
                return
            self._settle_to(end_s)
            if end_s == np.inf:
                self._streams = {}

    def _settle_to(self, end_s: float) -> None:
        """Analyse the window up to ``end_s``, report its events and strides, and drop its samples."""
        windows = {name: stream.window(self._settled_s, end_s) for name, stream in self._streams.items()}
        windows = {name: windows[name] for name in self.feet if name in windows and windows[name][0].time_s.size > 1}
        strides: tuple[Stride, ...] = ()
        if windows:
            window = analyse_window(
                {name: foot for name, (foot, _) in windows.items()},
                {name: contacts for name, (_, contacts) in windows.items()},
                self.coverage, self.body_weight_n, peaks=self._peaks, start_s=self._settled_s, end_s=end_s,
            )  # fmt: skip
            self.sums.add(window)
            self.flags.add(window)
            strides = window.strides
        events = sorted((e for e in self._events if e.time_s < end_s), key=lambda e: (e.time_s, e.foot, e.event))
        self._events = [event for event in self._events if event.time_s >= end_s]
        self.event_count += len(events)
        self.stride_count += len(strides)
        if len(self._listed) < LISTED:
            self._listed += strides
            self._listed_events += events
            if len(self._listed) > LISTED:
                self._cut_lists()
        if self._report is not None and (events or strides):
            self._report(events, strides)
        self._settled_s = end_s
        if np.isfinite(end_s):
            for stream in self._streams.values():
                stream.forget(end_s)

    def _cut_lists(self) -> None:
        del self._listed[LISTED:]
        until_s = self._listed[-1].end_s
        self._listed_events = [event for event in self._listed_events if event.time_s <= until_s]

    def result(self, flags: Sequence[Flag]) -> DayResult:
        """The result of the whole trial; raises `RefusedError` if neither a stance nor a standing load was found."""
        sums = self.sums
        require_steps(sums, self.label)
        is_cut = self.stride_count > len(self._listed)
        forces = sums.forces(self.body_weight_n)
        of_all = trial_flags(forces, self.coverage.share, self.body_weight_n, sums.strides[False], sums.strides[True])
        return DayResult(
            activity=sums.activity(),
            events=tuple(self._listed_events),
            strides=tuple(self._listed),
            figures=sums.summary(),
            indices=sums.indices(),
            forces=forces,
            flags=(*flags, *self.flags.flags(sums), *of_all),
            coverage=self.coverage.share,
            covering=self.coverage,
            duration_s=self.flags.duration_s,
            recorded_s=self.flags.recorded_s,
            event_count=self.event_count,
            stride_count=self.stride_count,
            listed_s=self._listed[-1].end_s if is_cut else None,
        )


def _channels_of(foot: Foot, head: Recording) -> tuple[Channel, ...] | None:
    """The channels of a foot's units in a recording; None if one is not there."""
    found = [head.channels.get(u.name) or head.channels.get(u.name.split("_", 1)[-1]) for u in foot.units]
    return tuple(c for c in found if c is not None) if all(c is not None for c in found) else None
