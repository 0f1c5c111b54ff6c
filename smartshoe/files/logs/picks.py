"""Resolves a user's choice of a column of a sheet, and its unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from smartshoe.display import first_names
from smartshoe.errors import InputError, MissingChannelError, UnitError
from smartshoe.files.logs._sheet import Column, Sheet
from smartshoe.units import Unit, declared, find_unit

# Usual units of each option, for the message to a user whose unit is unknown.
_USUAL = {"--time": "s, ms, us or min", "--force": "N, kN, kgf (kg), gf (of grams) or lbf"}
LOADS = ("force", "pressure")  # quantities that a load may have
_CHOICE = re.compile(r"(?P<base>.*?)\s*\[(?P<unit>[^\[\]]*)\]\s*", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Pick:
    """A column by its ``index``, and the ``unit`` in which its values are."""

    index: int
    unit: Unit | None  # the user's, given in brackets, else the file's


def unit_in_file(column: Column) -> Unit | None:
    """The unit that the file gives the column, even if the table of units lacks it; None without one."""
    text = column.unit.strip()
    if not text.strip("()[]{} "):
        return None
    return find_unit(text) or declared(text.strip("()[]{} "))


def titles(sheet: Sheet) -> str:
    """The sheet's columns as one text for the user."""
    return first_names([column.label or column.name or "''" for column in sheet.columns])


def _titled(columns: Sequence[Column], wanted: str) -> list[int]:
    """Indices of the columns with that header text, else of that name; exact matches, else ignoring case."""
    for alike in (str, str.casefold):
        for titles in ([c.label for c in columns], [c.name for c in columns]):
            found = [i for i, title in enumerate(titles) if wanted and alike(title) == alike(wanted)]
            if found:
                return found
    return []


def names_a_column(sheet: Sheet, choice: str) -> bool:
    """Whether a user's ``choice`` names a column of the sheet, by name or number; units are ignored."""
    bracket = _CHOICE.fullmatch(choice)
    bases = (choice.strip(), bracket["base"].strip()) if bracket else (choice.strip(),)
    return any(_titled(sheet.columns, base) or _other_way(sheet, base) for base in bases)


def _other_way(sheet: Sheet, base: str) -> list[int]:
    """Index of the column with that number, or which a recording calls so (see `_renamed`)."""
    return _numbered(sheet, base) or _renamed(sheet.columns, base)


def _renamed(columns: Sequence[Column], wanted: str) -> list[int]:
    """Index of the column that a recording calls ``wanted`` since another one has its name: NAME_other, NAME_2.

    Messages about recordings list such names for the user to choose from.
    """
    name, _, ending = wanted.rpartition("_")
    found = _titled(columns, name)
    if ending == "other":
        return found if len(found) == 1 else []
    return [found[int(ending) - 1]] if ending in map(str, range(2, len(found) + 1)) else []


def _numbered(sheet: Sheet, base: str) -> list[int]:
    if base.isascii() and base.isdigit() and 1 <= int(base) <= len(sheet.columns):
        return [int(base) - 1]
    return []


def pick(sheet: Sheet, choice: str, option: str) -> Pick:
    """The column that a user's ``choice`` names; raises `InputError` where none or several match."""
    columns = sheet.columns
    bracket = _CHOICE.fullmatch(choice)
    base, said = choice.strip(), None
    found = _titled(columns, base)
    if not found and bracket:
        base, said = bracket["base"].strip(), _said_unit(sheet, bracket["unit"], choice, option)
        found = _titled(columns, base)
        if len(found) > 1:
            found = [i for i in found if unit_in_file(columns[i]) == said] or found
    if len(found) > 1:
        raise InputError(
            f"{sheet.path}: {option} {choice!r} fits {len(found)} columns: add the unit in brackets, or rename one"
            f" of them (columns: {titles(sheet)})"
        )
    found = found or _other_way(sheet, base)
    if not found:
        raise MissingChannelError(
            f"{sheet.path} has no column {base!r} for {option}: choose one of its columns ({titles(sheet)}) by name"
            f" or by number from 1 to {len(columns)}"
        )
    return _united(sheet, found[0], said, option)


