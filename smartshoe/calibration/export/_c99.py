"""Target ``c``: a C99 filter without allocation, its self-test and test vector."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from smartshoe.calibration.export._blocks import described
from smartshoe.calibration.export._cost import cost_lines
from smartshoe.calibration.export._fixed_chain import RUN, FixedChain, IntegerChain
from smartshoe.calibration.export._fixed_point import FixedPoint, FixedVector, IntegerFilter
from smartshoe.calibration.export._model import ExtendedFilterModel, FilterModel, one_safe_line
from smartshoe.calibration.export._rendering import columns_csv, finite_or, render, vector_csv
from smartshoe.calibration.export._single import in_single
from smartshoe.errors import UsageError

Files = dict[str, str]


def c_files(model: FilterModel, precision: str = "double", fixed: str | None = None, *, apart: bool = False) -> Files:
    """NAME.h and NAME.c, a self-test's main and the test vector: file name to text.

    In ``double`` the code runs the recursion of `Compensator`, with the same rounding. In ``float`` it runs direct term
    plus state: the slow part has coefficients of its own, which single precision holds to seven digits, where 1 + den1
    would keep four, and the rounding error of each sum is carried to the next. ``fixed`` ("q15", "q31") selects
    `FixedPoint`. ``apart`` puts the test into a folder of its own, so that all C files of the folder link into one
    program. Raises `UsageError` where a coefficient exceeds the range of the arithmetic.
    """
    if fixed is not None:
        return _fixed(model, fixed, apart)
    shared = _floating(model, precision)
    if isinstance(model, ExtendedFilterModel):
        if precision == "float" and model.is_steep:
            return _files(model, "steep_extended", apart, **shared, **_steep(model))
        return _files(model, model.kind, apart, **shared, **_extended(model, precision))
    n0, n1 = model.numerator
    values = {"n0": n0, "n1": n1, "d1": model.denominator[1], "leak": model.leak, "feed": model.feed}
    values |= {"state_gain": model.state_gain, "offset": model.calibration.offset}
    literals = {name: _literal(value, precision, name) for name, value in values.items()}
    return _files(model, model.kind, apart, c=literals, **shared)


def _files(model: FilterModel, kind: str, apart: bool, *, vector: str, **values: object) -> Files:
    name = model.name
    source = render(f"{kind}.c.j2", model, **values)
    head = {"fixed_extended": "fixed_point", "steep_extended": "extended"}.get(kind, kind) + ".h.j2"
    cost = cost_lines(render(head, model, cost={}, **values), source)
    folder, header = ("self_test/", f"../{name}.h") if apart else ("", f"{name}.h")
    return {
        f"{name}.h": render(head, model, cost=cost, **values),
        f"{name}.c": source,
        f"{folder}{name}_test.c": render("filter_test.c.j2", model, header=header, **values),
        f"{folder}{name}_test.csv": vector,
    }


def _floating(model: FilterModel, precision: str) -> dict[str, Any]:
    """Template values shared by double and float."""
    readings = [
        finite_or(value, "NAN", "INFINITY", "" if not np.isfinite(value) else _literal(value, precision, "reading"))
        for value in model.test_readings.tolist()
    ]
    return {
        "real": precision,
        "reading_type": precision,
        "force_factor": "",
        "readings": readings,
        "forces_n": [repr(value) for value in model.test_forces_n.tolist()],
        "tolerance_n": repr(model.tolerance_n(precision)),
        "vector": vector_csv(model),
    }


def _fixed(model: FilterModel, fixed: str, apart: bool) -> Files:
    if isinstance(model, ExtendedFilterModel):
        found_chain = FixedChain.of(model, fixed)
        chain = found_chain.chain
        states = [(name, "counts of the chain") for _, step in chain.blocks for name in step.states]
        said = _counted(chain) | {
            "bound_holds": f"up to full scale and for {RUN} samples",
            "bound_found": " (the latter\n * measured along a walk when this was written, with a margin)",
            "clock_hours": chain.clock and f"{chain.clock[2] / model.sample_rate_hz / 3600.0:.0f}",
        }
        return _files(model, "fixed_extended", apart, **_integers(model, found_chain, states), **said)
    found = FixedPoint.of(model, fixed)
    states = [("state", f"steps of force times 2^{found.fraction}")]
    plain: dict[str, Any] = {"bound_holds": "within the range", "bound_found": "", "clock_hours": None}
    return _files(model, "fixed_point", apart, **_integers(model, found, states), **plain)


def _integers(model: FilterModel, found: IntegerFilter, states: list[tuple[str, str]]) -> dict[str, Any]:
    """Template values shared by the fixed-point kinds."""
    vector = FixedVector(model, found)
    low, high = -found.most - 1, found.most
    columns = {
        "reading_steps": vector.steps,
        f"reading_{model.calibration.reading_unit.suffix}": vector.steps * found.input_lsb,
        "force_n": vector.forces_n,
    }
    return {
        "fixed": found,
        "states": states,
        "reading_type": found.integer,
        "force_factor": f"{found.output_lsb!r} * ",
        "readings": [str(step) for step in vector.steps.tolist()],
        "forces_n": [repr(value) for value in vector.forces_n.tolist()],
        "tolerance_n": repr(found.rounding_n),
        "vector": columns_csv(model, columns),
        "unit_symbol": one_safe_line(model.calibration.reading_unit.symbol),
        "input_lsb": repr(found.input_lsb),
        "output_lsb": repr(found.output_lsb),
        "low_reading": f"{low * found.input_lsb:g}",
        "high_reading": f"{high * found.input_lsb:g}",
        "low_force": f"{low * found.output_lsb:g}",
        "high_force": f"{high * found.output_lsb:g}",
        "rounding_n": f"{_rounded_up(found.rounding_n)!r}",
        "error_bound_n": f"{_rounded_up(found.error_bound_n)!r}",
    }


def _rounded_up(value: float) -> float:
    """``value`` rounded up to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit) * unit:.3g}")


