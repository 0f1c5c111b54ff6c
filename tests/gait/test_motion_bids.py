"""A trial as a Motion-BIDS folder: the files that the standard asks for, the same samples, units, times and events."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from trials import analysed

from smartshoe.errors import UsageError
from smartshoe.gait import write_motion_bids


def test_a_trial_comes_back_from_the_folder(tmp_path: Path) -> None:
    found = analysed()
    paths = write_motion_bids(tmp_path, found, subject="01", task="walk")
    stem = "sub-01/motion/sub-01_task-walk"
    assert [path.relative_to(tmp_path).as_posix() for path in paths] == [
        f"{stem}_tracksys-shoe_motion.tsv", f"{stem}_tracksys-shoe_motion.json",
        f"{stem}_tracksys-shoe_channels.tsv", f"{stem}_events.tsv",
    ]  # fmt: skip
    motion, about, channels, events = paths
    told = json.loads(about.read_text())
    columns = pd.read_csv(channels, sep="\t", keep_default_na=False)
    assert list(columns) == ["name", "component", "type", "tracked_point", "units"]
    assert told["MotionChannelCount"] == len(columns)
    rows = [line.split("\t") for line in motion.read_text().splitlines()]
    numbers = np.array([[float("nan" if cell == "n/a" else cell) for cell in row] for row in rows])
    samples = dict(zip(columns["name"], numbers.T, strict=True))
    expected = found.columns()
    np.testing.assert_array_equal(samples["time"], expected["time_s"])
    units = dict(zip(columns["name"], columns["units"], strict=True))
    for name, suffix, symbol in (("total", "n", "N"), ("left_heel", "n", "N"), ("left_centre_along", "percent", "%")):
        np.testing.assert_array_equal(samples[name], expected[f"{name}_{suffix}"])
        assert units[name] == symbol
    assert told["SamplingFrequencyEffective"] == pytest.approx(told["SamplingFrequency"], rel=1e-3)
    table = pd.read_csv(events, sep="\t")
    assert len(table) == len(found.events)
    first = found.events[0]
    assert table["onset"][0] + expected["time_s"][0] == pytest.approx(first.time_s, abs=1e-12)
    assert table["trial_type"][0] == f"{first.foot}_{first.event}"


def test_a_second_subject_joins_and_a_trial_is_never_replaced(tmp_path: Path) -> None:
    found = analysed()
    write_motion_bids(tmp_path, found, subject="01", title="Shod and unshod")
    (tmp_path / "participants.tsv").write_text("participant_id\tage\nsub-01\t31\n")
    write_motion_bids(tmp_path, found, subject="02")
    assert (tmp_path / "participants.tsv").read_text() == "participant_id\tage\nsub-01\t31\nsub-02\tn/a\n"
    assert json.loads((tmp_path / "dataset_description.json").read_text())["Name"] == "Shod and unshod"
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with pytest.raises(UsageError, match="already"):
        write_motion_bids(tmp_path, found, subject="01")
    with pytest.raises(UsageError, match="letters and digits"):
        write_motion_bids(tmp_path, found, subject="anna k.")
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
