"""Error bars say what they claim: 95 % by Student's t, and a scatter as large as the standard deviation."""

from __future__ import annotations

import numpy as np
import pytest
from presses import press

from smartshoe.identification import identify
from smartshoe.identification._uncertainty import t_quantile
from smartshoe.models import Parameter
from smartshoe.recording import Recording


@pytest.mark.parametrize(
    ("degrees", "quantile"),
    [(1, 12.706), (5, 2.5706), (10, 2.2281), (30, 2.0423), (120, 1.9799), (1000, 1.9623), (1001, 1.9623),
     (10**9, 1.95996)],
)  # fmt: skip
def test_the_quantile_is_that_of_the_printed_table(degrees: int, quantile: float) -> None:
    assert t_quantile(degrees) == pytest.approx(quantile, rel=5e-5)


def test_an_interval_from_a_standard_deviation_alone_is_the_normal_laws() -> None:
    assert Parameter.from_sd(10.0, 2.0, "N").ci95 == pytest.approx((10.0 - 3.919928, 10.0 + 3.919928), abs=1e-6)


def _told(found) -> dict[str, Parameter]:  # type: ignore[no-untyped-def]
    """The springs and the nuisances by name."""
    return {
        **{name: found.parameters[name] for name in ("a1", "b0", "b1", "k1", "k2")},
        "offset": found.offsets["triangles"],
        "delay": found.delay_s,
        "state": found.initial_states["triangles"],
    }


def test_the_scatter_of_every_estimate_is_its_standard_deviation_and_its_interval_is_95_percent() -> None:
    clean = press(rates=(200.0, 800.0), repeats=1, offset=3.0, delay_s=0.004)
    rng = np.random.default_rng(8)
    runs = []
    for _ in range(40):
        noisy = Recording.from_arrays(
            time_s=clean.time_s,
            force_n=clean.force_n + 2.23 * rng.standard_normal(len(clean)),
            pressure_mbar=clean.sensor.values,
            name="triangles",
        )
        runs.append(_told(identify(noisy, method="gn", delay="estimate", initial_state="estimate")))
    for name in runs[0]:
        each = [run[name] for run in runs]
        ratio = np.std([one.value for one in each], ddof=1) / np.mean([one.sd for one in each])
        # The sd of 40 values errs by 11 %: four of those.
        assert ratio == pytest.approx(1.0, abs=0.45), name
        for one in each:
            low, high = one.ci95
            assert (high - low) / (2.0 * one.sd) == pytest.approx(1.961, abs=2e-3), name
            assert 0.5 * (low + high) == pytest.approx(one.value, rel=1e-9, abs=1e-12), name
