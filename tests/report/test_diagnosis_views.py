"""What the figures of a diagnosis show: cycles, loops, bins, residuals, faults, protocols."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from diagnoses_made import FAULTS, FULL_LOAD_N, LOOPS, case, traces_of
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.models.effects import blocks
from smartshoe.protocol import Protocol
from smartshoe.report.diagnosis._charts import faults, over_cycles, over_time, protocol
from smartshoe.report.diagnosis._protocol_file import protocol_text
from smartshoe.report.diagnosis.grids import ranked
from smartshoe.report.diagnosis.views import binned, edges_of, evidence, loops_at_two_rates, spectrum, worst_cycle


def test_a_block_that_stands_for_a_cause_was_chosen() -> None:
    (block, *_) = blocks()["static_curve"]
    made = replace(case("one cause"), screening=((block.name, 9.0), ("delay", 5.0)))
    assert [bar.kind for bar in ranked(made)] == ["other", "other"]
    stood_for = tuple(replace(cause, part=block.name) for cause in made.causes)
    made = replace(made, causes=stood_for)
    assert [(bar.name, bar.kind) for bar in ranked(made)] == [(block.name, "cause"), ("delay", "other")]


def test_what_stays_in_the_model_without_a_name_is_not_told_as_left_out() -> None:
    made = replace(case("one cause"), screening=(("warm_up", 9.0), ("delay", 5.0)), minor=("warm_up",))
    assert [bar.says for bar in ranked(made)] == ["in the extended model, without a name", "not chosen"]
    named = replace(made.causes[0], equivalents=("warm_up",))
    assert ranked(replace(made, causes=(named,)))[0].kind == "equivalent"


def test_faults_are_drawn_over_the_recording_that_has_them() -> None:
    """The first that was given was left out: it has no trace."""
    (trace, _) = case("one cause").traces
    made = replace(case("one cause"), traces=(replace(trace, recording=1),), data_faults=FAULTS)
    assert [chart.title for chart in faults(made)] == ["triangles_2"]


def test_a_protocol_becomes_a_table_that_toml_reads_back() -> None:
    steps = Protocol('odd "name" 1', LOOPS.segments)
    table = tomllib.loads(protocol_text(steps, ["why\nit is run " * 30]))["protocol"]["odd_name_1"]
    assert table["kind"] == "segments"
    time_s, load_n = LOOPS.corners()
    np.testing.assert_allclose(np.array(table["corners"]), np.column_stack([time_s, load_n]))


def test_a_protocol_of_seconds_is_told_in_seconds() -> None:
    assert protocol(LOOPS).says == "8 s, up to 400 N."


def test_cycles_that_count_on_from_fitted_recordings_are_told_to() -> None:
    found = evidence(case("two causes").traces, FULL_LOAD_N)
    assert found is not None
    drawn = over_cycles(found, "mbar")
    assert drawn is not None
    assert drawn.x[0] > 1
    assert drawn.says.endswith("Numbers count on through all recordings; those that were fitted are not shown.")
    drawn = over_cycles(replace(found, held_out=np.zeros_like(found.held_out)), "mbar")
    assert drawn is not None
    assert drawn.x[0] == 1
    assert drawn.says.endswith("Numbers count on through all recordings.")


def test_the_worst_cycle_is_the_one_with_the_largest_error_among_those_held_out() -> None:
    traces = traces_of((), (), 0.02)
    found = worst_cycle(traces)
    assert found is not None
    assert found.trace is traces[1]
    error = (found.trace.reading - found.trace.baseline) ** 2
    means = [float(error[found.trace.cycle == k].mean()) for k in range(int(found.trace.cycle.max()) + 1)]
    assert float(error[found.span].mean()) == pytest.approx(max(means))


def test_loops_are_taken_at_the_slowest_and_the_fastest_rate() -> None:
    rates = [rate for rate, _ in loops_at_two_rates(traces_of((), ()))]
    assert rates == [pytest.approx(100, rel=0.05), pytest.approx(800, rel=0.1)]


def test_bins_keep_the_mean_and_the_spread() -> None:
    x = np.linspace(0.0, 1.0, 10_001)
    noise = np.random.default_rng(0).normal(0.0, 0.1, x.size)
    found = binned(x, 2.0 * x + noise, edges_of(x, 20))
    np.testing.assert_allclose(found.mean, 2.0 * found.x, atol=5 * 0.1 / math.sqrt(500))
    np.testing.assert_allclose(found.sd, math.hypot(0.1, 2 * 0.05 / math.sqrt(12)), rtol=0.2)


def test_a_tone_stands_at_its_frequency_whatever_rates_recordings_have() -> None:
    first, second = traces_of((), ())
    columns = ("time_s", "load_n", "reading", "baseline", "extended", "usable", "held_out", "cycle")
    every = {name: getattr(second, name)[::5] for name in columns}
    for traces in ((first, second), (first, replace(second, **every)), (replace(second, **every), first)):
        found = evidence(traces, FULL_LOAD_N)
        assert found is not None
        own = np.concatenate([one.time_s - one.time_s[0] for one in traces])
        tone = np.sin(2.0 * np.pi * 2.0 * own)
        frequency, density = spectrum(found, tone + 1e-3 * np.random.default_rng(1).standard_normal(own.size))
        loud = density > 0.1 * density.max()
        assert frequency[loud] == pytest.approx(2.0, rel=0.1)
        assert frequency.max() == pytest.approx(25.0, rel=0.1)  # as far as the faster one's goes


def test_residuals_run_on_from_recording_to_recording() -> None:
    traces = traces_of((), ())
    found = evidence(traces, FULL_LOAD_N)
    assert found is not None
    assert np.all(np.diff(found.time_s) >= 0)
    assert found.cycle.max() == sum(int(trace.cycle[-1]) + 1 for trace in traces) - 1
    assert found.judged.sum() == traces[1].time_s.size
    assert set(np.unique(found.direction)) == {-1, 0, 1}


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=5, max_size=60).filter(lambda x: max(x) - min(x) > 1e-6),
    st.floats(-10.0, 10.0),
)
def test_bins_of_a_constant_are_that_constant(x: list[float], level: float) -> None:
    found = binned(np.array(x), np.full(len(x), level), edges_of(np.array(x), 4))
    filled = np.isfinite(found.mean)
    np.testing.assert_allclose(found.mean[filled], level, atol=1e-12)
    np.testing.assert_allclose(found.sd[filled], 0.0, atol=1e-6)


def test_few_samples_fall_into_few_bins_and_are_seen() -> None:
    """Of a hundred that are judged, half of them while the load rises, most bins have enough for a mean."""
    x = np.random.default_rng(3).uniform(0.0, 1.0, 100)
    edges = edges_of(x)
    assert edges.size - 1 == 5
    assert np.isfinite(binned(x[::2], x[::2], edges).mean).all()
    assert edges_of(np.linspace(0.0, 1.0, 10_000)).size - 1 == 24
    assert edges_of(x[:8]).size - 1 == 4


@pytest.mark.parametrize(("left_out", "gaps"), [(slice(0, 0), 0), (slice(200, 203), 0), (slice(200, 300), 1)])
def test_the_error_over_time_is_broken_where_samples_are_left_out_for_as_long_as_is_seen(
    left_out: slice, gaps: int
) -> None:
    trace, _ = traces_of(("leak",), ("leak",))
    usable = trace.usable.copy()
    usable[left_out] = False
    found = evidence([replace(trace, usable=usable)], FULL_LOAD_N)
    assert found is not None
    for panel in over_time(found, "mbar").panels:
        for line in panel.lines:
            assert np.count_nonzero(np.isnan(line.values)) == gaps
