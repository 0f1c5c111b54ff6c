"""``smartshoe live``."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import click

from smartshoe.cli._output import require_writable
from smartshoe.cli._ranges import FiniteRange
from smartshoe.errors import UsageError

LONG_S = 4 * 3600.0  # duration of a simulated walk, unless its address states one


@click.command("live", epilog="Example: smartshoe live --shoe sim:walk?side=both --record walk.csv")
@click.option("--shoe", "urls", required=True, multiple=True, metavar="URL",
              help="serial:///dev/rfcomm0, replay:FILE, sim:walk (twice: two shoes on one page).")  # fmt: skip
@click.option("--calibration", "calibrations", multiple=True, metavar="C.json",
              help="A unit's calibration, or a folder of them: forces are shown and written (repeatable).")  # fmt: skip
@click.option("--port", type=click.IntRange(1, 65535), metavar="N", help="The page's port (default: a free one).")
@click.option("--host", metavar="HOST", help="Serve beyond this computer, at this address; needs --token.")
@click.option("--token", metavar="TOKEN", help="The word that every request must bring; needs --host.")
@click.option("--record", metavar="FILE", help="Record from the start to a new plain table.")
@click.option("--speed", type=FiniteRange(0.01, 1000.0), default=1.0, show_default=True,
              help="How fast a replayed or simulated shoe goes.")  # fmt: skip
@click.option("--lsl", is_flag=True, help="Send the samples to the Lab Streaming Layer too (extra lsl).")
def command(
    urls: tuple[str, ...],
    calibrations: tuple[str, ...],
    port: int | None,
    host: str | None,
    token: str | None,
    record: str | None,
    speed: float,
    lsl: bool,
) -> None:
    """A page that shows a shoe (or two) while it is worn: forces, events, checks; record, mark, zero; Ctrl-C ends."""
    if (host is None) != (token is None):
        missing = "--token" if token is None else "--host"
        raise UsageError(f"{missing} is missing: give --host and --token both, or neither for this computer only")
    if token == "" or host == "":
        raise UsageError("--host or --token is empty: give both a word")
    require_writable(record)
    try:
        from smartshoe.live.server import LiveServer
    except ImportError as error:
        raise UsageError(
            f"smartshoe live needs {error.name}, which is not installed: pip install 'smartshoe[live]'"
        ) from error
    from smartshoe.calibration.folder import load_calibrations
    from smartshoe.devices import open_shoe
    from smartshoe.live.session import LiveSession

    loaded = load_calibrations(calibrations)
    with ExitStack() as stack:
        shoes = {url: open_shoe(_lasting(url)) for url in urls}
        if len(shoes) < len(urls):
            raise UsageError("--shoe is given twice with one address: give each shoe its own")
        for shoe in shoes.values():
            stack.enter_context(shoe)
        session = LiveSession(shoes, loaded, record=None if record is None else Path(record), speed=speed, lsl=lsl)
        stack.callback(session.close)
        server = LiveServer(session, host or "127.0.0.1", port or 0, token)
        stack.callback(server.close)
        session.start()
        server.desk.start()
        stack.callback(server.desk.close)

        def ready() -> None:
            click.echo(f"live: {server.url}")
            if token is not None:
                click.echo(f"open it with the token behind the address: {server.url}?token=...", err=True)
            for note in session.notes:
                click.echo(f"note: {note['says']}", err=True)

        server.run(ready)
    if session.recorded is not None:
        click.echo(session.recorded)


def _lasting(url: str) -> str:
    """The URL with a duration of hours for a simulated shoe, unless it states its own."""
    if not url.startswith("sim:") or "duration_s=" in url:
        return url
    return f"{url}{'&' if '?' in url else '?'}duration_s={LONG_S:g}"
