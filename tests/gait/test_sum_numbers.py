"""What a walk of a few strides is summed up to, beside numbers worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from smartshoe.gait import Contacts
from smartshoe.gait._strides import Stride
from smartshoe.gait._sums import BlockMeans, Moments, StrideSums, weighted_mean
from smartshoe.gait.summary import asymmetry

NAN = float("nan")


def contacts(strike_s: list[float], off_s: list[float], onset_s: Any, regions: tuple[str, ...]) -> Contacts:
    onset = np.array(onset_s, dtype=float)
    none = np.zeros((0, len(regions)))
    return Contacts(regions, np.array(strike_s), np.array(off_s), onset, onset + 0.3, np.zeros(0), none)


def stride(start_s: float, lasts_s: float = 1.0, foot: str = "left", percent: float = 60.0, **more: Any) -> Stride:
    off_s = start_s + 0.01 * percent * lasts_s
    made = Stride(foot, start_s, start_s + lasts_s, off_s, None, None, percent, None, None, None, False, False)
    return replace(made, **more)


REGIONS = ("toe", "meta1", "meta4", "heel")


def walked(right_impulse_n_s: float | None = 330.0) -> tuple[dict[str, Contacts], list[Stride]]:
    """Two strides of the left foot, 1 and 1.2 s, and one of the right."""
    left = contacts(
        [0.0, 1.0, 2.2], [0.6, 1.72, 2.8],
        [[0.3, 0.2, 0.1, 0.0], [1.3, 1.1, 1.2, 1.0], [2.5, 2.4, 2.3, 2.2]], REGIONS,
    )  # fmt: skip
    right = contacts([0.5, 1.6], [1.05, 2.2], [[0.8, 0.7, 0.6, 0.5], [NAN, 1.8, 1.7, 1.6]], REGIONS)
    numbers = {"peak_n": 500.0, "impulse_n_s": 300.0, "loading_rate_n_per_s": 4000.0}
    strides = [
        stride(0.0, **numbers), stride(1.0, 1.2, **numbers | {"peak_n": 700.0, "loading_rate_n_per_s": None}),
        stride(0.5, 1.1, "right", 50.0, peak_n=660.0, impulse_n_s=right_impulse_n_s, loading_rate_n_per_s=5000.0),
    ]  # fmt: skip
    return {"left": left, "right": right}, strides


def test_a_walk_is_summed_up_as_by_hand() -> None:
    sums = StrideSums(("left", "right"))
    assert sums.count == 0
    sums.add(*walked())
    sums.add({}, [])
    assert sums.count == 3
    found = sums.summary()
    sd = 100.0 * np.sqrt(2.0) / 2.0
    assert found["cadence_steps_per_min"] == pytest.approx(120.0 * 3.0 / 3.3)
    assert found["stride_time_s"]["left"] == pytest.approx({"mean": 1.1, "cv_percent": 0.2 * sd / 1.1})
    assert found["stride_time_s"]["right"] == {"mean": pytest.approx(1.1), "cv_percent": None}
    assert found["stance_percent"] == pytest.approx({"left": 60.0, "right": 50.0})
    assert found["peak_n"]["left"] == pytest.approx({"mean": 600.0, "cv_percent": 200.0 * sd / 600.0})
    assert found["impulse_n_s"]["left"] == pytest.approx({"mean": 300.0, "cv_percent": 0.0})
    assert found["loading_rate_n_per_s"]["left"] == {"mean": 4000.0, "cv_percent": None}
    assert found["strides"] == {"left": 2, "right": 1}
    # To the left strikes at 1 and 2.2 s from the right ones at 0.5 and 1.6 s; to the right one at 1.6 s from 1 s.
    assert found["step_time_s"]["left"]["mean"] == pytest.approx(0.55)
    assert found["step_time_s"]["right"]["mean"] == pytest.approx(0.6)
    sides = found["right_over_left_percent"]
    assert sides == pytest.approx({
        "stance_time": asymmetry(0.66, 0.55), "step_time": asymmetry(0.55, 0.6), "peak": asymmetry(600.0, 660.0),
        "impulse": asymmetry(300.0, 330.0), "loading_rate": asymmetry(4000.0, 5000.0),
    })  # fmt: skip
    assert found["asymmetry_percent"] == sides["impulse"]
    # Both down: 0.1 s of 1, 0.05 + 0.12 of 1.2, and the right one's: 0.1 + 0.05 of 1.1.
    assert found["double_support_percent"] == pytest.approx(100.0 * (0.1 + 0.17 / 1.2 + 0.15 / 1.1) / 3.0)
    flight = 100.0 * (0.0 + 0.0 + (1.1 - 0.55 - 0.1 - 0.6 + 0.15) / 1.1) / 3.0
    assert found["flight_percent"] == pytest.approx(flight, abs=1e-9)
    # Of three contacts that start strides two come heel, meta4, meta1, toe.
    assert found["order_of_contact"] == ["heel", "meta4", "meta1", "toe"]
    assert found["order_of_contact_percent"] == pytest.approx(200.0 / 3.0)
    assert found["meta4_before_meta1_percent"] == pytest.approx(200.0 / 3.0)


def test_without_impulses_the_asymmetry_is_that_of_the_stance_times_and_has_no_sign() -> None:
    sums = StrideSums(("left", "right"))
    sums.add(*walked(None))
    found = sums.summary()
    assert found["right_over_left_percent"]["impulse"] is None
    assert found["asymmetry_percent"] == pytest.approx(-asymmetry(0.66, 0.55))
    assert found["asymmetry_percent"] > 0.0


def test_nothing_is_summed_up_to_nothing() -> None:
    for feet in (("left",), ("left", "right")):
        found = StrideSums(feet).summary()
        nothing = {foot: {"mean": None, "cv_percent": None} for foot in feet}
        assert found["stride_time_s"] == found["peak_n"] == nothing
        assert found["step_time_s"] == (nothing if len(feet) == 2 else {})
        assert found["stance_percent"] == dict.fromkeys(feet)
        assert found["order_of_contact"] == []
        assert found["strides"] == dict.fromkeys(feet, 0)
        for name in (
            "cadence_steps_per_min", "double_support_percent", "flight_percent", "asymmetry_percent",
            "order_of_contact_percent", "meta4_before_meta1_percent",
        ):  # fmt: skip
            assert found[name] is None


def test_of_orders_as_frequent_the_first_by_name_is_told() -> None:
    onset = [[0.0, 0.1], [1.1, 1.0], [2.0, NAN], [3.0, 3.0]]
    own = contacts([0.0, 1.0, 2.0, 3.0, 4.0], [0.6] * 5, [*onset, [4.0, 4.1]], ("meta4", "meta1"))
    for starts, order, share, earlier in (
        ([0.0, 1.0], ["meta1", "meta4"], 50.0, 50.0), ([0.0, 1.0, 2.0], ["meta1", "meta4"], 50.0, 50.0),
        ([2.0], [], None, None), ([3.0], ["meta4", "meta1"], 100.0, 0.0),
        ([0.0, 3.0, 1.0], ["meta4", "meta1"], 200 / 3, 100 / 3),
    ):  # fmt: skip
        sums = StrideSums(("left",))
        sums.add({"left": own}, [stride(start_s) for start_s in starts])
        found = sums.summary()
        assert found["order_of_contact"] == order
        for name, value in (("order_of_contact_percent", share), ("meta4_before_meta1_percent", earlier)):
            assert found[name] == (None if value is None else pytest.approx(value))
    for regions in (("heel", "meta1"), ("meta4", "heel")):
        sums = StrideSums(("left",))
        sums.add({"left": replace(own, regions=regions)}, [stride(0.0)])
        assert sums.summary()["meta4_before_meta1_percent"] is None


def test_moments_of_few_and_weights_of_nothing() -> None:
    one = Moments()
    one.add([])
    assert (one.count, one.mean, one.squares, one.sd) == (0, 0.0, 0.0, 0.0)
    one.add(7.0 * np.ones(1))
    assert (one.count, one.mean, one.sd) == (1, 7.0, 0.0)
    one.add([9.0, 11.0])
    assert (one.count, one.mean, one.sd) == (3, pytest.approx(9.0), pytest.approx(2.0))
    assert one.spread() == pytest.approx({"mean": 9.0, "cv_percent": 200.0 / 9.0})
    assert weighted_mean([(3.0, 0.25), (5.0, 0.25)]) == 4.0
    assert weighted_mean([(3.0, -1.0)]) is None


def test_means_of_blocks_keep_what_is_left_for_the_next() -> None:
    blocks = BlockMeans(3)
    for values in ([1.0, 2.0], [], [6.0, 4.0], [5.0, 9.0, 7.0]):
        blocks.add(np.array(values))
    assert (blocks.count, blocks.total) == (7, 34.0)
    assert (blocks.means.count, blocks.means.mean) == (2, pytest.approx(4.5))  # of 1, 2, 6 and of 4, 5, 9
