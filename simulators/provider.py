"""The provider of simulated devices, entry point "sim" of ``smartshoe.devices``.

It opens ``sim:instron``, ``sim:walk``, ``sim:run``, ``sim:stand`` and ``sim:tiptoe``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from smartshoe.errors import UsageError
from smartshoe.recording import REGIONS

if TYPE_CHECKING:
    import numpy as np

    from simulators.benches.instron import SimulatedInstron
    from simulators.benches.shoe import SimulatedShoe

MACHINES = ("instron",)
SHOES = ("walk", "stand", "run", "tiptoe")
DEFAULT_UNIT = "left_toe"


class Provider:
    """Creates simulated devices from a target and options; heavy imports are deferred until then."""

    def open_machine(
        self, target: str, options: Mapping[str, Any] | None = None, rng: np.random.Generator | None = None
    ) -> SimulatedInstron:
        """A machine (closed, to be used in a with block) for ``target`` 'instron'.

        ``options`` are `simulators.benches.machine_options.MachineOptions`; omitted ones come from the preset of their
        ``unit`` (default left_toe). ``bladder = {twin = "unit.json"}`` presses the unit's own calibration instead
        (`simulators.instruments.twin`). Raises `pydantic.ValidationError` for wrong options, `UsageError` for a wrong
        target, `InputError` where the twin's file is no calibration. Without ``rng`` the seed is 0.
        """
        _require(target, MACHINES, "machine")
        import numpy as np

        from simulators.benches.instron import SimulatedInstron
        from simulators.benches.machine_options import MachineOptions, TwinMachineOptions
        from simulators.instruments.options import is_twin, with_preset
        from simulators.instruments.sensing_unit import SensingUnit
        from simulators.instruments.sensor import SimulatedHdiSensor
        from simulators.plant.bladder import SimulatedBladder

        given = {"unit": DEFAULT_UNIT, **(options or {})}
        kind = TwinMachineOptions if is_twin(given) else MachineOptions
        checked = kind.model_validate(with_preset(given["unit"], given))
        rng = rng if rng is not None else np.random.default_rng(0)
        sequence: Any = rng.bit_generator.seed_seq  # numpy's own has these attributes, though its protocol lacks them
        seed = "/".join(str(key) for key in (sequence.entropy, *sequence.spawn_key))
        sensor = SimulatedHdiSensor(checked.sensor.parameters(), rng)
        bladder: Any
        if isinstance(checked, TwinMachineOptions):
            from simulators.instruments.twin import twin_of

            bladder = twin_of(checked.bladder.twin)
        else:
            bladder = SimulatedBladder(checked.bladder)
        unit = SensingUnit(checked.unit, bladder, sensor)
        return SimulatedInstron(unit, rng, checked.parameters(), checked.daq.parameters(), seed)

    def open_shoe(
        self, target: str, options: Mapping[str, Any] | None = None, rng: np.random.Generator | None = None
    ) -> SimulatedShoe:
        """A shoe (closed, to be used in a with block) for ``target`` 'walk', 'stand', 'run' or 'tiptoe'.

        ``options`` are `simulators.benches.shoe_options.ShoeOptions`; raises the errors of `open_machine`.
        """
        _require(target, SHOES, "shoe")
        import numpy as np

        from simulators.benches.shoe import SimulatedShoe
        from simulators.benches.shoe_options import ShoeOptions
        from simulators.instruments.options import with_preset
        from simulators.instruments.sensing_unit import SensingUnit
        from simulators.instruments.sensor import SimulatedHdiSensor
        from simulators.plant.bladder import SimulatedBladder

        given = dict(options or {})
        side = given.get("side", "left")
        names = [
            f"{foot}_{region}" for foot in (("left", "right") if side == "both" else (side,)) for region in REGIONS
        ]
        units = given.get("units", {})
        if isinstance(units, dict):
            given["units"] = {n: with_preset(n, units.get(n, {})) for n in [*names, *(set(units) - set(names))]}
        checked = ShoeOptions.model_validate(given)
        surplus = sorted(set(checked.units) - set(names))
        if surplus:
            raise UsageError(f"units.{surplus[0]} is no unit of this shoe: use one of {', '.join(names)}")
        rng = rng if rng is not None else np.random.default_rng(0)
        sensing = [
            SensingUnit(
                name,
                SimulatedBladder(checked.units[name].bladder),
                SimulatedHdiSensor(checked.units[name].sensor.parameters(), rng),
            )
            for name in names
        ]
        return SimulatedShoe(sensing, target, rng, checked.gait(), checked.parameters())


def _require(target: str, known: tuple[str, ...], what: str) -> None:
    if target not in known:
        raise UsageError(f"simulated {what} {target!r} is not known: use one of {', '.join(known)}")


provider = Provider()
