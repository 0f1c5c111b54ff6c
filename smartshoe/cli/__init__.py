"""The command line: ``smartshoe COMMAND``. Each command is a file, imported when it is called."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from typing import Any

import click

from smartshoe.errors import SmartShoeError

_COMMANDS = {
    "run": "run a scenario: devices, identification, compensation, validation",
    "simulate": "run only a scenario's devices and write the recordings",
    "identify": "identify one unit from one or more experiments",
    "compensate": "force from pressure, by a calibration",
    "validate": "judge a calibration on recordings, per loading rate",
    "diagnose": "what a simulation gets wrong, why, and what mending it gains",
    "calibrate": "a session: a shoe under a machine, recorded, identified, judged and stored",
    "stream": "live readings and forces from a shoe",
    "gait": "events, phases, strides and forces of a trial",
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

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))


def _show_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        import smartshoe

        click.echo(f"smartshoe {smartshoe.__version__}")
        ctx.exit()


@click.group(
    cls=_LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Each command has --help with an example. --debug shows a traceback where one helps.",
)
@click.option("--version", is_flag=True, expose_value=False, is_eager=True, callback=_show_version,
              help="Show the version and exit.")  # fmt: skip
def group() -> None:
    """Calibrate, identify and compensate shoe-embedded air pressure sensors, on real and simulated devices."""


def _one_line(text: str) -> str:
    return " ".join(text.split())


def run_command(arguments: Sequence[str]) -> int:
    """Run a command line and return its exit status; errors are printed to stderr as one sentence."""
    words = list(arguments)
    cut = words.index("--") if "--" in words else len(words)
    debug = "--debug" in words[:cut]
    words = [word for at, word in enumerate(words) if word != "--debug" or at >= cut]
    try:
        result: Any = group.main(args=words, prog_name="smartshoe", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else "", err=True)
        return 2
    except click.ClickException as error:
        if debug:
            raise
        command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "smartshoe"
        message = _one_line(error.format_message()).rstrip(".")
        click.echo(f"error: {message}; see {command} --help", err=True)
        return 2
    except click.Abort:
        click.echo("error: stopped by the user; nothing half-written is left", err=True)
        return 130
    except SmartShoeError as error:
        if debug:
            raise
        click.echo(f"error: {_one_line(str(error))}", err=True)
        return error.exit_status
    except BrokenPipeError:
        # The reader of our output went away (head, less): no fault of the command.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def main() -> None:
    """Entry point of the ``smartshoe`` command."""
    sys.exit(run_command(sys.argv[1:]))
