"""Which key drives a figure: held against scipy.stats."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from small_sweeps import SMALL, write_scenario

from smartshoe.runs.sweeps._drivers import drivers_of, what_drives
from smartshoe.runs.sweeps._plan import read_plan


@pytest.mark.parametrize("count", [4, 60])
def test_strengths_and_p_values_are_those_of_spearman_and_of_kruskal_and_wallis(tmp_path, count: int) -> None:
    text = SMALL + '"identify.method" = ["srivc", "trf"]\n'
    plan = read_plan(write_scenario(tmp_path, text))
    rng = np.random.default_rng(count)
    stiffness, word = rng.choice([1.2, 1.5], count), rng.choice(["srivc", "trf"], count)
    stiffness[:2], word[:2] = [1.2, 1.5], ["srivc", "trf"]
    error = np.round(stiffness + (word == "trf") + rng.normal(0.0, 0.3, count), 1)  # with ties
    k1 = "unit.left_toe.bladder.k1"
    found = {
        one.key: one
        for one in drivers_of(pd.DataFrame({k1: stiffness, "identify.method": word, "e": error}), plan, ["e"])
    }
    spearman = stats.spearmanr(stiffness, error)
    assert found[k1].strength == pytest.approx(spearman.statistic)
    assert found[k1].p_value == pytest.approx(spearman.pvalue)
    kruskal = stats.kruskal(error[word == "srivc"], error[word == "trf"])
    assert found["identify.method"].p_value == pytest.approx(kruskal.pvalue)
    assert found["identify.method"].strength == pytest.approx(np.sqrt(kruskal.statistic / (count - 1)))


def test_what_always_rises_with_a_key_is_named_and_chance_is_not(tmp_path) -> None:
    plan = read_plan(write_scenario(tmp_path))
    key = "unit.left_toe.bladder.k1"
    x = np.repeat([1.2, 1.5], 20)
    rising = pd.DataFrame({key: x, "e": 2.0 * x})
    assert what_drives("e", drivers_of(rising, plan, ["e"])) == f"e goes most with {key} (rank correlation +1.00)"
    chance = pd.DataFrame({key: x, "e": np.tile([1.0, 2.0], 20)})
    assert what_drives("e", drivers_of(chance, plan, ["e"])) == "no varied key drives e beyond chance"
