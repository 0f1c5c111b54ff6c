"""Templates of the targets, and the test vector's CSV that they share."""

from __future__ import annotations

from typing import Any

import numpy as np

from smartshoe.compensation.export.model import FilterModel


def render(template: str, model: FilterModel, **values: Any) -> str:
    """The text of ``templates/template`` for ``model``; a value that it lacks is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("smartshoe.compensation.export"),
        undefined=StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template).render(model=model, provenance=model.provenance, **values)


def vector_csv(model: FilterModel) -> str:
    """CSV of the test vector: provenance as comments, then ``reading_<unit>,force_n`` in full precision."""
    lines = [f"# {key}: {text}" for key, text in model.provenance.items()]
    lines.append(f"reading_{model.calibration.reading_unit.suffix},force_n")
    rows = zip(model.test_readings, model.test_forces_n, strict=True)
    lines += [f"{float(reading)!r},{float(force_n)!r}" for reading, force_n in rows]
    return "\n".join(lines) + "\n"


def finite_or(value: float, missing: str, infinite: str, written: str) -> str:
    """``written`` for a finite ``value``, else the language's words for NaN and signed infinity."""
    if np.isnan(value):
        return missing
    if np.isinf(value):
        return infinite if value > 0 else f"-{infinite}"
    return written
