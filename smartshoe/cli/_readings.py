"""A shoe's live readings on a terminal: one line per unit, redrawn a few times a second."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from smartshoe.devices import Block

DRAWN_EVERY_S = 0.1


class LiveReadings:
    """A table on stderr: present reading, lowest and highest so far, and a bar."""

    def __init__(self) -> None:
        self._console = Console(stderr=True, highlight=False, markup=False)
        self._live = Live(console=self._console, transient=True, auto_refresh=False)
        self._drawn = 0.0
        self._low: dict[str, float] = {}
        self._high: dict[str, float] = {}

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._live.__exit__(kind, error, at)

    def print(self, sentence: str) -> None:
        """Print a sentence above the table, where it remains."""
        self._console.print(sentence, soft_wrap=True)

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        """Add a block; the table is redrawn at most ten times a second."""
        for column, name in enumerate(block.names):
            values = block.readings[~block.missing[:, column], column]
            if values.size:
                self._low[name] = min(self._low.get(name, np.inf), float(values.min()))
                self._high[name] = max(self._high.get(name, -np.inf), float(values.max()))
        now = time.monotonic()
        if now - self._drawn < DRAWN_EVERY_S:
            return
        self._drawn = now
        self._live.update(Group(Text(f"{experiment or 'idle'}  {elapsed_s:.1f} s"), self._table(block)), refresh=True)

    def _table(self, block: Block) -> Table:
        table = Table(box=None, header_style="bold")
        for title in ("unit", f"now ({block.unit.symbol})", "lowest", "highest", ""):
            table.add_column(title, justify="left" if title == "unit" else "right")
        # One scale for all units, so that the pressed one is conspicuous.
        widest = max((self._high[name] - self._low[name] for name in self._high), default=0.0)
        for column, name in enumerate(block.names):
            low, high = self._low.get(name, 0.0), self._high.get(name, 0.0)
            now = float(block.readings[-1, column])
            bar = ProgressBar(total=max(widest, 1e-12), completed=max(now - low, 0.0), width=30)
            table.add_row(name, f"{now:.2f}", f"{low:.2f}", f"{high:.2f}", bar)
        return table
