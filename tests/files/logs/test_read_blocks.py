"""A plain table block by block is the table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from smartshoe.errors import FormatError, InputError
from smartshoe.files.logs import read
from smartshoe.files.logs.blocks import read_blocks

ROWS = 300


def text(rows: int = ROWS) -> str:
    rng = np.random.default_rng(2)
    lines = ["# name: walk", "# body_weight_n: 519.4", "time_s,left_heel_n,left_toe_mbar,temperature_c"]
    for k in range(rows):
        # The toe is not there for the first half, nor the thermometer in most rows; some rows stand apart.
        toe = "" if k < rows // 2 else repr(float(rng.normal()))
        lines.append(f"{0.005 * k:.3f},{float(rng.normal())!r},{toe},{'21.5' if k % 50 == 7 else ''}")
        if k % 90 == 40:
            lines.append("")
    return "\n".join(lines) + "\n"


@given(block_bytes=st.integers(40, 20_000))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_blocks_hold_what_the_table_holds(tmp_path: Path, block_bytes: int) -> None:
    path = tmp_path / "walk.csv"
    path.write_text(text(), encoding="utf-8")
    whole, blocks = read(path), list(read_blocks(path, block_bytes=block_bytes))
    assert np.array_equal(np.concatenate([block.time_s for block in blocks]), whole.time_s)
    for block in blocks:
        assert (block.name, block.unit, block.source) == (whole.name, whole.unit, whole.source)
        assert block.metadata == whole.metadata
        assert [(c.name, c.unit, c.role) for c in block.channels.values()] == [
            (c.name, c.unit, c.role) for c in whole.channels.values()
        ]
    for name in whole.channels:
        values = np.concatenate([block[name].with_nan() for block in blocks])
        assert np.array_equal(values, whole[name].with_nan(), equal_nan=True)


@pytest.mark.parametrize(
    ("fault", "says"),
    [("1.0,1.0", "line 201 has 2 cells"), ("1.0,1.0,x,", "line 201"), (",1.0,2.0,", "line 201 has no time")],
)
def test_a_fault_is_named_by_its_line(tmp_path: Path, fault: str, says: str) -> None:
    path = tmp_path / "walk.csv"
    lines = [line for line in text().splitlines() if line]
    lines[200] = fault
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises((FormatError, InputError), match=says):
        list(read_blocks(path, block_bytes=500))


@pytest.mark.parametrize("block_bytes", [100, 100_000])
def test_time_that_goes_back_is_named_by_its_line(tmp_path: Path, block_bytes: int) -> None:
    path = tmp_path / "walk.csv"
    rows = [f"{0.005 * k:.3f},1.0" for k in range(110)]
    path.write_text("\n".join(["time_s,left_heel_n", *rows, *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 112"):
        list(read_blocks(path, block_bytes=block_bytes))


def test_a_table_without_rows_is_told(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    path.write_text("time_s,left_heel_n\n", encoding="utf-8")
    with pytest.raises(InputError, match="no data rows"):
        list(read_blocks(path))


def test_other_formats_come_whole(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("Time (s);Load (N)\n" + "".join(f"{k};{k}\n" for k in range(50)), encoding="utf-8")
    blocks = list(read_blocks(path))
    assert len(blocks) == 1
    assert np.array_equal(blocks[0].time_s, read(path).time_s)
