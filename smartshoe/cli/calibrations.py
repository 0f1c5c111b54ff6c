"""``smartshoe calibrations``: the store of calibrations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from smartshoe.cli._output import figures_option, warn

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration
    from smartshoe.calibration.store import CalibrationStore

_F = TypeVar("_F", bound=Callable[..., Any])


def _store_option(command: _F) -> _F:
    return click.option(
        "--store", "store_folder", metavar="DIR",
        help="The store's folder (default: $SMARTSHOE_STORE, else the user's data folder).",
    )(command)  # fmt: skip


def _json_option(command: _F) -> _F:
    return click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")(command)


def _date_option(says: str) -> Callable[[_F], _F]:
    return click.option("--date", metavar="DATE", help=f"{says}: 2026-03-31 or 2026-03-31T14:30 (UTC).")


def _opened(folder: str | None) -> CalibrationStore:
    from smartshoe.calibration.store import CalibrationStore

    return CalibrationStore(folder)


def _show_faults(store: CalibrationStore) -> None:
    for fault in store.faults:
        warn(fault)


def _today() -> str:
    import datetime

    return datetime.datetime.now(datetime.UTC).date().isoformat()


@click.group(
    "calibrations",
    epilog="Example: smartshoe calibrations add left_toe.json --serial-number S0123, then smartshoe calibrations list."
    " Each of them has --help with an example of its own.",
)
def command() -> None:
    """Every unit's calibrations over its life: list, show, compare, drift; add, swap, repair, retire.

    CALIBRATION is a name from `list` (or its beginning, or the code behind its date), a unit's serial number or place
    (its calibration nearest to --date, the latest without), or a file.
    """


@command.command("list", epilog="Example: smartshoe calibrations list")
@click.option("--unit", metavar="UNIT", help="Only this unit, by serial number or place.")
@_date_option("Expiry and places as of this date (default: today)")
@_store_option
@_json_option
def list_command(unit: str | None, date: str | None, store_folder: str | None, json_path: str | None) -> None:
    """Units, their calibrations, where they sit, what has expired."""
    from smartshoe.calibration.store.dates import days_between, iso, moment
    from smartshoe.cli._output import emit_json, require_writable
    from smartshoe.display import counted
    from smartshoe.report.tables import new_console, table_of

    require_writable(json_path=json_path)
    store, at = _opened(store_folder), moment(date or _today(), "--date")
    result = store.to_dict(at, unit)
    _show_faults(store)
    if emit_json(result, json_path):
        return
    places = {of_unit["serial_number"]: of_unit["position"] for of_unit in result["units"]}
    entries = [entry for entry in store.entries() if entry.serial_number in places]
    events = [event for event in store.events() if event.serial_number in places]
    if not places:
        click.echo(f"{store} holds no calibration yet: smartshoe calibrations add FILE --serial-number S")
        return
    table = table_of(
        f"{store}: {counted(len(entries), 'calibration')} of {counted(len(places), 'unit')}, as of {iso(at)}",
        ["unit", "sits at", "date", "age (days)", "calibrated at", "holds until", "name or note"],
    )
    for serial, place in places.items():
        rows = []
        for entry in (entry for entry in entries if entry.serial_number == serial):
            until = "–" if entry.expires is None else iso(entry.expires) + (" EXPIRED" if entry.is_expired(at) else "")
            rows.append((entry.date, entry.position or "–", until, entry.name))
        for event in (event for event in events if event.serial_number == serial):
            rows.append((event.date, event.happened, "", event.note))
        for number, (when, what, until, called) in enumerate(sorted(rows, key=lambda row: row[0])):
            name = (serial, place or "–") if number == 0 else ("", "")
            table.add_row(*name, iso(when), f"{days_between(when, at):.0f}", what, until, called)
    new_console().print(table)


@command.command("show", epilog="Example: smartshoe calibrations show left_toe --date 2026-03-31")
@click.argument("calibration")
@_date_option("The one nearest to this date")
@click.option("--refuse-expired", is_flag=True, help="Refuse (exit 5) a calibration that does not hold at the date.")
@click.option("--out", "out_path", metavar="C.json", help="Also write it to a file, for --calibration.")
@_store_option
@_json_option
def show_command(
    calibration: str,
    date: str | None,
    refuse_expired: bool,
    out_path: str | None,
    store_folder: str | None,
    json_path: str | None,
) -> None:
    """One calibration: its parameters, its file, whether it holds."""
    from smartshoe.calibration.store.quantities import quantities
    from smartshoe.cli._output import emit_json, require_writable
    from smartshoe.report.numbers import with_sd
    from smartshoe.report.tables import new_console, table_of

    require_writable(out_path, json_path=json_path, read=[calibration] if Path(calibration).is_file() else [])
    store = _opened(store_folder)
    name, says, found = _one(store, calibration, date, refuse_expired)
    _show_faults(store)
    if out_path is not None:
        found.save(out_path)
    if emit_json({**found.to_dict(), "says": says}, json_path):
        return
    table = table_of(f"{name}: {found.unit or 'unit'} {found.serial_number}", ["quantity", "value ± sd", "unit"])
    for quantity, parameter in quantities(found).items():
        table.add_row(quantity.replace("_", " "), with_sd(parameter.to_dict()), parameter.unit)
    console = new_console()
    console.print(table)
    if found.load_range_n is not None:
        rates = found.rate_range_n_per_s
        console.print(
            f"loads {found.load_range_n[0]:.4g} to {found.load_range_n[1]:.4g} N"
            + (f", rates {rates[0]:.4g} to {rates[1]:.4g} N/s" if rates else "")
            + (f"; effects: {', '.join(found.extended.names)}" if found.extended and found.extended.names else "")
            + (f"; effects of its twin: {', '.join(found.twin.names)}" if found.twin and found.twin.names else "")
        )
    console.print(says, soft_wrap=True)
    if out_path is not None:
        click.echo(f"calibration: {out_path}")


@command.command("compare", epilog="Example: smartshoe calibrations compare 2026-01-05_3f2a 2026-06-30_9c41")
@click.argument("first")
@click.argument("second")
@click.option("--rate", "rates", multiple=True, type=float, metavar="N/S", help="A loading rate (repeatable).")
@_store_option
@_json_option
def compare_command(
    first: str, second: str, rates: tuple[float, ...], store_folder: str | None, json_path: str | None
) -> None:
    """Two calibrations: what differs, by how many sd, and how many newtons it means."""
    from smartshoe.calibration.store.compare import RATES_N_PER_S, compare
    from smartshoe.cli._output import emit_json, require_writable

    require_writable(json_path=json_path)
    store = _opened(store_folder)
    (one, _, ours), (other, _, theirs) = (_one(store, name, None, False) for name in (first, second))
    result = compare(ours, theirs, rates or RATES_N_PER_S).to_dict()
    _show_faults(store)
    if not emit_json({**result, "first": one, "second": other}, json_path):
        from smartshoe.report.drift import print_comparison

        print_comparison(result, (one, other))


@command.command("drift", epilog="Example: smartshoe calibrations drift S0123 --out out/drift")
@click.argument("unit")
@click.option("--out", "out_folder", metavar="DIR", help="Write drift.html and drift.json.")
@figures_option
@_store_option
@_json_option
def drift_command(
    unit: str, out_folder: str | None, store_folder: str | None, json_path: str | None, figures: tuple[str, ...]
) -> None:
    """How a unit's parameters move over its life: trend, repairs, jumps."""
    from smartshoe.calibration.store.drift import drift
    from smartshoe.cli._output import emit_json, require_writable

    require_writable(json_path=json_path, folder=out_folder)
    store = _opened(store_folder)
    found = drift(store, _serial(store, unit, _today()))
    _show_faults(store)
    from smartshoe.report.drift import print_drift, write_drift

    if figures and out_folder is None:
        raise click.UsageError("--figures writes into --out DIR: give --out as well")
    written = write_drift(out_folder, found, figures) if out_folder is not None else {}
    if emit_json(found.to_dict(), json_path):
        return
    print_drift(found)
    for name, path in written.items():
        click.echo(f"{name}: {path}")


