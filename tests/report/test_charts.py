"""Charts as numbers: extremes are kept, the page's budget holds, what is packed comes back."""

from __future__ import annotations

import base64
import json

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from smartshoe.report.charts import PAGE_BYTES, STEPS, Chart, Line, Panel, packed, reduced, script_text, shares

FINITE = st.floats(-1e6, 1e6, allow_subnormal=False)


def chart(samples: int, lines: int = 1) -> Chart:
    x = np.arange(samples, dtype=float)
    return Chart("t", "s", "x", x, [Panel("y", [Line(f"{k}", np.sin(x + k), "raw") for k in range(lines)])])


@given(arrays(float, st.integers(2, 3000), elements=FINITE), st.integers(50, 500))
def test_reduction_keeps_both_extremes_the_ends_and_the_order(values: np.ndarray, most: int) -> None:
    index = reduced(np.arange(values.size, dtype=float), [values], most)
    assert values[index].max() == values.max()
    assert values[index].min() == values.min()
    assert index[0] == 0
    assert index[-1] == values.size - 1
    assert (np.diff(index) > 0).all()
    assert index.size <= max(most, values.size if values.size <= most else most) + 4


def test_an_extreme_of_any_line_is_kept() -> None:
    x = np.arange(10_000.0)
    first, second = np.sin(x / 500), np.zeros(10_000)
    second[4321] = 7.0
    assert 4321 in reduced(x, [first, second], 600)


@given(st.lists(st.integers(10, 200_000), min_size=1, max_size=40))
@settings(max_examples=30)
def test_charts_share_the_page_and_small_ones_stay_whole(sizes: list[int]) -> None:
    charts = [chart(size) for size in sizes]
    allowed = shares(charts)
    assert sum(n * c.bytes_of_point for n, c in zip(allowed, charts, strict=True)) <= PAGE_BYTES
    whole = min(sizes) * charts[0].bytes_of_point * len(sizes) <= PAGE_BYTES
    assert not whole or allowed[sizes.index(min(sizes))] == min(sizes)


@given(arrays(float, st.integers(1, 50), elements=st.one_of(FINITE, st.just(float("nan")))))
def test_what_is_packed_comes_back_to_a_step_of_its_range_and_gaps_stay_gaps(values: np.ndarray) -> None:
    x = np.arange(values.size, dtype=float)
    made = packed(Chart("t", "s", "x", x, [Panel("y", [Line("l", values, "raw")])]), 1000)
    y = made["panels"][0]["lines"][0]["y"]
    steps = np.frombuffer(base64.b64decode(y["steps"]), dtype="<i2").astype(float)
    back = np.where(steps == -32768, np.nan, y["middle"] + steps * y["step"])
    there = np.isfinite(values)
    assert (np.isfinite(back) == there).all()
    if there.any():
        span = float(np.ptp(values[there]))
        assert np.abs(back[there] - values[there]).max() <= 0.51 * span / STEPS + 1e-9 * np.abs(values[there]).max()


def test_what_is_seen_at_first_is_whole_and_a_weight_takes_from_the_others() -> None:
    x = np.arange(200_000.0)
    long = Chart("t", "s", "x", x, [Panel("y", [Line("l", np.sin(x), "raw")])], window=(-50.0, 99.5), weight=3.0)
    made = packed(long, 2000)
    kept = np.frombuffer(base64.b64decode(made["x"]), dtype="<f4")
    assert kept[:100].tolist() == list(range(100))
    assert kept.size < 2100
    assert made["window"] == (0.0, 99.5)
    other = chart(200_000)
    heavy, light = shares([long, other])
    assert light * 2.9 < heavy < light * 3.1


def test_a_name_cannot_end_the_script() -> None:
    x = np.arange(3.0)
    text = script_text([Chart("</script><b>", "s", "x", x, [Panel("y", [Line("</script>", x, "raw")])])])
    assert "<" not in text
    assert json.loads(text)[0]["title"] == "</script><b>"
