"""The tables and keys of a scenario, with errors that name the file, the line and the key."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    field_validator,
    model_validator,
)

from smartshoe.errors import InputError, OptionError, ScenarioError
from smartshoe.files.gate import read_text, require_file_name
from smartshoe.files.shipped import shipped
from smartshoe.protocol import (
    DYNAMIC_RATES_N_PER_S,
    STATIC_LOADS_N,
    Protocol,
    Segment,
    dynamic_protocol,
    static_protocol,
)
from smartshoe.runs.scenario._keys import Tables, with_values
from smartshoe.runs.scenario.lines import line_of


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _OpenTable(BaseModel):
    """A table whose additional keys are options of a device, which checks them."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)

    @property
    def options(self) -> dict[str, Any]:
        """The additional keys."""
        return dict(self.model_extra or {})


FileName = Annotated[str, AfterValidator(lambda name: require_file_name(name, "it"))]  # files are named after it


class ProtocolTable(_Table):
    """``[protocol.NAME]``: the paper's static or dynamic protocol, a variation of it, or straight segments of load.

    With kind "segments", ``corners`` are [time in s, load in N], beginning with [0, 0]; a constant load makes a segment
    a "hold", or a "rest" at 0 N.
    """

    kind: Literal["static", "dynamic", "segments"]
    corners: tuple[tuple[float, float], ...] = ()
    loads_n: tuple[PositiveFloat, ...] = STATIC_LOADS_N
    rates_n_per_s: tuple[PositiveFloat, ...] = DYNAMIC_RATES_N_PER_S
    peak_n: PositiveFloat = 800.0
    repeats: PositiveInt = 1
    rate_n_per_s: PositiveFloat = 50.0
    approach_n: float = Field(5.0, ge=0.0)
    approach_s: PositiveFloat = 5.0
    hold_s: PositiveFloat = 5.0
    rest_s: float = Field(5.0, ge=0.0)

    @field_validator("loads_n", "rates_n_per_s")
    @classmethod
    def _one_at_least(cls, given: tuple[float, ...]) -> tuple[float, ...]:
        if not given:
            raise ValueError("the list is empty: give one number at least")
        return given

    @model_validator(mode="after")
    def _keys_belong_to_the_kind(self) -> ProtocolTable:
        own = {
            "static": {"loads_n", "rate_n_per_s", "approach_n", "approach_s", "hold_s", "rest_s"},
            "dynamic": {"rates_n_per_s", "peak_n", "repeats", "rest_s"},
            "segments": {"corners"},
        }[self.kind]
        foreign = self.model_fields_set - own - {"kind"}
        if foreign:
            raise ValueError(f"{', '.join(sorted(foreign))} means nothing in a {self.kind} protocol")
        if self.kind == "segments":
            if len(self.corners) < 2 or self.corners[0] != (0.0, 0.0):
                raise ValueError("corners begin with [0, 0] and go on with one [time_s, load_n] at least")
            if any(not (later[0] > earlier[0] and later[1] >= 0) for earlier, later in pairwise(self.corners)):
                raise ValueError("corners must rise in time, with loads of 0 N or more")
        return self

    def build(self, name: str) -> Protocol:
        """Build the protocol, named ``name``."""
        if self.kind == "segments":
            return Protocol(name, tuple(_segment(before, after) for before, after in pairwise(self.corners)))
        if self.kind == "static":
            made = static_protocol(
                self.loads_n,
                rate_n_per_s=self.rate_n_per_s,
                approach_n=self.approach_n,
                approach_s=self.approach_s,
                hold_s=self.hold_s,
                rest_s=self.rest_s,
            )
        else:
            made = dynamic_protocol(self.rates_n_per_s, peak_n=self.peak_n, repeats=self.repeats, rest_s=self.rest_s)
        return Protocol(name, made.segments)


def _segment(before: tuple[float, float], after: tuple[float, float]) -> Segment:
    stays = before[1] == after[1]
    return Segment(("rest" if after[1] == 0 else "hold") if stays else "ramp", after[1], after[0] - before[0])


class MachineTable(_OpenTable):
    """``[machine]``: the backend's address; all other keys are options of the backend, which checks them."""

    backend: str = "sim:instron"

    @model_validator(mode="after")
    def _unit_and_seed_stand_elsewhere(self) -> MachineTable:
        _refuse_reserved(self.options)
        return self


