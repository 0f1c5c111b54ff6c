"""``smartshoe stream``."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from smartshoe.cli._output import note, require_writable
from smartshoe.cli._ranges import FiniteRange
from smartshoe.cli._readers import is_output_read

if TYPE_CHECKING:
    from smartshoe.devices import Shoe
    from smartshoe.runs.session.streaming import StreamedForces


@click.command("stream", epilog="Example: smartshoe stream --shoe sim:walk --calibration left_heel.json --out walk.csv")
@click.option("--shoe", "url", required=True, metavar="URL", help="serial:///dev/rfcomm0, replay:FILE, sim:walk.")
@click.option("--calibration", "calibrations", multiple=True, metavar="C.json",
              help="A unit's calibration: its force is shown and written (repeatable).")  # fmt: skip
@click.option("--duration", "duration_s", type=FiniteRange(min=0.0, min_open=True), metavar="S",
              help="Stop after this long (default: the stream's end, or Ctrl-C).")  # fmt: skip
@click.option("--out", metavar="FILE", help="Write every sample to a new plain table.")
def command(url: str, calibrations: tuple[str, ...], duration_s: float | None, out: str | None) -> None:
    """Live readings and forces from a shoe: each second's least and most, every sample to FILE; Ctrl-C ends it."""
    from smartshoe.calibration.folder import load_calibrations
    from smartshoe.devices import open_shoe
    from smartshoe.errors import UsageError
    from smartshoe.runs.session.streaming import StreamedForces

    require_writable(out)
    loaded = load_calibrations(calibrations)
    if out is not None and Path(out).exists():
        raise UsageError(f"{out} is there already and is not overwritten: choose another name for --out")
    run = _StreamRun(out)
    try:
        with _interrupts(run), open_shoe(url) as shoe:
            run.until(shoe, StreamedForces(loaded, shoe), duration_s)
    except KeyboardInterrupt:
        run.is_stopped = True
    finally:
        run.close()


@contextmanager
def _interrupts(run: _StreamRun) -> Iterator[None]:
    """Let Ctrl-C or a termination request end the run after its present block, or before the first."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, frame: FrameType | None) -> None:
        if run.is_stopped or not run.has_begun:
            raise KeyboardInterrupt
        run.is_stopped = True

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _StreamRun:
    """Counters and the output table of one call."""

    def __init__(self, out: str | None) -> None:
        from smartshoe.runs.session.streaming import StreamTable

        self.is_stopped = self.has_begun = False
        self._out = out
        self._table: StreamTable | None = None
        self._samples = self._reported = 0

    def until(self, shoe: Shoe, forces: StreamedForces, duration_s: float | None) -> None:
        """Read until ``duration_s`` of the device's time have passed, or the stream ends."""
        from smartshoe.errors import DeviceError
        from smartshoe.runs.session.streaming import Seconds, StreamTable

        start_s, due_s, lost = None, 0.0, 0
        seconds: Seconds | None = None
        for block in shoe.blocks():
            self._tell_events(shoe)
            if self.is_stopped:
                break
            if not len(block):
                continue
            self.has_begun = True
            if start_s is None:
                start_s = due_s = float(block.time_s[0])
                if self._out is not None:
                    facts = {"shoe": str(shoe), "sample_rate_hz": repr(shoe.sample_rate_hz)}
                    self._table = StreamTable(self._out, block, forces.names, facts)
            if seconds is None:
                seconds = Seconds(block, forces.names)
                click.echo(f"{seconds.heading}\nleast to most of each second", err=True)
            force_n = forces.push(block)
            seconds.add(block, force_n)
            if self._table is not None:
                self._table.append(block, force_n)
            self._samples += len(block)
            last_s = float(block.time_s[-1])
            if last_s >= due_s:
                click.echo(seconds.report(last_s))
                if not is_output_read():
                    break
                if self._lost(shoe) > lost:
                    lost = self._lost(shoe)
                    note(f"samples lost so far: {lost}")
                due_s += int(last_s - due_s) + 1
            if duration_s is not None and last_s - start_s >= duration_s:
                break
        if start_s is None and not self.is_stopped:
            raise DeviceError(f"{shoe} sent no samples: see that the shoe is switched on and streams")
        self._tell_events(shoe)

    @staticmethod
    def _lost(shoe: Shoe) -> int:
        from smartshoe.devices import Dropped, Gap

        events = shoe.events
        lost = sum(event.lost for event in events if isinstance(event, Gap))
        return lost + sum(event.samples for event in events if isinstance(event, Dropped))

    def _tell_events(self, shoe: Shoe) -> None:
        events = shoe.events
        for event in events[self._reported :]:
            note(event.says)
        self._reported = len(events)

    def close(self) -> None:
        """Close the table and print its path."""
        if self.is_stopped:
            click.echo("stopped", err=True)
        if self._table is None:
            return
        self._table.close()
        click.echo(f"{self._out}: {self._samples} samples")
