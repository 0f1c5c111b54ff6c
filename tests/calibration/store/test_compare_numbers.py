"""What a comparison says in numbers, each beside the one that the transfer functions give on paper."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lives import LEFT_TOE, SDS, calibration, covariance_of
from scipy.stats import chi2

from smartshoe.calibration import Calibration, extended_calibration
from smartshoe.calibration.store.compare import (
    RATES_N_PER_S,
    Comparison,
    ForceDifference,
    ParameterDifference,
    compare,
)
from smartshoe.calibration.store.quantities import (
    coefficient_covariance,
    quantities,
    require_one_reading_unit,
    top_load_n,
)
from smartshoe.errors import UsageError
from smartshoe.models.effects import effect
from smartshoe.models.parameter import Parameter
from smartshoe.units import VOLT

A1, B0, B1 = LEFT_TOE
TOP_N = 800.0


def parameter(value: float, sd: float = 0.0) -> Parameter:
    return Parameter.from_sd(value, sd, "N")


# -- what is followed ----------------------------------------------------------------------------------------------
def test_the_static_gain_and_its_sd_are_those_of_a_quotient() -> None:
    made = calibration((0.5, 9.0, 2.0), offset=-3.0)
    found = quantities(made)
    assert list(found) == ["static_gain", "a1", "b0", "b1", "zero"]
    assert [one.value for one in found.values()] == [4.0, 0.5, 9.0, 2.0, -3.0]
    assert [one.unit for one in found.values()] == ["N/mbar", "1/s", "N/mbar", "N/(mbar s)", "mbar"]
    # d(b1/a1) = -b1/a1^2 da1 + 1/a1 db1 = -8 da1 + 2 db1, and the two go together by 0.95.
    variance = (8.0 * SDS[0]) ** 2 + (2.0 * SDS[2]) ** 2 - 2.0 * 16.0 * 0.95 * SDS[0] * SDS[2]
    assert found["static_gain"].sd == pytest.approx(math.sqrt(variance))
    assert [found[name].sd for name in ("a1", "b0", "b1")] == pytest.approx(SDS)
    assert math.isnan(found["zero"].sd)


def test_coefficients_without_errors_are_followed_by_their_values() -> None:
    made = replace(calibration((0.5, 9.0, 2.0), has_errors=False), reading_unit=VOLT)
    found = quantities(made)
    assert [(one.value, one.unit) for one in found.values()] == [
        (4.0, "N/V"), (0.5, "1/s"), (9.0, "N/V"), (2.0, "N/(V s)"), (0.0, "V"),
    ]  # fmt: skip
    assert all(math.isnan(one.sd) for one in found.values())


def test_a_covariance_is_found_by_the_names_of_its_parameters() -> None:
    made = calibration()
    a1, b0, b1 = made.parameters.values()
    order = {"b1": b1, "c": parameter(1.0), "a1": a1, "b0": b0}
    rows = np.zeros((4, 4))
    keep = np.ix_([2, 3, 0], [2, 3, 0])
    rows[keep] = covariance_of()
    mixed = replace(made, parameters=order, covariance=tuple(map(tuple, rows)))
    assert coefficient_covariance(mixed) == pytest.approx(covariance_of())
    for place, value in (((0, 2), math.nan), ((2, 2), 0.0), ((2, 2), -1e-9), ((3, 3), math.inf)):
        broken = rows.copy()
        broken[place] = value
        assert coefficient_covariance(replace(mixed, covariance=tuple(map(tuple, broken)))) is None
    for other in ({"covariance": ()}, {"parameters": {"a1": a1, "b0": b0, "c": b1, "d": b1}}):
        assert coefficient_covariance(replace(mixed, **other)) is None


def test_readings_of_one_unit_are_required() -> None:
    volt = replace(calibration(), reading_unit=VOLT)
    require_one_reading_unit([])
    require_one_reading_unit([volt, volt])
    with pytest.raises(UsageError, match="are of readings in V and mbar, which do not compare"):
        require_one_reading_unit([calibration(), volt, volt])


def test_the_load_that_all_have_seen_is_their_least_top() -> None:
    tops = [replace(calibration(), load_range_n=span) for span in ((0.0, 700.0), (-5.0, 650.0), (-9.0, -1.0), None)]
    assert top_load_n(tops) == 650.0
    assert top_load_n(tops[:1]) == 700.0
    assert top_load_n(tops[2:]) == 800.0


# -- parameters ----------------------------------------------------------------------------------------------------
def test_a_difference_is_of_the_second_less_the_first_in_sds_and_percent() -> None:
    one = ParameterDifference("a1", parameter(-4.0, 0.3), parameter(-3.0, 0.4), 1.0, 0.5)
    assert (one.in_sd, one.percent) == (2.0, 25.0)
    assert one.to_dict() == {
        "first": parameter(-4.0, 0.3).to_dict(), "second": parameter(-3.0, 0.4).to_dict(), "difference": 1.0,
        "sd": 0.5, "in_sd": 2.0, "percent": 25.0,
    }  # fmt: skip
    unknown = replace(one, sd=math.nan, first=parameter(0.0))
    assert math.isnan(unknown.in_sd)
    assert math.isnan(unknown.percent)
    assert [unknown.to_dict()[key] for key in ("sd", "in_sd", "percent")] == [None, None, None]


def test_every_parameter_that_both_have_is_compared() -> None:
    first, second = calibration((0.2, 10.0, 2.0), offset=1.0), calibration((0.25, 9.0, 2.2), offset=4.0, sd_share=2.0)
    second = replace(second, parameters={**second.parameters, "c": parameter(1.0)})
    found = {one.name: one for one in compare(first, second).parameters}
    assert list(found) == ["static_gain", "a1", "b0", "b1", "zero"]
    for name, change in (("static_gain", -1.2), ("a1", 0.05), ("b0", -1.0), ("b1", 0.2), ("zero", 3.0)):
        assert found[name].difference == pytest.approx(change)
        assert found[name].first.to_dict() == quantities(first)[name].to_dict()
        assert found[name].second.to_dict() == quantities(second)[name].to_dict()
    for name, sd in zip(("a1", "b0", "b1"), SDS, strict=True):
        assert found[name].sd == pytest.approx(math.sqrt(5.0) * sd)  # once, and twice as wide


def test_zeros_differ_in_newtons_by_the_first_ones_gain() -> None:
    first, second = calibration((0.2, 10.0, 2.0), offset=1.0), calibration((0.25, 9.0, 5.0), offset=4.0)
    assert compare(first, second).zero_difference_n == pytest.approx(3.0 * 10.0)
    assert compare(second, first).zero_difference_n == pytest.approx(-3.0 * 20.0)


# -- forces --------------------------------------------------------------------------------------------------------
def faster(share: float, rate_n_per_s: float, at_s: np.ndarray) -> np.ndarray:
    """share b0 s/(b0 s + b1) of a triangle's load: what a larger b0 alone adds to the force, in N."""
    pole, top_s = B1 / B0, TOP_N / rate_n_per_s
    level = share * rate_n_per_s / pole
    up = level * (1.0 - np.exp(-pole * at_s))
    turn = level * (1.0 - math.exp(-pole * top_s))
    down = -level + (turn + level) * np.exp(-pole * (at_s - top_s))
    return np.where(at_s <= top_s, up, down)


