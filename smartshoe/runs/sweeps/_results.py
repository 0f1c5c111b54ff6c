"""A sweep's table read again: whole for its user, and in the few columns that the page and the terminal tell of."""

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
    """``results.csv``, one row a case in the design's order; all columns, or only those named."""
    import pandas as pd

    return pd.read_csv(path, usecols=columns, keep_default_na=False, na_values=[""])


def main_results(path: Path, plan: SweepPlan) -> pd.DataFrame:
    """The varied keys, the main figures and how each case ended: a sweep of 100,000 cases has a table of 100 MB."""
    with path.open(encoding="utf-8", newline="") as file:
        header = next(csv.reader(file))
    keys = [axis.key for axis in plan.design.axes]
    figures = [name for name in header if name not in (*keys, *BESIDE, "case")]
    beside = [*keys, *BESIDE]
    table = read_results(path, [*beside, *(name for name in figures if name.endswith(MAIN))])
    if main_figures(table, plan):
        return table
    for name in figures:  # none of the usual ones: the first that differs between cases
        table = read_results(path, [*beside, name])
        if main_figures(table, plan):
            break
    return table


def write_parquet(results: Path, kinds: Mapping[str, str], target: Path) -> None:
    """Write the table of ``results`` as Parquet, by pyarrow, block by block; ``kinds`` says what each column holds."""
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
    # Numbers that are all different make dictionaries of a megabyte a column, and no smaller a file.
    repeated = {"use_dictionary": ["status", "says"]}
    with blocks, replacing(target) as temporary, parquet.ParquetWriter(temporary, blocks.schema, **repeated) as writer:
        for block in blocks:
            writer.write_batch(block)
    pyarrow.default_memory_pool().release_unused()
