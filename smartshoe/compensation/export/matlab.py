"""Target ``matlab``: a function for MATLAB and Octave, its self-check and test vector."""

from __future__ import annotations

from smartshoe.compensation.export.model import FilterModel
from smartshoe.compensation.export.rendering import finite_or, render, vector_csv


def matlab_files(model: FilterModel) -> dict[str, str]:
    """smartshoe_filter.m, smartshoe_filter_test.m and the test vector, file name to text; double precision."""
    shared = {
        "readings": [finite_or(value, "NaN", "Inf", repr(value)) for value in model.test_readings.tolist()],
        "forces_n": [repr(value) for value in model.test_forces_n.tolist()],
        "tolerance_n": repr(model.tolerance_n("double")),
    }
    return {
        "smartshoe_filter.m": render(f"{model.kind}.m.j2", model, **shared),
        "smartshoe_filter_test.m": render("filter_test.m.j2", model, **shared),
        "smartshoe_filter_test.csv": vector_csv(model),
    }
