"""Sends a shoe's samples to the Lab Streaming Layer: one outlet a shoe, with names, units and facts about its clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from smartshoe.devices import Block
    from smartshoe.live._shoe import LiveShoe


class Outlet:
    """An outlet of type "Force" if every unit has a calibration, otherwise "Pressure"; deleting the object closes it.

    Its time stamps are the samples' times on this computer's clock (`local_clock`), from the fit of the shoe's clock;
    they contain the error of that fit and its constant delay. The last channel, ``device_time``, is the shoe's own
    time.
    """

    def __init__(self, live: LiveShoe, clock_now_s: float) -> None:
        pylsl = _pylsl()
        forces = live.forces.names
        names = [*live.names, *(f"{name}_force_estimate" for name in forces), "device_time"]
        symbols = [*(live.unit.symbol for _ in live.names), *("N" for _ in forces), "s"]
        kind = "Force" if len(forces) == len(live.names) else "Pressure"
        info = pylsl.StreamInfo(
            f"smartshoe {live.side}".strip(), kind, len(names), live.rate_hz, "double64", f"smartshoe:{live.url}"
        )
        channels = info.desc().append_child("channels")
        for name, symbol in zip(names, symbols, strict=True):
            channel = channels.append_child("channel")
            channel.append_child_value("label", name)
            channel.append_child_value("unit", symbol)
            channel.append_child_value("type", "Time" if name == "device_time" else kind)
        clock = info.desc().append_child("clock")
        clock.append_child_value("stamps", "host time of each sample by the line fitted to the shoe's clock")
        clock.append_child_value("constant_delay", "unknown, one for the whole stream")
        info.desc().append_child_value("manufacturer", "smartshoe")
        self._outlet: Any = pylsl.StreamOutlet(info)
        # LSL's clock and the host's run at the same rate, so their difference is measured once.
        self._ahead_s = float(pylsl.local_clock()) - clock_now_s

    def push(self, block: Block, host_s: Array, force_n: dict[str, Array]) -> None:
        """Send a block whose samples were taken at the host times ``host_s`` (n,)."""
        readings = np.where(block.missing, np.nan, block.readings)
        rows = np.column_stack([readings, *force_n.values(), block.time_s])
        self._outlet.push_chunk(rows, (host_s + self._ahead_s).tolist())


def _pylsl() -> Any:
    """The module pylsl; raises `UsageError` if it or liblsl is missing."""
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError) as error:  # pylsl raises RuntimeError if liblsl is missing
        raise UsageError(
            f"--lsl needs pylsl and liblsl ({_first_line(error)}): install 'smartshoe[lsl]' and liblsl"
        ) from error
    return pylsl


def _first_line(error: BaseException) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
