"""The grey box: springs and damper fixed or bounded, and whether the paper's form agrees with the data."""

import numpy as np
import pytest
from presses import FIXED, SIX_RATES, TOE, coefficients, press

from smartshoe.errors import RefusedError, UsageError
from smartshoe.identification import consistency_test, identify
from smartshoe.models import X_OVER_NRT
from smartshoe.recording import Recording


@pytest.mark.parametrize("free", [("k1",), ("k2",), ("k1", "k2"), ("k1", "k2", "c"), ("k1", "k2", "x_over_nrt")])
@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_any_part_of_the_solid_can_be_fixed(free: tuple[str, ...], direction: str) -> None:
    truth = dict(zip(("k1", "k2", "c", "x_over_nrt"), (*TOE, X_OVER_NRT), strict=True))
    noise = {"load_noise": 1.0} if direction == "inverse" else {"reading_noise": 1.0}
    found = identify(
        press(**noise),
        direction=direction,
        structure="grey_box",
        fixed={name: value for name, value in truth.items() if name not in free},
    )
    for name in ("k1", "k2", "c"):
        parameter = found.parameters[name]
        assert (parameter.sd > 0) == (name in free)
        assert abs(parameter.value - truth[name]) <= 5 * parameter.sd


@pytest.mark.parametrize("method", ["gn", "lm", "trf"])
def test_a_bound_holds_and_all_methods_end_on_it(method: str) -> None:
    found = identify(press(load_noise=1.0), structure="grey_box", method=method, bounds={"k1": (0.0, 1.2)})
    assert found.parameters["k1"].value == pytest.approx(1.2, abs=1e-9)
    reference = identify(
        press(load_noise=1.0), structure="grey_box", fixed={"k1": 1.2, "c": 1.0, "x_over_nrt": X_OVER_NRT}
    )
    assert found.parameters["k2"].value == pytest.approx(reference.parameters["k2"].value, rel=1e-5)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"fixed": {}}, "fix one"),
        ({"fixed": {"k3": 1.0}}, "k3"),
        ({"fixed": {"c": -1.0}}, "c is fixed"),
        ({"bounds": {"k1": (2.0, 1.0)}}, "k1 is bounded"),
        ({"structure": "free", "fixed": {"c": 1.0}}, "grey box"),
        ({"method": "srivc"}, "srivc"),
    ],
)
def test_wrong_grey_boxes_are_named(wrong: dict[str, object], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        identify(press(), **{"structure": "grey_box", **wrong})


def test_the_papers_form_is_consistent_where_it_holds() -> None:
    clean, rng = press(rates=SIX_RATES, repeats=1), np.random.default_rng(11)
    noisy = (
        Recording.from_arrays(
            time_s=clean.time_s,
            force_n=clean.force_n + 2.23 * rng.standard_normal(len(clean)),
            pressure_mbar=clean.sensor.values,
        )
        for _ in range(40)
    )
    p_values = [identify(recording, **FIXED).consistency.p_value for recording in noisy]
    # Uniform if the test has its size: 40 draws below 0.1 are 4 on average, more than 12 once in 10,000.
    assert 0 <= sum(p < 0.1 for p in p_values) <= 12
    assert min(p_values) > 1e-4


def test_a_damper_that_is_not_one_is_seen() -> None:
    found = identify(press((1.341, 0.215, 1.2), load_noise=2.23, rates=SIX_RATES, repeats=1), **FIXED)
    assert not found.consistency.consistent
    assert "do not agree" in found.consistency.says


# Table 1 of Chinimilli 2016: k1, k2 and the printed filter at 100 Hz, numerator and denominator less its leading 1.
TABLE_1 = {
    "right_toe": (1.873, 0.119, 2.269, -2.267, -0.9988),
    "right_heel": (2.045, 0.159, 2.284, -2.281, -0.9984),
    "left_toe": (1.341, 0.215, 2.224, -2.221, -0.9979),
    "left_heel": (2.025, 0.316, 2.355, -2.349, -0.9968),
}


@pytest.mark.parametrize("unit", TABLE_1)
def test_table_1_is_flagged(unit: str) -> None:
    """The printed springs and the printed filter's gain at high frequency belong to no one solid with c = 1."""
    k1, k2, n0, n1, d1 = TABLE_1[unit]
    a1, static = k2, 1 + k1 * X_OVER_NRT
    # Bilinear at 100 Hz: at z = -1 the filter has the gain b0 of the highest frequency.
    b0 = (n0 - n1) / (1 - d1)
    # The printed digits are the error bars of k2, k1, b0: half a unit in the last place, uniform.
    digits = np.array([0.5e-3, 0.5e-3, 0.5e-3]) / np.sqrt(3)
    jacobian = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [static, a1 * X_OVER_NRT, 0.0]])
    protocol = identify(press(load_noise=2.23, rates=SIX_RATES, repeats=3, rest_s=0.0), **FIXED)
    covariance = jacobian @ np.diag(digits**2) @ jacobian.T + protocol.covariance[:3, :3]
    test = consistency_test((a1, b0, a1 * static), covariance)
    assert not test.consistent
    assert test.k2_from_gains > 3 * test.k2_from_pole


def test_a_grey_box_has_no_consistency_of_its_own() -> None:
    with pytest.raises(RefusedError, match="free"):
        _ = identify(press(load_noise=1.0), structure="grey_box").consistency


def test_the_load_cells_zero_takes_the_constant_where_the_readings_is_known() -> None:
    recording = press(load_noise=0.5, load_offset=7.0)
    found = identify(recording, offset=0.0, load_offset_n="estimate")
    assert found.load_offsets["triangles"].value == pytest.approx(7.0, abs=5 * found.load_offsets["triangles"].sd)
    assert found.offsets["triangles"].sd == 0.0
    forward = identify(
        press(reading_noise=0.5, load_offset=7.0), direction="forward", offset=0.0, load_offset_n="estimate"
    )
    assert forward.load_offsets["triangles"].value == pytest.approx(7.0, abs=5 * forward.load_offsets["triangles"].sd)
    known = identify(recording, offset=0.0, load_offset_n=7.0)
    assert abs(known.parameters["b0"].value - coefficients(*TOE)[1]) < 5 * known.parameters["b0"].sd
    with pytest.raises(UsageError, match="one number"):
        identify(recording, load_offset_n="estimate")