@pytest.mark.parametrize("share", [0.02, -0.02])
@pytest.mark.parametrize("rate_n_per_s", [50.0, 200.0, 800.0])
def test_a_larger_fast_gain_adds_what_a_high_pass_lets_through(share: float, rate_n_per_s: float) -> None:
    (found,) = compare(calibration(), calibration((A1, (1.0 + share) * B0, B1)), (rate_n_per_s,)).forces
    at_s = np.linspace(0.0, 2.0 * TOP_N / rate_n_per_s, 20001)
    true = faster(share, rate_n_per_s, at_s)
    worst = int(np.argmax(np.abs(true)))
    # A triangle of 801 samples with straight lines between them.
    assert found.rate_n_per_s == rate_n_per_s
    assert found.largest_n == pytest.approx(true[worst], rel=2e-4)
    assert found.at_load_n == pytest.approx(TOP_N - abs(at_s[worst] * rate_n_per_s - TOP_N), abs=2.1)
    assert found.rms_n == pytest.approx(math.sqrt(np.mean(true**2)), rel=2e-3)


def test_a_change_of_gain_has_the_rms_of_a_triangle() -> None:
    for item in compare(calibration(), calibration((A1, 1.03 * B0, 1.03 * B1))).forces:
        assert item.largest_n == pytest.approx(24.0, rel=1e-6)
        assert item.at_load_n == pytest.approx(TOP_N, rel=1e-12)
        assert item.rms_n == pytest.approx(24.0 / math.sqrt(3.0), rel=2e-3)  # of 801 samples