class ColumnsTable(_Table):
    """``columns``: the columns of a unit's files, where they cannot be told from names and units."""

    time: str | None = None
    force: str | None = None
    sensor: str | None = None


def _refuse_reserved(options: dict[str, Any]) -> None:
    for key, place in (("unit", "a [[unit]] table's name"), ("seed", "the seed at the file's top")):
        if key in options:
            raise ValueError(f"{key} means nothing here: it is {place}")


class UnitTable(_OpenTable):
    """``[[unit]]``: a sensing unit.

    Its recordings are files, or are made by the machine; then all other keys are options of the machine.
    """

    name: FileName
    recordings: tuple[str, ...] = ()
    columns: ColumnsTable = ColumnsTable()

    @model_validator(mode="after")
    def _unit_and_seed_stand_elsewhere(self) -> UnitTable:
        _refuse_reserved(self.options)
        return self


class IdentifyTable(_Table):
    """``[identify]``: which experiments are fitted, and how."""

    use: tuple[str, ...] = ()
    direction: Literal["inverse", "forward"] = "inverse"
    method: Literal["srivc", "gn", "lm", "trf"] = "trf"
    structure: Literal["free", "grey_box"] = "free"
    offset: Literal["estimate"] | float = "estimate"
    delay: Literal["estimate"] | float = "estimate"
    initial_state: Literal["estimate", "steady"] = "estimate"
    prefilter_rad_s: PositiveFloat = 1.0
    sample_rate_hz: PositiveFloat = 100.0


class DiagnoseTable(_Table):
    """``[diagnose]``: which experiments are diagnosed and which are held out; optional, as is the diagnosis."""

    use: tuple[str, ...] = ()
    hold_out: tuple[str, ...] = ()
    material_percent: float = Field(0.02, gt=0.0, le=50.0)

    @model_validator(mode="after")
    def _what_judges_is_not_fitted(self) -> DiagnoseTable:
        if both := sorted({*self.use} & {*self.hold_out}):
            raise ValueError(f"{', '.join(both)} is to be fitted and held out at once: name it in use or in hold_out")
        return self


class ValidateTable(_Table):
    """``[validate]``: which experiments the calibration is validated on."""

    use: tuple[str, ...] = ()


class TrialGaitTable(_Table):
    """``[trial.gait]``: what the gait analysis is told about the person and the units."""

    body_weight_n: PositiveFloat | None = None
    coverage: float = Field(default=1.0, gt=0.0, le=1.0)
    coverage_course: Literal["even", "midfoot"] = "even"


class TrialTable(_OpenTable):
    """``[trial]``: a person in the shoes. All other keys are options of the shoe, which checks them.

    ``name`` is the name of the recording's file. A simulated shoe has the units of the scenario, with their bladders
    and sensors.
    """

    name: str = Field(default="trial", max_length=120, pattern=r"^[A-Za-z0-9][A-Za-z0-9_\-]*$")
    shoe: str = "sim:walk"
    gait: TrialGaitTable = TrialGaitTable()


class Scenario(_Table):
    """A whole scenario. ``seed`` is the root of every random draw."""

    title: str = "scenario"
    about: str = ""
    seed: int = Field(0, ge=0)
    machine: MachineTable = MachineTable()
    protocol: dict[FileName, ProtocolTable] = {}
    unit: tuple[UnitTable, ...] = Field(min_length=1)
    identify: IdentifyTable = IdentifyTable()
    validate_: ValidateTable = Field(ValidateTable(), alias="validate")
    diagnose: DiagnoseTable | None = None
    trial: TrialTable | None = None

    @model_validator(mode="before")
    @classmethod
    def _kind_defaults_to_the_name(cls, raw: Any) -> Any:
        protocols = raw.get("protocol") if isinstance(raw, dict) else None
        for name, table in protocols.items() if isinstance(protocols, dict) else ():
            if isinstance(table, dict) and name in ("static", "dynamic"):
                table.setdefault("kind", name)
        return raw


class ScenarioKeyError(ScenarioError):
    """A key of a scenario is wrong; ``reason`` says why, without file, line and key."""

    reason = ""


