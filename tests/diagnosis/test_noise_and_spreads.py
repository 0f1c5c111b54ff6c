"""What noise leaves in the mean of a block, and figures that must not go by how much there is of a record."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._denoise import noise_sd
from smartshoe.diagnosis._held_out import errors, gain
from smartshoe.diagnosis._lack_of_fit import _mean_variance
from smartshoe.diagnosis._result import Diagnosis, GoodnessOfFit
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._validation import _centred_rms
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR

STANDARD = Thresholds()


@pytest.mark.parametrize("tau_s", [0.0, 0.1, 0.3])
def test_the_variance_of_a_blocks_mean_follows_from_what_is_left_about_it(tau_s: float) -> None:
    """White or first-order, the means of blocks scatter as foretold from the blocks with their means taken out."""
    step_s, blocks, width = 0.05, 600, 60
    rng = np.random.default_rng(int(100 * tau_s))
    kept = float(np.exp(-step_s / tau_s)) if tau_s else 0.0
    noise = lfilter([1.0], [1.0, -kept], rng.standard_normal((blocks, width + 200)))[:, 200:]
    means = noise.mean(axis=1)
    foretold = _mean_variance(noise - means[:, np.newaxis], step_s, STANDARD)
    # The truth lies within what so many means tell of it; the tenth of blocks that is loudest was not looked at.
    low, high = float(means @ means) / chi2.ppf([0.9995, 0.0005], blocks)
    assert 0.85 * low < foretold < 1.05 * high


def test_a_spread_goes_by_no_number_of_samples() -> None:
    one = np.random.default_rng(1).standard_normal(500)
    seen = np.ones(500, dtype=bool)
    once, often = _centred_rms([one], [seen]), _centred_rms([np.tile(one, 4)], [np.ones(2000, dtype=bool)])
    assert once == pytest.approx(float(np.std(one)))
    assert often == pytest.approx(once)
    # About each one's own mean, and only where it is looked at.
    assert _centred_rms([one, one + 7.0], [seen, seen]) == pytest.approx(once)
    assert _centred_rms([one, 1e6 * one], [seen, ~seen]) == pytest.approx(once)


def test_where_nothing_is_held_out_no_number_is_said() -> None:
    """Neither a good fit nor a gain of all there is."""
    nothing = errors([], ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar"))
    assert nothing.is_empty
    assert nothing.squares.shape == nothing.counts.shape == (0,)
    found = gain(nothing, nothing, Scale(800.0, 140.0, MILLIBAR), STANDARD)
    assert not found.is_loss
    assert found.to_dict() == {
        "rmse_before": None, "rmse_after": None, "unit": "mbar", "gain_percent": None, "ci95": [None, None],
    }  # fmt: skip
    figures = GoodnessOfFit(
        nothing.rmse, "mbar", nothing.fit_percent, math.nan, 0.0, nothing.variance_explained_percent
    ).to_dict()
    assert figures["rmse"] == {"value": None, "unit": "mbar"}
    assert [figures[name] for name in ("fit_percent", "force_rmse_n", "variance_explained_percent")] == [None] * 3
    said = Diagnosis("adequate", "", "mbar", 800.0, 140.0, explainable_percent=math.nan, explained_percent=math.nan)
    assert (said.to_dict()["explainable_percent"], said.to_dict()["explained_percent"]) == (None, None)


def test_a_load_that_is_switched_every_few_samples_keeps_its_steps() -> None:
    """Its differences are its own steps: lines through them would smear it by half of what it is."""
    rng = np.random.default_rng(5)
    load = np.repeat(rng.integers(0, 2, 300), 3).astype(float)
    half = load[rng.integers(0, 2) :: 2]
    assert np.median(np.abs(np.diff(half, 3))) > 0.0
    assert noise_sd(half, Thresholds()) == 0.0
    toggling = rng.integers(0, 2, 600).astype(float)
    assert noise_sd(toggling, Thresholds()) > 0.3
