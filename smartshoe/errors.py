"""The errors that users see: one hierarchy, each with the exit status that the command line gives it.

A message is one sentence: what is wrong, where (file, line, column or key), and how to fix it.
"""

from __future__ import annotations


class SmartShoeError(Exception):
    """Root of all errors that smartshoe raises deliberately; ``exit_status`` is that of the command line."""

    exit_status = 2


class UsageError(SmartShoeError, ValueError):
    """A command line, an argument or an output path is wrong."""


class ScenarioError(UsageError):
    """A scenario file is wrong; the message names the file, the line and the key."""


class OptionError(UsageError):
    """A device's option is wrong; ``keys`` are the path to it, and the cause is the error of the check."""

    def __init__(self, message: str, keys: tuple[str | int, ...] = ()) -> None:
        super().__init__(message)
        self.keys = keys


class LimitError(UsageError):
    """A protocol or setting exceeds what a device may be asked for."""


class InputError(SmartShoeError, ValueError):
    """An input file cannot be read or holds no usable data."""

    exit_status = 3


class FormatError(InputError):
    """A file is not in the format that its name or its beginning suggests."""


class MissingChannelError(InputError, KeyError):
    """A recording lacks a channel that is needed."""

    def __str__(self) -> str:  # KeyError's own would print the repr
        return str(self.args[0]) if self.args else ""


class UnitError(InputError):
    """A unit is unknown, or of another quantity than required."""


class DeviceError(SmartShoeError, OSError):
    """A device failed."""

    exit_status = 4


class DeviceTimeoutError(DeviceError, TimeoutError):
    """A device did not answer in time."""


class RefusedError(SmartShoeError):
    """The data do not support the requested result."""

    exit_status = 5


class NotIdentifiableError(RefusedError):
    """The data cannot identify the model; the message says what is missing."""


class NotConvergedError(RefusedError):
    """An iteration ended without converging."""
