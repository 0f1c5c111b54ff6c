"""Target ``json``: every form of the filter as numbers, for tools in any language."""

from __future__ import annotations

from typing import Any

from smartshoe.calibration.export._model import ExtendedFilterModel, FilterModel
from smartshoe.files.atomic import json_text
from smartshoe.models.parameter import finite_or_none

SCHEMA = "smartshoe.export/1"


def json_files(model: FilterModel) -> dict[str, str]:
    """NAME.json, file name to text; numbers in full precision, a missing reading of the test vector as null."""
    calibration = model.calibration
    found: dict[str, Any] = {
        "schema": SCHEMA,
        "unit": calibration.unit,
        "reading_unit": calibration.reading_unit.symbol,
        "force_unit": "N",
        "offset": calibration.offset,
        "sample_rate_hz": model.sample_rate_hz,
        "kind": model.kind,
        "continuous": {"a1": calibration.a1, "b0": calibration.b0, "b1": calibration.b1},
        "discrete": {
            "method": "bilinear",
            "numerator": list(model.numerator),
            "denominator": list(model.denominator),
            "static_gain": model.static_gain,
        },
        "direct_and_state": {
            "direct": model.numerator[0],
            "feed": model.feed,
            "leak": model.leak,
            "state_gain": model.state_gain,
            "says": "u = reading - offset; state starts at state_gain*u; force = direct*u + state;"
            " then state += feed*u - leak*state",
        },
        "load_range_n": None if calibration.load_range_n is None else list(calibration.load_range_n),
        "delay_s": calibration.delay_s,
        "sources": [dict(source) for source in calibration.sources],
        "provenance": model.provenance,
        "test_vector": {
            "reading": [finite_or_none(value) for value in model.test_readings.tolist()],
            "force_n": model.test_forces_n.tolist(),
            "tolerance_n": model.tolerance_n("double"),
        },
    }
    if isinstance(model, ExtendedFilterModel):
        found["extended"] = _extended(model)
    return {f"{model.name}.json": json_text(found)}


def _extended(model: ExtendedFilterModel) -> dict[str, Any]:
    """The JSON object of the whole extended model, with the inverse of its linear network at the sample rate."""
    filter_ = model.filter
    core = filter_.core
    return {
        "model": filter_.model.to_dict(),
        "inverse_network": {
            "transition": core.transition.tolist(),
            "drive": core.drive.tolist(),
            "read": core.read.tolist(),
            "direct": core.direct,
            "start": core.start.tolist(),
            "is_exact": core.is_exact,
            "says": "p = pressure as a share of full scale; state starts at start*p; load = (p - read.state)/direct;"
            " then state = transition state + drive load",
        },
        "order": [name for name, _ in filter_.blocks],
        "not_inverted": dict(filter_.not_inverted),
        "cautions": dict(filter_.cautions),
        "says": "reading/(gain full_scale_reading), then the blocks' inverses in this order, then full_scale_load_n;"
        " the forms above are the linear part's, the test vector is the extended filter's",
    }