@pytest.mark.parametrize("gain", [1.01, 0.97])
@pytest.mark.parametrize("rate_n_per_s", [50.0, 400.0])
@pytest.mark.parametrize("shares", [(1.0, 1.0), (1.0, 3.0), (2.0, 1.0)])
def test_the_sd_at_the_top_is_that_of_both_units_errors(
    gain: float, rate_n_per_s: float, shares: tuple[float, float]
) -> None:
    first, second = (
        calibration((A1, g * B0, g * B1), sd_share=share) for g, share in zip((1.0, gain), shares, strict=True)
    )
    (found,) = compare(first, second, (rate_n_per_s,)).forces
    pole, t = B1 / B0, TOP_N / rate_n_per_s

    def lagged(rate_per_s: float) -> float:
        """load/(s + rate) at the top of the ramp."""
        return rate_n_per_s / rate_per_s**2 * (rate_per_s * t - 1.0 + math.exp(-rate_per_s * t))

    # Of force_2 = gain load: dF/da1 = -gain load/(s + a1), dF/db0 = s load/(b0 s + b1), dF/db1 = load/(b0 s + b1).
    ramp = rate_n_per_s / (B0 * pole) * (1.0 - math.exp(-pole * t))
    slope = np.array([-gain * lagged(A1), ramp, lagged(pole) / B0])
    # The first one's errors change the reading: the same, times the gain where it is not in yet, the other way.
    mirrored = np.array([gain * lagged(A1), -gain * ramp, -gain * lagged(pole) / B0])
    variance = slope @ covariance_of(shares[1]) @ slope + mirrored @ covariance_of(shares[0]) @ mirrored
    assert found.at_load_n == pytest.approx(TOP_N)
    assert found.sd_n == pytest.approx(math.sqrt(variance), rel=2e-3)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_what_is_told_in_newtons_does_not_know_the_unit_of_the_readings(scale: float) -> None:
    """Of a reading whose numbers are so many times smaller both gains are so many times larger."""
    row = np.array([1.0, scale, scale])
    pairs = []
    for factor in (1.0, 1.01):
        made = calibration((A1, factor * B0, factor * B1))
        covariance = tuple(map(tuple, np.outer(row, row) * covariance_of()))
        pairs.append((made, replace(made, b0=scale * made.b0, b1=scale * made.b1, covariance=covariance)))
    (plain,), (scaled,) = (compare(*pair, (200.0,)).forces for pair in zip(*pairs, strict=True))
    assert scaled.sd_n == pytest.approx(plain.sd_n, rel=1e-4)
    assert scaled.largest_n == pytest.approx(plain.largest_n)


def test_a_load_may_come_as_slowly_as_it_likes() -> None:
    (found,) = compare(calibration(), calibration((A1, 1.03 * B0, 1.03 * B1)), (0.5,)).forces
    assert (found.rate_n_per_s, found.largest_n) == (0.5, pytest.approx(24.0, rel=1e-3))


def test_where_one_has_no_covariance_no_sd_is_told() -> None:
    bare = calibration(has_errors=False)
    for pair in ((bare, calibration()), (calibration(), bare), (bare, bare)):
        found = compare(*pair)
        assert math.isnan(found.p_value)
        assert all(math.isnan(item.sd_n) for item in found.forces)
        assert found.forces[0].to_dict()["sd_n"] is None
        assert found.says.startswith("forces differ by up to ")
        assert found.says.endswith(
            "; whether that is more than their errors cannot be told: one of them has no covariance"
        )


