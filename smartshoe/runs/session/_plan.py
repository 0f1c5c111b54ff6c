"""`SessionPlan`: what a session is to do, as stored in its folder; and protocols by name or from a file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from pydantic import ConfigDict, TypeAdapter, ValidationError

from smartshoe.errors import InputError, LimitError, UsageError
from smartshoe.files.gate import limits, require_file_name
from smartshoe.protocol import Protocol, dynamic_protocol, static_protocol

SCHEMA = "smartshoe.session_plan/1"
LARGEST_REPEATS = 100


@dataclass(frozen=True)
class SessionPlan:
    """What a session is to do: calibrate ``unit`` of ``shoe`` on ``machine`` (URLs), one experiment a protocol.

    The stream is recorded for ``zero_s`` before and ``tail_s`` after each test, from the second pressing on also until
    the unit has come to rest, for at most ``rest_s``. A faulty pressing is repeated at most ``largest_repeats`` times.
    ``wait_s`` bounds the wait for the log of a machine run by hand, beyond the duration of the test. ``created`` is an
    ISO date. ``valid_for_days`` is how long the stored calibration is valid.
    """

    shoe: str
    machine: str
    unit: str
    protocols: tuple[Protocol, ...]
    serial_number: str = ""
    store: str | None = None
    created: str = ""
    version: str = ""
    diagnosed: bool = True
    zero_s: float = 2.0
    tail_s: float = 2.0
    rest_s: float = 120.0
    largest_repeats: int = 2
    wait_s: float = 900.0
    valid_for_days: float | None = None

    __pydantic_config__ = ConfigDict(extra="forbid", allow_inf_nan=False)

    def __post_init__(self) -> None:
        require_file_name(self.unit, "unit")
        for protocol in self.protocols:
            require_file_name(protocol.name, "protocol")
        for name in ("zero_s", "tail_s", "rest_s", "wait_s"):
            if not 0.0 <= getattr(self, name) <= limits().duration_s:
                raise UsageError(f"{name} is {getattr(self, name)}: give seconds from 0 to {limits().duration_s}")
        if self.valid_for_days is not None and not 0.0 < self.valid_for_days < math.inf:
            raise UsageError(f"valid_for_days is {self.valid_for_days:g}: give a number above 0, or none")
        if not 0 <= self.largest_repeats <= LARGEST_REPEATS:
            raise UsageError(f"largest_repeats is {self.largest_repeats}: give 0 to {LARGEST_REPEATS}")
        names = [protocol.name for protocol in self.protocols]
        if not names:
            raise UsageError("a session needs a protocol: give --protocol static, dynamic or a TOML file")
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise UsageError(f"protocol {min(twice)} is there twice: give each protocol once, or rename one")

    def protocol(self, name: str) -> Protocol:
        """The protocol of that name."""
        return next(protocol for protocol in self.protocols if protocol.name == name)

    def to_dict(self) -> dict[str, Any]:
        """The plan as the object in ``session.json``."""
        return {"schema": SCHEMA, **asdict(self)}

    @classmethod
    def from_dict(cls, found: Mapping[str, Any], where: str) -> Self:
        """The plan from an object; raises `InputError` naming ``where`` and the invalid key."""
        schema = found.get("schema") if isinstance(found, Mapping) else None
        if schema != SCHEMA:
            raise InputError(f"{where}: key 'schema' is {schema!r}, not {SCHEMA!r}: give a session's folder")
        try:
            return TypeAdapter(cls).validate_python({key: value for key, value in found.items() if key != "schema"})
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            key = ".".join(map(str, first["loc"])) or "the plan"
            raise InputError(f"{where}: key '{key}': {first['msg']}: restore the file from a copy") from error


def protocols_named(names: Sequence[str]) -> tuple[Protocol, ...]:
    """Protocols by name: ``static``, ``dynamic``, or a TOML file, of which all ``[protocol.NAME]`` tables are taken.

    Raises `UsageError` for an unknown name, and `ScenarioError` with line and key for an invalid table.
    """
    found: list[Protocol] = []
    for name in names:
        if name == "static":
            found.append(static_protocol())
        elif name == "dynamic":
            found.append(dynamic_protocol())
        elif name.casefold().endswith(".toml") or Path(name).is_file():
            found += _from_file(Path(name))
        else:
            raise UsageError(f"protocol {name!r} is not known: use static, dynamic or the name of a TOML file")
    return tuple(found)


def _from_file(path: Path) -> list[Protocol]:
    from smartshoe.runs.scenario import ProtocolTable, read_tables

    raw, source = read_tables(path, "static, dynamic or a TOML file")
    tables = raw.get("protocol")
    if not isinstance(tables, dict) or not tables:
        raise UsageError(f"{path} has no [protocol.NAME] table: write one, with kind, loads or corners")
    found: list[Protocol] = []
    for name, table in tables.items():
        if isinstance(table, dict) and name in ("static", "dynamic"):
            table.setdefault("kind", name)
        try:
            found.append(ProtocolTable.model_validate(table).build(name))
        except ValidationError as error:
            raise source.from_validation(error, ("protocol", name)) from error
        except LimitError as error:
            raise source.error(("protocol", name), str(error)) from error
    return found