class ScenarioText:
    """The text of a scenario file, for error messages of the form 'FILE, line N, key K'."""

    def __init__(self, path: Path, text: str) -> None:
        self.path, self.text = path, text

    def error(self, keys: tuple[str | int, ...], message: str) -> ScenarioKeyError:
        """A `ScenarioError` whose message points at ``keys``."""
        line = line_of(self.text, keys)
        where = f"{self.path}, line {line}" if line else str(self.path)
        named = ".".join(str(key) for key in keys) or "the file"
        made = ScenarioKeyError(f"{where}, key {named}: {message}")
        made.reason = message
        return made

    def from_option(self, error: OptionError, prefix: tuple[str | int, ...]) -> ScenarioKeyError:
        """Convert a device's error about an option into one that points at the scenario's line."""
        cause = error.__cause__
        return (
            self.from_validation(cause, prefix)
            if isinstance(cause, ValidationError)
            else self.error((*prefix, *error.keys), str(error))
        )

    def from_validation(self, error: ValidationError, prefix: tuple[str | int, ...] = ()) -> ScenarioKeyError:
        """Convert the first of pydantic's errors into one that points at the scenario's line."""
        first = error.errors(include_url=False)[0]
        keys = (
            *prefix,
            *(part for part in first["loc"] if part not in ("function-before", "float", "literal")),
        )
        message = first["msg"].removeprefix("Value error, ")
        if first["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
            message = "this key is not known; remove it or mend its spelling"
        elif first["type"] == "missing":
            message = "this key is needed"
        else:
            message = f"{message[:1].lower()}{message[1:]} (it is {first['input']!r})"
        return self.error(keys, message)


def read_tables(path: Path | str, what: str = "a scenario") -> tuple[Tables, ScenarioText]:
    """The tables of a TOML file, unchecked, and its text; raises `ScenarioError` if it cannot be read.

    ``what`` says in errors what the file should be. ``scenarios/NAME.toml`` is found wherever smartshoe is installed.
    """
    file = Path(path)
    if file.parent == Path("scenarios") and not file.exists():
        file = shipped(file.as_posix()) or file
    try:
        text = read_text(file, what)
    except InputError as error:
        raise ScenarioError(str(error)) from error
    try:
        return tomllib.loads(text), ScenarioText(file, text)
    except (ValueError, RecursionError) as error:  # a number of 5000 digits raises a plain ValueError
        raise ScenarioError(f"{file} is not valid TOML: {error}; mend it there") from error


def load(path: Path | str, values: Mapping[str, Any] | None = None) -> tuple[Scenario, ScenarioText]:
    """Read and check a scenario file, after replacing ``values`` by dotted key (`smartshoe.runs.scenario._keys`).

    Raises `ScenarioError`, which says what is wrong, with line and key.
    """
    tables, source = read_tables(path)
    return checked(with_values(tables, values or {}), source), source


def checked(tables: Tables, source: ScenarioText) -> Scenario:
    """Check ``tables`` and return the scenario; ``[sweep]`` is ignored.

    Raises `ScenarioError`, which points into ``source``.
    """
    try:
        # A copy, since the check fills in the kinds of protocols.
        scenario = Scenario.model_validate(copy.deepcopy({k: v for k, v in tables.items() if k != "sweep"}))
    except ValidationError as error:
        raise source.from_validation(error) from error
    names = [unit.name for unit in scenario.unit]
    for index, unit in enumerate(scenario.unit):
        if names.index(unit.name) != index:
            raise source.error(("unit", index, "name"), f"unit {unit.name} is there twice; give it another name")
        if not unit.recordings and not scenario.protocol:
            raise source.error(("unit", index), "there is nothing to run: add recordings, or a [protocol.dynamic]")
    known = set(scenario.protocol) or {Path(r).stem for u in scenario.unit for r in u.recordings}
    used = [(("identify", "use"), scenario.identify.use), (("validate", "use"), scenario.validate_.use)]
    if scenario.diagnose is not None:
        used += [
            (("diagnose", "use"), scenario.diagnose.use),
            (("diagnose", "hold_out"), scenario.diagnose.hold_out),
        ]
    for keys, wanted in used:
        for name in wanted:
            if name not in known:
                raise source.error(keys, f"{name!r} is no experiment here; there are {', '.join(sorted(known))}")
    return scenario


__all__ = ["Scenario", "ScenarioKeyError", "ScenarioText", "UnitTable", "checked", "load", "read_tables"]
