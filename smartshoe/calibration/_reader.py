"""Reads typed values from a calibration's JSON; errors name file and key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smartshoe.errors import InputError
from smartshoe.files.gate import parsed_json, read_text
from smartshoe.models.effects import why_not_known
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.parameter import Parameter


def parsed(path: Path | str) -> Any:
    """The content of a JSON file; raises `InputError` naming the file where it cannot be read or is not valid JSON."""
    text = read_text(Path(path), "a calibration that identify wrote")
    try:
        return parsed_json(text)
    except ValueError as error:
        raise InputError(
            f"{path} is truncated or no JSON ({error}): write it anew with identify --calibration"
        ) from error


@dataclass(frozen=True)
class Reader:
    """Reads typed values from a JSON object; errors name file and key."""

    path: str

    def fault(self, key: str, what: str) -> InputError:
        """The error that reports ``what`` is wrong with ``key``."""
        return InputError(f"{self.path}: key '{key}' {what}: write the file anew with identify --calibration")

    def _get(self, found: Mapping[str, Any], key: str, above: str) -> Any:
        if key not in found:
            raise self.fault(above + key, "is missing")
        return found[key]

    def number(self, found: Mapping[str, Any], key: str, above: str = "") -> float:
        """The finite number under ``key``.

        ``above`` is the path of ``found`` in the file for messages, with a final full stop.
        """
        value = self._get(found, key, above)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.fault(above + key, f"is {value!r}, not a finite number")
        return float(value)

    def maybe(self, value: Any, key: str) -> float:
        """``value`` as a finite number, NaN where it is null."""
        if value is None:
            return math.nan
        return self.number({key: value}, key)

    def text(self, found: Mapping[str, Any], key: str, above: str = "") -> str:
        """The text under ``key``."""
        value = self._get(found, key, above)
        if not isinstance(value, str):
            raise self.fault(above + key, f"is {value!r}, not a text")
        if not value.isprintable():
            raise self.fault(above + key, f"is {value!r}, which cannot be printed")
        return value

    def mapping(self, found: Mapping[str, Any], key: str, above: str = "") -> Mapping[str, Any]:
        """The object under ``key``."""
        value = self._get(found, key, above)
        if not isinstance(value, dict):
            raise self.fault(above + key, f"is {value!r}, not an object")
        return value

    def pair(self, found: Mapping[str, Any], key: str) -> tuple[float, float] | None:
        """The two numbers under ``key``, None where it is missing or null."""
        value = found.get(key)
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != 2:
            raise self.fault(key, f"is {value!r}, not two numbers")
        return self.number({key: value[0]}, key), self.number({key: value[1]}, key)

    def parameter(self, found: Mapping[str, Any], name: str, above: str) -> Parameter:
        """The parameter ``name`` with its uncertainty and unit."""
        item = self.mapping(found, name, above)
        key = f"{above}{name}."
        interval = item.get("ci95")
        if not isinstance(interval, list) or len(interval) != 2:
            raise self.fault(key + "ci95", f"is {interval!r}, not two numbers")
        unit = item.get("unit")
        if not isinstance(unit, str):
            raise self.fault(key + "unit", f"is {unit!r}, not a text")
        low, high = (self.maybe(bound, key + "ci95") for bound in interval)
        return Parameter(self.number(item, "value", key), self.maybe(item.get("sd"), key + "sd"), (low, high), unit)

    def extended(self, found: Mapping[str, Any], key: str) -> ExtendedModel | None:
        """The model under ``key``, None where there is none."""
        if key not in found:
            return None
        given = self.mapping(found, key)
        for name in ("gain", "relaxation_rate_per_s", "full_scale_load_n", "wall_ratio"):
            if not self.number(given, name, f"{key}.") > 0.0:
                raise self.fault(f"{key}.{name}", f"is {given[name]!r}, it must be above 0")
        if self.number(given, "full_scale_reading", f"{key}.") == 0.0:  # negative where readings fall with load
            raise self.fault(f"{key}.full_scale_reading", "is 0, it must not be")
        self.number(given, "relaxing_share", f"{key}.")
        self.text(given, "reading_unit", f"{key}.")
        effects = self.mapping(given, "effects", f"{key}.")
        for name in effects:
            above = f"{key}.effects.{name}."
            why = why_not_known(name)
            if why:
                raise InputError(
                    f"{self.path}: key '{above[:-1]}' is of an effect that is not known here ({why}): install or mend"
                    " the package that offers it"
                )
            for parameter in self.mapping(effects, name, f"{key}.effects."):
                self.number(effects[name], parameter, above)
        if "held_after_s" in given:
            held = self.mapping(given, "held_after_s", f"{key}.")
            for name in held:
                if name not in effects or self.number(held, name, f"{key}.held_after_s.") < 0.0:
                    raise self.fault(f"{key}.held_after_s.{name}", "is no time, from 0, of one of the effects")
        try:
            model = ExtendedModel.from_dict(given)
        except KeyError as error:
            raise self.fault(f"{key}.effects.*.{error.args[0]}", "is missing") from error
        except TypeError as error:
            raise self.fault(key, f"holds a key that is not known ({error})") from error
        for part in model.parts:
            surplus = set(effects[part.name]) - {parameter.name for parameter in part.effect.parameters}
            if surplus:
                raise self.fault(f"{key}.effects.{part.name}.{min(surplus)}", "is not known")
        return model
