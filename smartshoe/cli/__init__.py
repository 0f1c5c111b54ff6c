"""The command line ``smartshoe COMMAND``. Each command is a module, imported when it is called."""

from __future__ import annotations

import atexit
import difflib
import gc
import importlib
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import click

from smartshoe.cli._output import Talk, printable, talk
from smartshoe.cli._readers import dropping_what_nobody_reads
from smartshoe.errors import SmartShoeError
from smartshoe.files.gate.limits import raise_limits

_COMMANDS = {
    "run": "run a scenario: devices, identification, compensation, validation",
    "sweep": "a scenario many times: over values of its keys and over seeds, on all cores or a cluster",
    "simulate": "run only a scenario's devices and write the recordings",
    "identify": "identify one unit from one or more experiments",
    "compensate": "force from pressure, by a calibration",
    "validate": "judge a calibration on recordings, per loading rate",
    "diagnose": "what a simulation gets wrong, why, and what mending it gains",
    "calibrate": "a session: a shoe under a machine, recorded, identified, judged and stored",
    "stream": "live readings and forces from a shoe",
    "live": "a page that shows a shoe while it is worn: forces, events, checks; record, mark, zero",
    "gait": "events, phases, strides and forces of a trial",
    "study": "trials of many subjects under conditions, compared within subjects",
    "export": "a calibration's compensator for firmware (C) or other tools",
    "convert": "convert any readable format to any writable one",
    "check": "a shoe in the field: units that do not answer, zero, drift, body weight",
    "calibrations": "the store of calibrations: list, show, compare, drift, add, swap, repair, retire",
}


class _LazyGroup(click.Group):
    """Lists commands without importing them, so that ``--help`` is quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        module = importlib.import_module(f"smartshoe.cli.{cmd_name}")
        command: click.Command = module.command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        word = args[0] if args else ""
        if word and not word.startswith("-") and word not in _COMMANDS:
            near = difflib.get_close_matches(word, _COMMANDS, n=1)
            hint = f": did you mean {near[0]}?" if near else f": the commands are {', '.join(_COMMANDS)}"
            raise click.UsageError(f"there is no command {word!r}{hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        super().format_epilog(ctx, formatter)
        from smartshoe.files.shipped import shipped

        pages = shipped("docs")
        if pages is not None:  # on one line, so that it can be copied
            formatter.write(f"\n  The documentation, as plain text, begins with tour.md in\n  {pages}\n")


def _show_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        from smartshoe.version import __version__

        click.echo(f"smartshoe {__version__}")
        ctx.exit()


@click.group(
    cls=_LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Each command has --help with an example. --quiet leaves out progress and notes, --verbose tells every step,"
    " --debug shows a traceback, --limit NAME=NUMBER lets larger files in.",
)
@click.option("--version", is_flag=True, expose_value=False, is_eager=True, callback=_show_version,
              help="Show the version and exit.")  # fmt: skip
def group() -> None:
    """Calibrate, identify and compensate shoe-embedded air pressure sensors, on real and simulated devices."""


SELDOM = 100_000  # objects created between two garbage collections
_LONGEST_LINE = 400
_LONGEST_END = 240  # kept from the end of a message, which says how to fix the problem, then lists the names to choose


def _one_line(text: str) -> str:
    """``text`` as one printable line of bounded length."""
    line = printable(text)
    if len(line) > _LONGEST_LINE:
        line = f"{line[: _LONGEST_LINE - _LONGEST_END]} ... {line[-_LONGEST_END:]}"
    return line


@dataclass(slots=True)
class _Common:
    """Options that every command accepts anywhere: ``--debug``, ``--quiet``, ``--verbose``, ``--limit``."""

    debug: bool = False
    talk: Talk = "usual"
    limits: list[str] = field(default_factory=list)


def _of_every_command(arguments: Sequence[str]) -> tuple[list[str], _Common]:
    """The command line without the options common to all commands, and these options."""
    words: list[str] = []
    common = _Common()
    waiting = iter(arguments)
    for word in waiting:
        if word == "--":
            words += [word, *waiting]
        elif word == "--debug":
            common.debug = True
        elif word in ("--quiet", "--verbose"):
            common.talk = "quiet" if word == "--quiet" else "verbose"
        elif word == "--limit":
            common.limits.append(next(waiting, ""))
        elif word.startswith("--limit="):
            common.limits.append(word.removeprefix("--limit="))
        else:
            words.append(word)
    return words, common


def run_command(arguments: Sequence[str]) -> int:
    """Run a command line and return its exit status; errors are printed to stderr as one sentence."""
    words, common = _of_every_command(arguments)
    before = talk.set(common.talk)
    try:
        raise_limits(common.limits)
        result: Any = group.main(args=words, prog_name="smartshoe", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except Exception as error:
        if common.debug:
            raise
        return _reported(error)
    finally:
        talk.reset(before)


def _reported(error: Exception) -> int:
    """Print the error that ended a command as one sentence; returns the exit status."""
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        click.echo(f"{error.format_message()}\n", err=True)
        error = click.UsageError("no command is given: name one of these", error.ctx)
    status = 2
    if isinstance(error, click.ClickException):
        command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "smartshoe"
        message = f"{_one_line(error.format_message().rstrip('.'))}; see {command} --help"
    elif isinstance(error, click.Abort):
        message, status = "stopped by the user; nothing half-written is left", 130
    elif isinstance(error, SmartShoeError):
        message, status = str(error), error.exit_status
    elif not isinstance(error, MemoryError) and (failed := _of_other_packages(error)):
        message = failed
    elif isinstance(error, OSError):
        what = error.filename or "the output"
        message = f"{what} cannot be read or written ({error.strerror or error}): check its disk and permissions"
    elif isinstance(error, MemoryError):
        message, status = "there is too little memory for this data: split the files", 3
    else:
        message = f"smartshoe itself is at fault ({type(error).__name__}: {error}): report it with --debug's traceback"
        status = 1
    click.echo(f"error: {_one_line(message)}", err=True)
    return status


def _of_other_packages(error: Exception) -> str:
    """The sentence about an effect of another package that failed, or ''."""
    from smartshoe.models.effects import failure_of_others

    return failure_of_others(error)


def main() -> None:
    """Entry point of the ``smartshoe`` command."""
    # Most objects live until a command ends: collecting garbage every 700 objects would take 7 % of a run.
    gc.set_threshold(SELDOM)
    # At the end the system reclaims all memory at once; Python would free every object first.
    atexit.register(gc.freeze)
    # Workers are started by `python -m`, which would import a numpy.py in the current folder.
    os.environ["PYTHONSAFEPATH"] = "1"
    with dropping_what_nobody_reads():
        status = run_command(sys.argv[1:])
    sys.exit(status)
