"""Target ``matlab``: a function for MATLAB and Octave, its self-check and test vector."""

from __future__ import annotations

import numpy as np

from smartshoe.calibration.export._model import ExtendedFilterModel, FilterModel
from smartshoe.calibration.export._rendering import finite_or, render, vector_csv
from smartshoe.calibration.export._twin import shifts_of
from smartshoe.errors import UsageError


def matlab_files(model: FilterModel) -> dict[str, str]:
    """NAME.m, NAME_test.m and the test vector, file name to text; double precision.

    Of an extended model, only the linear network (relaxation, heat, linear leak) and constant shifts of load and
    reading can be exported; raises `UsageError` naming the other effects.
    """
    shared: dict[str, object] = {
        "readings": [finite_or(value, "NaN", "Inf", repr(value)) for value in model.test_readings.tolist()],
        "forces_n": [repr(value) for value in model.test_forces_n.tolist()],
        "tolerance_n": repr(model.tolerance_n("double")),
    }
    if isinstance(model, ExtendedFilterModel):
        shared |= _extended(model)
    return {
        f"{model.name}.m": render(f"{model.kind}.m.j2", model, **shared),
        f"{model.name}_test.m": render("filter_test.m.j2", model, **shared),
        f"{model.name}_test.csv": vector_csv(model),
    }


def _extended(model: ExtendedFilterModel) -> dict[str, object]:
    filter_ = model.filter
    written = {"core", *(part.name for part in filter_.model.parts if part.effect.shifts is not None)}
    others = [name for name, _ in filter_.blocks if name not in written]
    if others:
        raise UsageError(
            f"the inverses of {', '.join(others)} are not written in MATLAB: export with --to c, which has every block"
        )
    core = filter_.core
    return {
        "core": {
            "transition": _matrix(core.transition),
            "drive": _matrix(core.drive[:, None]),
            "read": _matrix(core.read[None, :]),
            "start": _matrix(core.start[:, None]),
            "direct": repr(core.direct),
        },
        "reading_per_share": repr(filter_.reading_per_share),
        "full_scale_load_n": repr(filter_.model.full_scale_load_n),
        **{name: repr(value) for name, value in shifts_of(filter_.model).items()},
    }


def _matrix(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    rows = [", ".join(repr(float(value)) for value in row) for row in values]
    return f"[{'; '.join(rows)}]" if values.size else f"zeros({values.shape[0]}, {values.shape[1]})"
