"""Target ``c``: a C99 filter without allocation, its self-test and test vector."""

from __future__ import annotations

import re

import numpy as np

from smartshoe.compensation.export.model import ExtendedFilterModel, FilterModel
from smartshoe.compensation.export.rendering import finite_or, render, vector_csv
from smartshoe.errors import UsageError


def c_files(model: FilterModel, precision: str) -> dict[str, str]:
    """smartshoe_filter.h and .c, a self-test's main and the test vector, file name to text.

    In ``double`` the code runs the recursion of `Compensator`, rounding and all. In ``float`` it runs direct term
    plus state: the slow part has coefficients of its own, which single precision holds to seven digits, where
    1 + den1 would keep four, and what each sum rounds away is carried to the next. Raises `UsageError` where a
    coefficient is beyond single precision.
    """
    if isinstance(model, ExtendedFilterModel):
        return _files(model, precision, **_extended(model, precision))
    n0, n1 = model.numerator
    values = {"n0": n0, "n1": n1, "d1": model.denominator[1], "leak": model.leak, "feed": model.feed}
    values |= {"state_gain": model.state_gain, "offset": model.calibration.offset}
    literals = {name: _literal(value, precision, name) for name, value in values.items()}
    return _files(model, precision, c=literals)


def _files(model: FilterModel, precision: str, **values: object) -> dict[str, str]:
    readings = [
        finite_or(value, "NAN", "INFINITY", "" if not np.isfinite(value) else _literal(value, precision, "reading"))
        for value in model.test_readings.tolist()
    ]
    shared = {
        "real": precision,
        "readings": readings,
        "forces_n": [repr(value) for value in model.test_forces_n.tolist()],
        "tolerance_n": repr(model.tolerance_n(precision)),
        **values,
    }
    return {
        "smartshoe_filter.h": render(f"{model.kind}.h.j2", model, **shared),
        "smartshoe_filter.c": render(f"{model.kind}.c.j2", model, **shared),
        "smartshoe_filter_test.c": render("filter_test.c.j2", model, **shared),
        "smartshoe_filter_test.csv": vector_csv(model),
    }


def _extended(model: ExtendedFilterModel, precision: str) -> dict[str, object]:
    """What the templates of the extended filter need beside the shared values."""
    if precision != "double":
        raise UsageError(
            "an extended model is written in double only: its bisections stop at double precision and its memory of"
            " leaks and drifts is lost in single; export with --precision double"
        )
    filter_ = model.filter
    blocks = filter_.c_steps()
    states = {name: _initial(value) for _, step in blocks for name, value in step.states.items()}
    return {
        "states": states,
        "blocks": [
            {"name": name, "body": step.body, "needs_time": _needs_time(step.body)}
            for name, step in blocks
            if step.body
        ],
        "reading_per_share": repr(filter_.reading_per_share),
        "full_scale_load_n": repr(filter_.model.full_scale_load_n),
        "step_s": repr(filter_.step_s),
        "started_s": repr(filter_.started_s),
    }


def _needs_time(body: str) -> bool:
    """Whether a block reads the time ``t``; one may have a local of that name instead."""
    return re.search(r"\bt\b", body) is not None and re.search(r"\bdouble t\b", body) is None


def _initial(value: float) -> str:
    return finite_or(value, "NAN", "INFINITY", repr(float(value)))


def _literal(value: float, precision: str, name: str) -> str:
    """``value`` as a C constant of ``precision`` in full; raises `UsageError` beyond the largest float."""
    if precision == "double":
        return repr(float(value))
    if abs(value) > float(np.finfo(np.float32).max):
        raise UsageError(f"{name} = {value:g} is beyond single precision: export with --precision double")
    return f"{np.float32(value)!s}f"