def test_without_other_rates_the_papers_are_compared() -> None:
    found = compare(calibration(), calibration())
    assert [item.rate_n_per_s for item in found.forces] == list(RATES_N_PER_S)
    assert RATES_N_PER_S == (50.0, 100.0, 200.0, 400.0, 600.0, 800.0)
    assert found.top_load_n == TOP_N
    assert [item.rate_n_per_s for item in compare(calibration(), calibration(), (3.0, 7.0)).forces] == [3.0, 7.0]


def test_a_chance_is_that_of_a_chi_square_of_three() -> None:
    theta = np.array(LEFT_TOE)
    for shares, change in (
        ((1.0, 1.0), (1.0, 0.0, 0.0)),
        ((1.0, 2.0), (0.5, -1.0, 2.0)),
        ((0.5, 1.0), (0.0, 1.5, 0.1)),
    ):
        difference = np.array(change) * np.array(SDS)
        both = covariance_of(shares[0]) + covariance_of(shares[1])
        distance = difference @ np.linalg.solve(both, difference)
        second = calibration(tuple(theta + difference), sd_share=shares[1])
        found = compare(calibration(sd_share=shares[0]), second, (200.0,))
        assert found.p_value == pytest.approx(chi2.sf(distance, 3), rel=1e-6)


def test_a_comparison_is_told_whole() -> None:
    found = compare(calibration(), calibration((A1, 0.98 * B0, B1), offset=2.0), (100.0, 400.0))
    told = found.to_dict()
    assert told == {
        "schema": "smartshoe.comparison/1",
        "parameters": {item.name: item.to_dict() for item in found.parameters},
        "forces": [
            {name: getattr(item, name) for name in ("rate_n_per_s", "rms_n", "largest_n", "at_load_n", "sd_n")}
            for item in found.forces
        ],
        "top_load_n": 800.0, "zero_difference_n": found.zero_difference_n, "p_value": found.p_value,
        "says": found.says,
    }  # fmt: skip
    unknown = Comparison((), (ForceDifference(1.0, 2.0, 3.0, 4.0, math.nan),), 800.0, 0.0, math.nan, "so").to_dict()
    assert (unknown["p_value"], unknown["forces"][0]["sd_n"]) == (None, None)


@pytest.mark.parametrize(("chance", "says"), [(0.9e-4, "less than 1 in 10,000"), (1.1e-4, "0.011 %"), (9e-3, "0.9 %")])
def test_a_chance_is_said_in_percent_down_to_a_hundredth(chance: float, says: str) -> None:
    # A chi-square of three, of one parameter's change: it grows as the square of that.
    one = chi2.isf(compare(calibration(), calibration((A1, B0 + SDS[1], B1)), (200.0,)).p_value, 3)
    change = math.sqrt(chi2.isf(chance, 3) / one) * SDS[1]
    found = compare(calibration(), calibration((A1, B0 + change, B1)), (200.0,))
    assert found.p_value == pytest.approx(chance, rel=1e-3)
    assert found.says.startswith(f"the unit has changed between the two (chance of errors alone: {says}): forces")


# -- effects -------------------------------------------------------------------------------------------------------
def extended(made: Calibration, **effects: list[float]) -> Calibration:
    model = made.model()
    for name, theta in effects.items():
        model = model.with_part(effect(name), np.array(theta))
    return extended_calibration(model, load_range_n=(0.0, 800.0))


@pytest.mark.parametrize("rate_n_per_s", [100.0, 400.0])
def test_of_extended_calibrations_the_forces_differ_as_their_coefficients_do(rate_n_per_s: float) -> None:
    first, second = calibration(), calibration((A1, 1.05 * B0, B1))
    (plain,) = compare(first, second, (rate_n_per_s,)).forces
    for pair in ((extended(first), second), (first, extended(second)), (extended(first), extended(second))):
        (found,) = compare(*pair, (rate_n_per_s,)).forces
        # Two ways to discretise one filter: half a sample of 1/400 of the ramp.
        assert found.largest_n == pytest.approx(plain.largest_n, rel=0.01)
        assert found.rms_n == pytest.approx(plain.rms_n, rel=0.01)
        assert math.isnan(found.sd_n)
