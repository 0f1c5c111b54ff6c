"""The directive ``commands``: the help of every command, as the command line itself prints it."""

from __future__ import annotations

from typing import Any, ClassVar

import click
from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx

from smartshoe.cli import group

WIDTH = 96


class Commands(Directive):
    """A section a command: its help in a block."""

    has_content: ClassVar[bool] = False

    def run(self) -> list[nodes.Node]:
        with click.Context(group, info_name="smartshoe", terminal_width=WIDTH, max_content_width=WIDTH) as root:
            names = group.list_commands(root)
            return [_section(name, group.get_command(root, name), root) for name in names]


def _section(name: str, command: click.Command | None, root: click.Context) -> nodes.section:
    if command is None:
        raise LookupError(f"smartshoe lists a command {name} that it does not have")
    section = nodes.section(ids=[name])
    section += nodes.title(text=f"smartshoe {name}")
    section += _help(command, name, root)
    if isinstance(command, click.Group):
        context = click.Context(command, parent=root, info_name=name, terminal_width=WIDTH, max_content_width=WIDTH)
        for verb in command.list_commands(context):
            inner = command.get_command(context, verb)
            if inner is not None:
                section += nodes.rubric(text=f"smartshoe {name} {verb}")
                section += _help(inner, verb, context)
    return section


def _help(command: click.Command, name: str, parent: click.Context) -> nodes.literal_block:
    context = click.Context(command, parent=parent, info_name=name, terminal_width=WIDTH, max_content_width=WIDTH)
    text = command.get_help(context)
    return nodes.literal_block(text, text, language="text")


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
