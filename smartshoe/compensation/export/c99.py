"""Target ``c``: a C99 filter without allocation, its self-test and test vector."""

from __future__ import annotations

import numpy as np

from smartshoe.compensation.export.model import FilterModel
from smartshoe.compensation.export.rendering import finite_or, render, vector_csv
from smartshoe.errors import UsageError


def c_files(model: FilterModel, precision: str) -> dict[str, str]:
    """smartshoe_filter.h and .c, a self-test's main and the test vector, file name to text.

    In ``double`` the code runs the recursion of `Compensator`, rounding and all. In ``float`` it runs direct term
    plus state: the slow part has coefficients of its own, which single precision holds to seven digits, where
    1 + den1 would keep four, and what each sum rounds away is carried to the next. Raises `UsageError` where a
    coefficient is beyond single precision.
    """
    n0, n1 = model.numerator
    values = {"n0": n0, "n1": n1, "d1": model.denominator[1], "leak": model.leak, "feed": model.feed}
    values |= {"state_gain": model.state_gain, "offset": model.calibration.offset}
    literals = {name: _literal(value, precision, name) for name, value in values.items()}
    readings = [
        finite_or(value, "NAN", "INFINITY", "" if not np.isfinite(value) else _literal(value, precision, "reading"))
        for value in model.test_readings.tolist()
    ]
    shared = {
        "real": precision,
        "c": literals,
        "readings": readings,
        "forces_n": [repr(value) for value in model.test_forces_n.tolist()],
        "tolerance_n": repr(model.tolerance_n(precision)),
    }
    return {
        "smartshoe_filter.h": render(f"{model.kind}.h.j2", model, **shared),
        "smartshoe_filter.c": render(f"{model.kind}.c.j2", model, **shared),
        "smartshoe_filter_test.c": render("filter_test.c.j2", model, **shared),
        "smartshoe_filter_test.csv": vector_csv(model),
    }


def _literal(value: float, precision: str, name: str) -> str:
    """``value`` as a C constant of ``precision`` in full; raises `UsageError` beyond the largest float."""
    if precision == "double":
        return repr(float(value))
    if abs(value) > float(np.finfo(np.float32).max):
        raise UsageError(f"{name} = {value:g} is beyond single precision: export with --precision double")
    return f"{np.float32(value)!s}f"
