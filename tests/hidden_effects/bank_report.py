"""The bank's tables as Markdown: for the screen, for a file, for the docs."""

from __future__ import annotations

from pathlib import Path

from bank import GRID_PERCENT, Row
from bank_figures import Figure, by_effect, confidences, failures, logistic, reliability

SHOWN = 40  # cases named wrongly, in full


class Findings:
    """What the bank's tests leave for the summary."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.figures: list[Figure] = []
        self.written: list[Path] = []


def markdown(found: Findings) -> str:
    """The tables for a person, and for docs."""
    lines = ["", "### Figures", "", "| figure | floor | reach | reached |", "| --- | --- | --- | --- |"]
    for figure in found.figures:
        short = " **short**" if figure.count and figure.met is False else ""
        name, *cells = figure.cells
        name = f"… {name.strip()}" if name.startswith(" ") else name
        lines.append(f"| {name} | " + " | ".join(cells) + short + " |")
    heads = [f"{percent:g} %" for percent in GRID_PERCENT]
    lines += ["", "### By effect and strength: exact / family / cases", ""]
    lines += [f"| effect | {' | '.join(heads)} | any, 0.3 % or more |", "| --- " * (len(heads) + 2) + "|"]
    lines += [f"| `{name}` | {' | '.join(cells)} |" for name, cells in by_effect(found.rows)]
    named = confidences(found.rows)
    if named:
        lines += ["", "### Confidence", "", "| confidence | right | causes |", "| --- | --- | --- |"]
        lines += [f"| {sure:.3f} | {right:.3f} | {count} |" for sure, right, count in reliability(named)]
    calibrating = confidences(found.rows, "calibrate")
    if calibrating:
        intercept, margin, fall = logistic(calibrating)
        lines += ["", f"Calibrated on {len(calibrating)} causes of the set `calibrate`: right with probability "
                  f"1/(1 + exp(-({intercept:.3f} + {margin:.3f} ln margin + {fall:.3f} ln fall)))."]  # fmt: skip
    lines += ["", "### Not named exactly", ""]
    wrong = [row for row in found.rows if row.score and not row.score.exact]
    for row in wrong[:SHOWN]:
        said = ", ".join(f"{n.effect} {n.confidence:.2f}" for n in row.score.named) if row.score else ""
        faults = f"; faults {', '.join(row.score.faults)}" if row.score and row.score.faults else ""
        lines.append(f"- {row.kind} {row.index}: {row.label}: {row.verdict}: {said or 'nothing named'}{faults}")
    if len(wrong) > SHOWN:
        lines.append(f"- and {len(wrong) - SHOWN} more, in rows.jsonl")
    lines += [
        f"- {row.kind} {row.index}: {row.label} raised: {row.error.splitlines()[-1]}" for row in failures(found.rows)
    ]
    return "\n".join(lines) + "\n"
