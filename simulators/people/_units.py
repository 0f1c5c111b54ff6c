"""The sensing units of a person's shoes, from their presets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from simulators.instruments.options import UnitOptions, with_preset
from simulators.instruments.sensing_unit import SensingUnit
from simulators.instruments.sensor import SimulatedHdiSensor
from simulators.plant.bladder import SimulatedBladder
from smartshoe.recording import REGIONS


def sensing_units(
    rng: np.random.Generator,
    sides: Sequence[str] = ("left", "right"),
    options: Mapping[str, Mapping[str, Any]] | None = None,
) -> tuple[SensingUnit, ...]:
    """The units of the shoes from their presets; ``options`` maps a unit's name to changes (bladder, sensor).

    The key "*" applies to every unit. Raises `pydantic.ValidationError` for wrong options.
    """
    given = options or {}
    made = []
    for name in (f"{side}_{region}" for side in sides for region in REGIONS):
        own: dict[str, Any] = {}
        for source in (given.get("*", {}), given.get(name, {})):
            for key, table in source.items():
                own[key] = {**own.get(key, {}), **table}
        checked = UnitOptions.model_validate(with_preset(name, own))
        made.append(
            SensingUnit(name, SimulatedBladder(checked.bladder), SimulatedHdiSensor(checked.sensor.parameters(), rng))
        )
    return tuple(made)
