"""Emulates a shoe's firmware on a pseudo-terminal, for any simulated or replayed shoe.

    python -m simulators.wire.emulator sim:walk --link ./shoe0

prints the address to open (``serial://./shoe0``) and serves it until Ctrl-C.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import tomllib
from pathlib import Path
from typing import Annotated, Any

import click
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from simulators.wire.faults import WireFaults
from smartshoe.errors import ScenarioError, SmartShoeError

DEFAULT_LINK = "./shoe0"


class ShoeTable(BaseModel):
    """The table ``[shoe]``: the address of a shoe; all further keys belong to the backend."""

    model_config = ConfigDict(extra="allow", frozen=True)
    backend: str

    @property
    def options(self) -> dict[str, Any]:
        """The keys other than ``backend``."""
        return dict(self.model_extra or {})


class WireScenario(BaseModel):
    """An emulator's scenario: which shoe, and which faults the wire has."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    title: str = "emulated shoe"
    about: str = ""
    seed: Annotated[int, Field(ge=0)] = 0
    shoe: ShoeTable
    wire: WireFaults = WireFaults()


def load(source: str) -> WireScenario:
    """The scenario in a TOML file, or for a shoe's address one without faults; raises `ScenarioError`."""
    if not source.endswith(".toml"):
        return WireScenario(shoe=ShoeTable(backend=source))
    try:
        text = Path(source).read_text(encoding="utf-8")
        return WireScenario.model_validate(tomllib.loads(text))
    except OSError as error:
        raise ScenarioError(f"{source} cannot be read ({error.strerror}): give a scenario or an address") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ScenarioError(f"{source} is not valid TOML: {error}") from error
    except ValidationError as error:
        from smartshoe.runs.scenario.lines import line_of

        first = error.errors(include_url=False)[0]
        line = line_of(text, tuple(first["loc"]))
        where = f"{source}, line {line}" if line else source
        key = ".".join(str(part) for part in first["loc"])
        raise ScenarioError(f"{where}, key {key}: {first['msg']} (it is {first['input']!r})") from error


@click.command(
    epilog="Example: python -m simulators.wire.emulator scenarios/wire/walk_over_bluetooth.toml --link ./shoe0"
)
@click.argument("source", metavar="SCENARIO_OR_URL")
@click.option("--link", default=DEFAULT_LINK, show_default=True, metavar="PATH", help="Where the port shall be.")
@click.option("--format", "format_", type=click.Choice(["frames", "lines"]), default="frames", show_default=True,
              help="The wire format.")  # fmt: skip
@click.option("--pace", type=click.Choice(["real", "drain"]), default="real", show_default=True,
              help="In real time, or as fast as the reader takes the bytes.")  # fmt: skip
@click.option("--rate", type=click.FloatRange(min=0.1, max=10_000), help="Samples a second, if not the shoe's own.")
@click.option("--duration", type=click.FloatRange(min=0, min_open=True), help="Seconds to serve; else until Ctrl-C.")
@click.option("--seed", type=click.IntRange(min=0), help="In the place of the scenario's own seed.")
def command(
    source: str,
    link: str,
    format_: Any,
    pace: Any,
    rate: float | None,
    duration: float | None,
    seed: int | None,
) -> None:
    """Serve a shoe (a simulated or replayed one's address, or a scenario with a [wire] table) at a serial port.

    The stream is played again when it ends. The port comes back by itself after a disconnection.
    """
    from simulators.wire.firmware import Firmware
    from simulators.wire.pty_line import PtyLine
    from simulators.wire.serving import Emulator
    from smartshoe.devices import open_shoe

    scenario = load(source)
    root = np.random.SeedSequence(scenario.seed if seed is None else seed)
    shoe = open_shoe(scenario.shoe.backend, **{"seed": int(root.entropy or 0), **scenario.shoe.options})  # type: ignore[arg-type]
    firmware = Firmware(shoe, format_, rate_hz=rate, clock_skew_ppm=scenario.wire.clock_skew_ppm)
    emulator = Emulator(firmware, PtyLine(link), scenario.wire, np.random.default_rng(root), pace)
    emulator.line.appear()
    click.echo(f"{scenario.title}: {', '.join(firmware.names)} at {firmware.rate_hz:g} Hz, Ctrl-C ends it")
    click.echo(f"smartshoe stream --shoe {emulator.url}")
    with contextlib.suppress(KeyboardInterrupt):
        emulator.run(threading.Event(), float("inf") if duration is None else duration)
    s = emulator.served
    click.echo(
        f"served {s.device_s:.1f} s: {s.frames} frames, {s.intact_frames} unharmed, {s.unheard_frames} unheard,"
        f" {s.dropped_bytes} bytes dropped, {s.disconnections} disconnections",
        err=True,
    )


def main() -> int:
    """Run the command line; errors are one sentence on stderr, with the status that `smartshoe` would give."""
    try:
        command.main(standalone_mode=False)
    except SmartShoeError as error:
        click.echo(f"error: {error}", err=True)
        return error.exit_status
    except click.ClickException as error:
        error.show()
        return 2
    except click.Abort:
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