def _said_unit(sheet: Sheet, text: str, choice: str, option: str) -> Unit:
    """The unit in a user's brackets; for a sensor it may be any, as in a header, since its gain is identified."""
    found = find_unit(text)
    if found is None and option == "--sensor" and text.strip():
        found = declared(text.strip())
    weight = _weight_of(text, option)
    if found is None and weight is not None:
        raise UnitError(
            f"{sheet.path}: unit {text!r} in {option} {choice!r} is a mass: write '[{weight.symbol}]' for what"
            " it weighs"
        )
    if found is None:
        raise UnitError(
            f"{sheet.path}: unit {text!r} in {option} {choice!r} is not known: use one such as {_usual(option)}"
        )
    return found


def _weight_of(text: str, option: str) -> Unit | None:
    """The unit of force that corresponds to a mass unit given for a load (gf for g); None for other units."""
    weight = find_unit(f"{text.strip()}f") if option == "--force" else None
    return weight if weight is not None and weight.quantity == "force" else None


def _usual(option: str) -> str:
    """The usual units of an option, for the message to a user whose unit is unknown."""
    return _USUAL.get(option, "mbar, V, ohm or mm, and counts for bare numbers")


def _united(sheet: Sheet, index: int, said: Unit | None, option: str) -> Pick:
    column = sheet.columns[index]
    of_file = unit_in_file(column)
    is_other = said is not None and of_file is not None and of_file.quantity != "unknown" and said != of_file
    if said is not None and of_file is not None and is_other and not stands_for_a_load(of_file, said, option):
        raise UnitError(
            f"{sheet.path}: column {column.name!r} is in {of_file.symbol} by the file, {option} says {said.symbol}:"
            " leave the unit out"
        )
    return Pick(index, said or of_file)


def stands_for_a_load(of_file: Unit, said: Unit, option: str) -> bool:
    """Whether the user's unit makes a column of another quantity, such as a displacement, serve as the load."""
    return option == "--force" and said.quantity in LOADS and of_file.quantity not in (*LOADS, "unknown")


def need_unit(sheet: Sheet, found: Pick, option: str, example: str) -> Unit:
    """The pick's unit; raises `InputError` where neither file nor user gives it."""
    if found.unit is None:
        name, known, also = sheet.columns[found.index].name, "", ""
        if option == "--sensor":  # its unit may be any, even the suffix of its name or the name itself
            itself, ending = find_unit(name), name.rpartition("_")[2]
            example = example if itself is None else itself.symbol
            if ending not in ("", name):
                known, also = " that is known", f", or '{name}[{ending}]' if {ending} is one"
        raise InputError(
            f"{sheet.path} gives column {name!r} no unit{known}: add its own in brackets, for example"
            f" {option} '{name}[{example}]' (units such as {_usual(option)}){also}"
        )
    return found.unit


def need_quantity(sheet: Sheet, found: Pick, option: str, quantity: str, example: str) -> Unit:
    """The pick's unit; raises `UnitError` where it is not of ``quantity``, and the errors of `need_unit`."""
    in_unit = need_unit(sheet, found, option, example)
    if in_unit.quantity != quantity:
        also, weight = "", _weight_of(in_unit.symbol, option)
        if weight is not None:
            also = f", or write '[{weight.symbol}]' behind its name for what such a mass weighs"
        elif in_unit.quantity == "unknown":
            also = f", or say in brackets what it is in ({_usual(option)})"
        elif quantity == "force" and in_unit.quantity != "time":  # a stretched or bent unit is diagnosed like any other
            also = f", or write '[{example}]' behind its name to use its numbers in the load's place"
        raise UnitError(
            f"{sheet.path}: column {sheet.columns[found.index].name!r} for {option} is in {in_unit.symbol}, which is"
            f" no {quantity}: choose a column in a unit such as {example}{also}"
        )
    return in_unit
