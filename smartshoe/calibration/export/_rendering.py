"""Renders the targets' templates, and the CSV of the test vector that they share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from smartshoe.calibration.export._model import FilterModel


class NamedModel(Protocol):
    """What every template needs of its model."""

    @property
    def name(self) -> str:
        """The name of files and symbols."""

    @property
    def provenance(self) -> dict[str, str]:
        """The model's origin, key to one line of text."""


def render(template: str, model: NamedModel, **values: Any) -> str:
    """The text of ``templates/template`` for ``model``; a missing template value is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("smartshoe.calibration.export"),
        undefined=StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template).render(
        model=model, name=model.name, provenance=model.provenance, **values
    )


def vector_csv(model: FilterModel) -> str:
    """CSV of the test vector: provenance as comments, then ``reading_<unit>,force_n`` in full precision."""
    reading = f"reading_{model.calibration.reading_unit.suffix}"
    return columns_csv(model, {reading: model.test_readings, "force_n": model.test_forces_n})


def columns_csv(model: FilterModel, columns: Mapping[str, NDArray[Any]]) -> str:
    """CSV of ``columns``, (n,) each: the provenance as comments, then numbers in full precision."""
    lines = [f"# {key}: {text}" for key, text in model.provenance.items()]
    lines.append(",".join(columns))
    lines += [",".join(map(repr, row)) for row in zip(*(values.tolist() for values in columns.values()), strict=True)]
    return "\n".join(lines) + "\n"


def finite_or(value: float, missing: str, infinite: str, written: str) -> str:
    """``written`` for a finite ``value``, else the target language's text for NaN or signed infinity."""
    if np.isnan(value):
        return missing
    if np.isinf(value):
        return infinite if value > 0 else f"-{infinite}"
    return written
