"""`select_order`: the structure that made the data is the one that the criteria choose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.identification.transfer_function import select_order

# (-8 s + 16)/((s^2 + s + 4)(s + 2)) in controllable form
STATES = (
    np.array([[-3.0, -6.0, -8.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    np.array([[1.0], [0.0], [0.0]]),
    np.array([[0.0, -8.0, 16.0]]),
    np.zeros((1, 1)),
)
STEP_S = 0.1


def made(count, seed):
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], count).repeat(3)
    y = lsim(STATES, u, np.arange(u.size) * STEP_S, interp=False)[1]
    return u, y + 0.05 * np.std(y) * rng.normal(size=y.size)


def test_true_structure_is_chosen_by_bic_and_by_yic():
    u, y = made(700, 1)
    selection = select_order(u, y, poles=(1, 2, 3, 4), sample_time_s=STEP_S)
    best = selection.best
    assert (best.denominator.size - 1, best.numerator.size - 1) == (3, 1)
    values = [one.bic for one in selection.candidates]
    assert values == sorted(values)
    steadiest = min(selection.candidates, key=lambda one: one.yic)
    assert (steadiest.poles, steadiest.zeros) == (3, 1)


@pytest.mark.long
def test_error_on_left_out_experiments_tells_too_few_poles_and_comes_down_to_the_noise():
    pairs = [made(250, seed) for seed in (2, 3, 4)]
    u, y = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
    selection = select_order(u, y, poles=(1, 2, 3, 4), zeros=(0, 1), criterion="held_out", sample_time_s=STEP_S)
    error = {(one.poles, one.zeros): one.held_out_rmse for one in selection.candidates}
    noise_sd = 0.05 * np.mean([np.std(one) for one in y])
    # 2250 samples give a standard deviation to 1.5 %: three of those.
    assert error[3, 1] == pytest.approx(noise_sd, rel=0.05)
    assert min(error[1, 0], error[1, 1], error[2, 0]) > 3.0 * error[3, 1]
    assert selection.candidates[0].poles >= 3


def test_structures_that_the_data_cannot_hold_are_listed_with_the_reason():
    u, y = made(20, 5)
    selection = select_order(u, y, poles=(1, 30), zeros=(0,), sample_time_s=STEP_S, offset=0.0)
    last = selection.candidates[-1]
    assert (last.poles, last.estimate) == (30, None)
    assert "samples" in last.refused
    with pytest.raises(NotIdentifiableError, match="no structure"):
        select_order(u, y, poles=(30,), zeros=(0,), sample_time_s=STEP_S)


def test_wrong_arguments_are_named():
    u, y = made(50, 6)
    with pytest.raises(UsageError, match="criterion"):
        select_order(u, y, criterion="aic", sample_time_s=STEP_S)
    with pytest.raises(UsageError, match="held_out_share"):
        select_order(u, y, held_out_share=1.0, sample_time_s=STEP_S)
    with pytest.raises(UsageError, match="no structure to try"):
        select_order(u, y, poles=(1,), zeros=(3,), sample_time_s=STEP_S)