def _counted(chain: IntegerChain) -> dict[str, Any]:
    """Template values of a chain in integers."""
    return {
        "chain": chain,
        "blocks": described(chain.blocks),
        "counts": {name: value for _, step in chain.blocks for name, value in step.states.items()},
    }


def _steep(model: ExtendedFilterModel) -> dict[str, Any]:
    """Template values where blocks are so steep that floats between them would lose too much."""
    chain = IntegerChain.of(model.filter)
    factor, above = chain.entry
    return {
        **_counted(chain),
        "states": [name for _, step in chain.blocks for name in step.states],
        "state_type": "int64_t",
        "arithmetic": "float in and out; between, where this chain is too steep for floats, integers (int64_t)",
        "largest_reading": _literal(32.0 * 2.0**above, "float", "full_scale_reading"),
        "into_counts": _literal(2.0 ** (chain.fraction - above), "float", "full_scale_reading"),
        "entry_factor": f"INT64_C({factor})" if factor > 0 else f"-INT64_C({-factor})",
        "out_of_counts": _literal(2.0 ** (chain.leaving[1] - chain.fraction), "float", "full_scale_load_n"),
        "started_s": f"{model.filter.started_s:g}",
    }


def _extended(model: ExtendedFilterModel, precision: str) -> dict[str, Any]:
    """Template values of the extended filter, beside the shared ones."""
    filter_ = model.filter
    single = precision == "float"
    blocks = filter_.c_steps(single=single)
    if single:
        blocks = tuple((name, in_single(step)) for name, step in blocks)
    states = {name: _initial(value, precision) for _, step in blocks for name, value in step.states.items()}
    return {
        "states": states,
        "state_type": precision,
        "arithmetic": precision,
        "blocks": described(blocks),
        "reading_per_share": _literal(filter_.reading_per_share, precision, "full_scale_reading"),
        "full_scale_load_n": _literal(filter_.model.full_scale_load_n, precision, "full_scale_load_n"),
        "step_s": _literal(filter_.step_s, precision, "sample time"),
        "started_s": _literal(filter_.started_s, precision, "started_s"),
    }


def _initial(value: float, precision: str) -> str:
    return finite_or(value, "NAN", "INFINITY", _literal(value, precision, "a state") if np.isfinite(value) else "")


def _literal(value: float, precision: str, name: str) -> str:
    """``value`` as a C constant of ``precision`` in full; raises `UsageError` beyond the largest float."""
    if precision == "double":
        return repr(float(value))
    if abs(value) > float(np.finfo(np.float32).max):
        raise UsageError(f"{name} = {value:g} is beyond single precision: export with --precision double")
    return f"{np.float32(value)!s}f"
