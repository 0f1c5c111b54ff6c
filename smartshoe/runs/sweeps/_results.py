"""Reads a sweep's table, completely or only the columns needed for the page and the terminal; writes it as Parquet."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from smartshoe.files.atomic import replacing
from smartshoe.runs.sweeps._drivers import MAIN, main_figures
from smartshoe.runs.sweeps._plan import SweepPlan

if TYPE_CHECKING:
    import pandas as pd

BESIDE = ("seed", "status", "says")
BLOCK_BYTES = 1 << 18


def read_results(path: Path, columns: list[str] | None = None) -> pd.DataFrame:
    """``results.csv`` with one row for each case in the design's order; all columns, or only those named."""
    import pandas as pd

    return pd.read_csv(path, usecols=columns, keep_default_na=False, na_values=[""])


def main_results(path: Path, plan: SweepPlan) -> pd.DataFrame:
    """The varied keys, the main figures and the outcome of each case; the table of 100,000 cases is 100 MB large."""
    with path.open(encoding="utf-8", newline="") as file:
        header = next(csv.reader(file))
    keys = [axis.key for axis in plan.design.axes]
    figures = [name for name in header if name not in (*keys, *BESIDE, "case")]
    beside = [*keys, *BESIDE]
    table = read_results(path, [*beside, *(name for name in figures if name.endswith(MAIN))])
    if main_figures(table, plan):
        return table
    for name in figures:  # no usual figure is there: take the first one that differs between cases
        table = read_results(path, [*beside, name])
        if main_figures(table, plan):
            break
    return table


def write_parquet(results: Path, kinds: Mapping[str, str], target: Path) -> None:
    """Write the table of ``results`` as Parquet, block by block; ``kinds`` is the kind of each column by name."""
    import pyarrow
    from pyarrow import csv as arrow_csv
    from pyarrow import parquet

    of_kind = {"bool": pyarrow.bool_(), "int": pyarrow.int64(), "float": pyarrow.float64()}
    types = {name: of_kind.get(kind, pyarrow.string()) for name, kind in kinds.items()}
    blocks = arrow_csv.open_csv(
        results,
        arrow_csv.ReadOptions(use_threads=False, block_size=BLOCK_BYTES),
        arrow_csv.ParseOptions(newlines_in_values=True),
        arrow_csv.ConvertOptions(column_types=types, null_values=[""], strings_can_be_null=True),
    )
    # For columns of distinct numbers dictionaries take a megabyte each and make the file no smaller.
    repeated = {"use_dictionary": ["status", "says"]}
    with blocks, replacing(target) as temporary, parquet.ParquetWriter(temporary, blocks.schema, **repeated) as writer:
        for block in blocks:
            writer.write_batch(block)
    pyarrow.default_memory_pool().release_unused()
