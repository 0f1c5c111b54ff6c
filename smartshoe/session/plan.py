"""`Plan`: what a session is to do, as it stands in the session's folder; and protocols by name or from a file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from smartshoe.errors import InputError, LimitError, UsageError
from smartshoe.protocol import Protocol, Segment, dynamic_protocol, static_protocol

SCHEMA = "smartshoe.session_plan/1"


@dataclass(frozen=True)
class Plan:
    """``shoe`` and ``machine`` are URLs, ``unit`` is the one to calibrate, each protocol is one experiment.

    The stream is recorded for ``zero_s`` before and ``tail_s`` after each test; from the second pressing on until the
    unit has come to rest, ``rest_s`` at most. A fault is answered by
    at most ``largest_repeats`` repeats. ``wait_s`` bounds the wait for a machine that is run by hand, beyond the
    test's own duration. ``created`` is an ISO date.
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

    def __post_init__(self) -> None:
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
        """For ``session.json``."""
        return {"schema": SCHEMA, **asdict(self)}

    @classmethod
    def from_dict(cls, found: Mapping[str, Any], where: str) -> Self:
        """The plan in an object; raises `InputError` naming ``where`` and the key at fault."""
        given = dict(found)
        schema = given.pop("schema", None)
        if schema != SCHEMA:
            raise InputError(f"{where}: key 'schema' is {schema!r}, not {SCHEMA!r}: give a session's folder")
        try:
            given["protocols"] = tuple(
                Protocol(p["name"], tuple(Segment(**segment) for segment in p["segments"])) for p in given["protocols"]
            )
            return cls(**given)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{where} is damaged ({error}): restore it from a copy") from error


def protocols_named(names: Sequence[str]) -> tuple[Protocol, ...]:
    """``static``, ``dynamic``, or the ``[protocol.NAME]`` tables of a TOML file (a scenario, or a next experiment).

    Raises `UsageError` where a name is neither, `ScenarioError` with line and key where a table is wrong.
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
    from pydantic import ValidationError

    from smartshoe.scenario.schema import ProtocolTable, Source

    try:
        text = path.read_text(encoding="utf-8")
        raw = tomllib.loads(text)
    except OSError as error:
        raise UsageError(f"{path} cannot be read ({error.strerror}): give static, dynamic or a TOML file") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise UsageError(f"{path} is not valid TOML: {error}") from error
    tables = raw.get("protocol")
    if not isinstance(tables, dict) or not tables:
        raise UsageError(f"{path} has no [protocol.NAME] table: write one, with kind, loads or corners")
    source = Source(path, text)
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
