"""``smartshoe calibrate``."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any

import click

from smartshoe.cli._ranges import FiniteRange
from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smartshoe.devices import Block, Shoe
    from smartshoe.live.guide import PageOperator
    from smartshoe.runs.session import PressingFault, SessionFolder, SessionPlan


@click.command(
    "calibrate",
    epilog="Example: smartshoe calibrate --shoe sim:stand --machine sim:instron --protocol dynamic --unit left_toe"
    " --out out/left_toe",
)
@click.option("--shoe", metavar="URL", help="The shoe: serial:///dev/rfcomm0, replay:FILE, sim:stand.")
@click.option("--machine", metavar="URL", help="The machine: log:FILE or log:FOLDER (run by hand), sim:instron.")
@click.option("--protocol", "protocols", multiple=True, metavar="NAME",
              help="static, dynamic, or a TOML file with [protocol.NAME] (repeatable).")  # fmt: skip
@click.option("--unit", metavar="NAME", help="The unit under the anvil, for example left_toe.")
@click.option("--out", "out_folder", metavar="DIR", help="A new folder for the session.")
@click.option("--serial-number", default="", metavar="S", help="Which unit it is; with it the result is stored.")
@click.option("--store", metavar="DIR", help="The store of calibrations (default: the user's own).")
@click.option("--valid-for-days", type=click.FloatRange(min=0.0, min_open=True), metavar="DAYS",
              help="How long the stored calibration holds (default: no expiry).")  # fmt: skip
@click.option("--resume", metavar="DIR", help="Go on with the session in DIR.")
@click.option("--replay", metavar="DIR", help="Judge the session in DIR anew from its raw data; no device is used.")
@click.option("--yes", is_flag=True, help="Ask nothing: confirm every step, repeat what is faulty.")
@click.option("--repeats", type=click.IntRange(min=0), default=2, show_default=True,
              help="How often a faulty experiment is pressed again.")  # fmt: skip
@click.option("--wait", "wait_s", type=FiniteRange(min=0.0), default=900.0, show_default=True, metavar="SECONDS",
              help="How long a log is waited for, beyond the test's duration.")  # fmt: skip
@click.option("--diagnose/--no-diagnose", "diagnosed", default=True, show_default=True,
              help="Say what the model gets wrong.")  # fmt: skip
@click.option("--live", is_flag=True, help="Readings, instructions, progress and answers on a page as well.")
@click.option("--port", type=click.IntRange(1, 65535), help="The port of --live's page (default: a free one).")
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")
def command(
    out_folder: str | None,
    resume: str | None,
    replay: str | None,
    yes: bool,
    live: bool,
    port: int | None,
    json_path: str | None,
    **options: Any,
) -> None:
    """Calibrate a unit: a shoe streams while a machine presses, and what comes out is judged and stored."""
    from smartshoe.kernels import warm_up

    warm_up.begin()
    from smartshoe.cli._output import emit_json, note, progress, require_writable
    from smartshoe.runs.session import analyse, conduct, publish

    require_writable(json_path=json_path, folder=out_folder)
    if replay is not None:
        folder = _replayed(replay, resume, options)
        target = Path(out_folder) if out_folder is not None else None
    else:
        folder = _begun(out_folder, resume, options)
        target = folder.path
    with folder:
        _require_own_store(folder, options["store"])
        for said in folder.notes:
            note(f"{folder.path}: {said}")
        if replay is None:
            asks = not yes and not folder.plan.machine.startswith("sim:")
            try:
                with _at_the_machine(asks and sys.stdin.isatty()) as operator, ExitStack() as page:
                    shown = page.enter_context(_page(operator, folder, asks, port)) if live else operator
                    conduct(folder, shown)
            except (KeyboardInterrupt, click.Abort):
                click.echo(
                    f"what was recorded is kept; go on with smartshoe calibrate --resume {folder.path}", err=True
                )
                raise
        with progress() as step:
            result = analyse(folder, step)
            whole = result.to_dict()
            step("writing the report")
            written = publish(result, target) if target is not None else {}
    if emit_json(whole, json_path):
        return
    from smartshoe.report.tables import print_identification, print_validation

    print_identification(whole["identification"])
    print_validation(whole["validation"])
    for said in result.clocks_said:
        click.echo(said)
    if result.diagnosis is not None:
        click.echo(f"diagnosis: {result.diagnosis.says}")
    for name, path in written.items():
        click.echo(f"{name}: {path}")


def _require_own_store(folder: SessionFolder, store: str | None) -> None:
    """Use the given store, or the session folder's own, which must exist: a folder may come from anybody.

    Raises `UsageError` where it does not.
    """
    named = folder.plan.store
    if store is not None and store != named:
        folder.plan = replace(folder.plan, store=store)
    elif store is None and named is not None and not Path(named).is_dir():
        raise UsageError(f"{folder.path} names the store {named}, which is not there: say with --store which to use")


def _replayed(replay: str, resume: str | None, options: dict[str, Any]) -> SessionFolder:
    from smartshoe.runs.session import SessionFolder

    given = [name for name in ("shoe", "machine", "unit", "protocols") if options[name]]
    if resume is not None or given:
        raise UsageError(f"--replay takes everything from {replay}: leave --{'resume' if resume else given[0]} out")
    return SessionFolder.open(replay)


def _begun(out_folder: str | None, resume: str | None, options: dict[str, Any]) -> SessionFolder:
    from smartshoe.files.atomic import make_folder
    from smartshoe.runs.session import SessionFolder

    if resume is None:
        for name in ("shoe", "machine", "unit"):
            if not options[name]:
                raise UsageError(f"--{name} is missing: give --shoe, --machine, --protocol, --unit and --out")
        if out_folder is None:
            raise UsageError("--out is missing: give a new folder for the session's data and results")
        folder = SessionFolder.begin(out_folder, _plan(options))
        if options["store"] is not None:
            make_folder(options["store"])  # fails before anything is pressed if it cannot be written to
        return folder
    given = [name for name in ("shoe", "machine", "unit", "protocols") if options[name]]
    if given or out_folder is not None:
        name = "out" if out_folder is not None else given[0].removesuffix("s")
        raise UsageError(f"--resume takes everything from {resume}: leave --{name} out")
    return SessionFolder.resume(resume)


def _plan(options: dict[str, Any]) -> SessionPlan:
    import datetime

    from smartshoe.runs.session import SessionPlan, protocols_named
    from smartshoe.version import __version__

    if options["store"] is not None and not options["serial_number"]:
        raise UsageError("--store needs --serial-number: the store keeps units by their serial number")
    if options["valid_for_days"] is not None and not options["serial_number"]:
        raise UsageError("--valid-for-days needs --serial-number: the store keeps units by their serial number")
    return SessionPlan(
        shoe=options["shoe"],
        machine=options["machine"],
        unit=options["unit"],
        protocols=protocols_named(options["protocols"]),
        serial_number=options["serial_number"],
        store=options["store"],
        created=datetime.datetime.now(datetime.UTC).date().isoformat(),
        version=__version__,
        diagnosed=options["diagnosed"],
        largest_repeats=options["repeats"],
        wait_s=options["wait_s"],
        valid_for_days=options["valid_for_days"],
    )


def _page(operator: _AtTheMachine, folder: SessionFolder, asks: bool, port: int | None) -> PageOperator:
    """An operator that shows the session on a page as well; raises `UsageError` without the extra ``live``."""
    try:
        from smartshoe.live.guide import PageOperator
    except ImportError as error:
        raise UsageError(f"--live needs {error.name}, which is not installed: pip install 'smartshoe[live]'") from error
    return PageOperator(
        operator, folder.plan, lambda url: operator.tell(f"live: {url}"),
        asks=asks, keyboard=operator.asks, port=port or 0,
    )  # fmt: skip


class _AtTheMachine:
    """The operator at the terminal: instructions on stderr, Enter confirms, live readings if stderr is a terminal."""

    def __init__(self, asks: bool, table: Any = None) -> None:
        self.asks, self._table = asks, table
        self._keyboard = _Keyboard()

    def streams(self, shoe: Shoe) -> None:
        """Do nothing: readings arrive through `show`."""

    def tell(self, sentence: str) -> None:
        self._print(sentence)

    def confirm(self, sentence: str, meanwhile: Callable[[], None]) -> None:
        self._print(f"{sentence}{'; then press Enter' if self.asks else ''}")
        if self.asks:
            self._keyboard.answer(meanwhile)

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        if self._table is not None:
            self._table.show(block, experiment, elapsed_s)

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        self._print(finding.says)
        if repeats_left == 0:
            return False
        if not self.asks:
            self._print(f"pressed again; {repeats_left} repeats are left")
            return True
        self._print(f"press again? [Y/n] ({repeats_left} repeats are left)")
        return not self._keyboard.answer(_waiting).strip().casefold().startswith("n")

    def _print(self, sentence: str) -> None:
        if self._table is not None:
            self._table.print(sentence)
        else:
            click.echo(sentence, err=True)


def _waiting() -> None:
    time.sleep(0.05)


class _Keyboard:
    """Typed lines, read by one thread, so that an answer given elsewhere leaves no thread waiting for input."""

    def __init__(self) -> None:
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._thread: Thread | None = None

    def answer(self, meanwhile: Callable[[], None]) -> str:
        """The next line; ``meanwhile`` is called while waiting. Raises `click.Abort` at the end of input."""
        if self._thread is None:
            self._thread = Thread(target=self._read, daemon=True)
            self._thread.start()
        while self._lines.empty():
            meanwhile()
        line = self._lines.get()
        if not line:
            raise click.Abort
        return line

    def _read(self) -> None:
        while True:
            line = sys.stdin.readline()
            self._lines.put(line)
            if not line:
                return


@contextmanager
def _at_the_machine(asks: bool) -> Iterator[_AtTheMachine]:
    if not sys.stderr.isatty():
        yield _AtTheMachine(asks)
        return
    from smartshoe.cli._readings import LiveReadings

    with LiveReadings() as table:
        yield _AtTheMachine(asks, table)
