"""The unit itself, load in and reading out, as C code: it takes the shoe's place in a simulation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from smartshoe.calibration._calibration import Calibration
from smartshoe.calibration.export._model import one_safe_line, origin
from smartshoe.calibration.export._rendering import render
from smartshoe.errors import UsageError
from smartshoe.models.extended import ExtendedModel, Part


def shifts_of(model: ExtendedModel) -> dict[str, float]:
    """Constant shifts of load and reading by effects, as shares of full scale: load_shift and reading_shift."""
    found = {"load_shift": 0.0, "reading_shift": 0.0}
    for part in model.parts:
        if part.effect.shifts is not None:
            found[f"{part.effect.shifts}_shift"] += float(part.values[0])
    return found


@dataclass(frozen=True)
class TwinModel:
    """`Calibration.model` run forward at ``sample_rate_hz``: the linear network of wall and gas, constant shifts."""

    calibration: Calibration
    sample_rate_hz: float
    name: str

    @cached_property
    def model(self) -> ExtendedModel:
        """The simulated model; raises `UsageError` naming effects that cannot be exported forward."""
        found = self.calibration.model()
        others = [p.name for p in found.chain if p is not None and p.effect.shifts is None and not _is_idle(p)]
        if others:
            raise UsageError(
                f"the twin of {self.calibration.unit or 'this unit'} has {', '.join(others)}, which"
                f" {'is' if len(others) == 1 else 'are'} not written forward in C: simulate it with"
                " bladder = {twin = ...} in a scenario, or export the plain calibration"
            )
        return found

    @property
    def provenance(self) -> dict[str, str]:
        """The origin of the model, for the reader of the file: key to one line of text."""
        found = self.model
        said = origin(self.calibration, self.sample_rate_hz)
        said["model"] = one_safe_line(
            f"the standard linear solid, relaxing share {found.relaxing_share:.6g} at"
            f" {found.relaxation_rate_per_s:.6g} 1/s; {found.gain * found.full_scale_reading:.6g}"
            f" {found.reading_unit} at {found.full_scale_load_n:g} N held; effects: {', '.join(found.names) or 'none'}"
        )
        return said

    def sources(self) -> dict[str, str]:
        """NAME.h and NAME.c, file name to text."""
        found = self.model
        core = found.core
        transition, before, after = core.recursion(1.0 / self.sample_rate_hz)
        values: dict[str, Any] = {
            "order": core.drive.size,
            "transition": [[repr(float(value)) for value in row] for row in transition],
            "before": [repr(float(value)) for value in before],
            "after": [repr(float(value)) for value in after],
            "read": [repr(float(value)) for value in core.read],
            "steady": [repr(float(value)) for value in core.steady_state(1.0)],
            "direct": repr(core.direct),
            "full_scale_load_n": repr(found.full_scale_load_n),
            "reading_per_share": repr(found.full_scale_reading * found.gain),
            "unit_symbol": one_safe_line(found.reading_unit),
            "shift": lambda value: f" + {value!r}" if value else "",
            **shifts_of(found),
        }
        return {f"{self.name}.{end}": render(f"twin.{end}.j2", self, **values) for end in "hc"}


def _is_idle(part: Part) -> bool:
    return bool(part.effect.parameters) and part.effect.is_null(part.values)