@command.command("add", epilog="Example: smartshoe calibrations add left_toe.json --serial-number S0123")
@click.argument("files", nargs=-1, required=True)
@click.option("--serial-number", metavar="S", help="The unit's, where the file does not say.")
@_date_option("When it was calibrated, where the file does not say")
@click.option("--position", metavar="NAME", help="Where the unit sits, where the file does not say: left_toe.")
@click.option("--valid-for-days", type=float, metavar="DAYS", help="How long it holds (default: no expiry).")
@click.option("--note", default="", help="Anything worth knowing.")
@_store_option
@_json_option
def add_command(
    files: tuple[str, ...],
    serial_number: str | None,
    date: str | None,
    position: str | None,
    valid_for_days: float | None,
    note: str,
    store_folder: str | None,
    json_path: str | None,
) -> None:
    """Take calibrations (files that identify or diagnose wrote) into the store."""
    from smartshoe.calibration import Calibration
    from smartshoe.cli._output import emit_json, require_writable
    from smartshoe.errors import UsageError

    require_writable(json_path=json_path, read=files)
    if len(files) > 1 and (serial_number or position):
        raise UsageError(
            f"--serial-number and --position name one unit, {len(files)} files are given: add them one by one"
        )
    store = _opened(store_folder)
    read = [Calibration.load(file) for file in files]
    entries = [
        store.add(
            calibration, serial_number=serial_number, date=date, position=position,
            valid_for_days=valid_for_days, note=note,
        )
        for calibration in read
    ]  # fmt: skip
    _show_faults(store)
    if emit_json({"store": str(store), "added": [entry.to_dict() for entry in entries]}, json_path):
        return
    for entry in entries:
        click.echo(
            f"{entry.name}: unit {entry.serial_number}{f' at {entry.position}' if entry.position else ''}: {entry.path}"
        )


