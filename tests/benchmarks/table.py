"""The table of figures: asked, reached, and the peers' in the same run."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path

from rich.console import Console
from rich.table import Table as RichTable

HEADINGS = ("figure", "asked", "reached", "peer", "")
SHARES = (14, 7, 16, 14, 2)  # of the width
LEAST_WIDTH = 140


@dataclass(frozen=True)
class Row:
    """One figure of one case; ``met`` is None where nothing was asked."""

    case: str
    figure: str
    asked: str
    reached: str
    peer: str
    met: bool | None

    @property
    def verdict(self) -> str:
        return {True: "met", False: "SHORT", None: ""}[self.met]

    @property
    def cells(self) -> tuple[str, ...]:
        return self.figure, self.asked, self.reached, self.peer, self.verdict


@dataclass
class FigureTable:
    """Rows as the benchmarks add them; cases keep the order in which they first came."""

    rows: list[Row] = field(default_factory=list)

    def add(
        self, case: str, figure: str, reached: str, *, asked: str = "", peer: str = "", met: bool | None = None
    ) -> None:
        self.rows.append(Row(case, figure, asked, reached, peer, met))

    def by_case(self) -> list[tuple[str, list[Row]]]:
        order = list(dict.fromkeys(row.case for row in self.rows))
        ordered = sorted(self.rows, key=lambda row: order.index(row.case))
        return [(case, list(rows)) for case, rows in groupby(ordered, key=lambda row: row.case)]

    def show(self) -> None:
        """Print to standard output, one table a case under one set of widths."""
        console = Console(highlight=False)
        console.width = max(console.width, LEAST_WIDTH)
        console.print("\n[bold]Figures asked and reached, peers in the same run[/bold]")
        for case, rows in self.by_case():
            table = RichTable(title=case, title_justify="left", title_style="bold", expand=True)
            for heading, share in zip(HEADINGS, SHARES, strict=True):
                table.add_column(heading, ratio=share, overflow="fold")
            for row in rows:
                table.add_row(*row.cells, style="bold red" if row.met is False else None)
            console.print(table)

    def markdown(self) -> str:
        """The same as Markdown, one table a case."""
        lines: list[str] = []
        for case, rows in self.by_case():
            lines += [f"### {case}", "", "| figure | asked | reached | peer | |", "| --- | --- | --- | --- | --- |"]
            lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row.cells) + " |" for row in rows]
            lines.append("")
        return "\n".join(lines)

    def write(self, path: Path) -> None:
        """Write `markdown` to ``path``."""
        path.write_text(self.markdown(), encoding="utf-8")
