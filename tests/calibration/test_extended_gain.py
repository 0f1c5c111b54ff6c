"""What the extended filter gains over the identified one: the table of docs/export.md."""

from __future__ import annotations

import numpy as np
import pytest
from export_page import stated

from smartshoe.calibration import ExtendedCompensator
from smartshoe.identification import identify
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Recording

STEP_S = 0.01
BASELINE = ExtendedModel(1.0, 0.15, 0.3, 800.0, 170.0, "mbar")  # the page's own example
STRENGTHS = {"play_hysteresis": 0.02, "linear_leak": 0.005, "gas_compression": 0.2, "sensor_lag": 0.02}


@pytest.mark.parametrize(
    ("row", "names"),
    [("no effect", ()), *((f"`{name}`", (name,)) for name in STRENGTHS), ("all four", tuple(STRENGTHS))],
)
def test_the_pages_table_is_what_the_filters_do(row: str, names: tuple[str, ...]) -> None:
    protocol = dynamic_protocol((200.0, 400.0, 800.0, 1600.0), repeats=2, rest_s=1.0)
    time_s = np.arange(0.0, protocol.duration_s, STEP_S)
    load_n = protocol.load_at(time_s)
    model = BASELINE
    for name in names:
        values = effect(name).start()
        values[0] = STRENGTHS[name]
        model = model.with_part(effect(name), values)
    readings = model.reading(Conditions(time_s, load_n / model.full_scale_load_n, STEP_S))
    readings += 1e-3 * model.full_scale_reading * np.random.default_rng(1).standard_normal(time_s.size)
    found = identify(Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=readings))
    filters = found.compensator(), ExtendedCompensator(model, 1.0 / STEP_S)
    rmse_n = [float(np.sqrt(np.mean((filter_.apply(readings) - load_n) ** 2))) for filter_ in filters]
    print(f"| {row} | {rmse_n[0]:.2g} N | {rmse_n[1]:.2g} N |")
    for column, value in enumerate(rmse_n, start=1):
        assert value == pytest.approx(stated(row, column)[-1], rel=0.05)