@command.command("swap", epilog="Example: smartshoe calibrations swap left_toe S0124 --date 2026-03-31")
@click.argument("position")
@click.argument("serial_number")
@_date_option("From when on (default: today)")
@click.option("--note", default="", help="Anything worth knowing.")
@_store_option
def swap_command(position: str, serial_number: str, date: str | None, note: str, store_folder: str | None) -> None:
    """From a date on another unit sits at POSITION (and the one that sat there has left)."""
    store = _opened(store_folder)
    event = store.place(serial_number, position, date or _today(), note)
    click.echo(f"unit {serial_number}: {event.says}")
    if not store.history(serial_number):
        warn(f"unit {serial_number} has no calibration in {store} yet")


@command.command("repair", epilog="Example: smartshoe calibrations repair S0123 --date 2026-03-31 --note 'new tube'")
@click.argument("serial_number")
@_date_option("When (default: today)")
@click.option("--note", default="", help="What was done.")
@_store_option
def repair_command(serial_number: str, date: str | None, note: str, store_folder: str | None) -> None:
    """The unit was repaired: calibrations from before do not hold after."""
    _event(store_folder, "repair", serial_number, date, note)


@command.command("retire", epilog="Example: smartshoe calibrations retire S0123 --note 'tube torn'")
@click.argument("serial_number")
@_date_option("When (default: today)")
@click.option("--note", default="", help="Why.")
@_store_option
def retire_command(serial_number: str, date: str | None, note: str, store_folder: str | None) -> None:
    """The unit is out of use."""
    _event(store_folder, "retire", serial_number, date, note)


def _event(store_folder: str | None, what: str, serial_number: str, date: str | None, note: str) -> None:
    store = _opened(store_folder)
    store.latest(serial_number)  # refuses a wrong serial number now rather than later
    event = getattr(store, what)(serial_number, date or _today(), note)
    click.echo(f"unit {serial_number}: {event.says}")


def _serial(store: CalibrationStore, unit: str, date: str) -> str:
    """The serial number of a unit given by serial number or by the place where it sits."""
    return unit if unit in store.serial_numbers else store.unit_at(unit, date)


def _one(store: CalibrationStore, said: str, date: str | None, refuse_expired: bool) -> tuple[str, str, Calibration]:
    """A calibration given by its name, its unit or its file: its title, a remark about it, and itself."""
    from smartshoe.calibration import Calibration
    from smartshoe.calibration.store import find
    from smartshoe.calibration.store.dates import moment
    from smartshoe.errors import RefusedError, UsageError

    if said.endswith(".json") and Path(said).is_file():
        return said, f"file {said}", Calibration.load(said)
    when = date or _today()
    try:
        entry = store.entry(said)
    except UsageError:
        found = find(store, said, when, refuse_expired=refuse_expired)
        return found.entry.name, found.says, found.calibration()
    at = moment(when)
    expired = entry.is_expired(at)
    says = f"calibration {entry.name} of unit {entry.serial_number}" + (
        f" has expired: it holds for {entry.valid_for_days:g} days" if expired else ""
    )
    if refuse_expired and expired:
        raise RefusedError(f"{says}: calibrate the unit anew")
    return entry.name, says, entry.calibration()
