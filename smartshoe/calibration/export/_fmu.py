"""Target ``fmu``: an FMI 3.0 co-simulation unit around the exported C code, without Python inside."""

from __future__ import annotations

import hashlib
import io
import os
import platform
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from smartshoe.calibration.export._c99 import c_files
from smartshoe.calibration.export._model import FilterModel
from smartshoe.calibration.export._rendering import render
from smartshoe.calibration.export._twin import TwinModel
from smartshoe.errors import UsageError
from smartshoe.units import NEWTON, Unit

LIBRARY = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("windows", ".dll")}
MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-fPIC")
DATED = (1980, 1, 1, 0, 0, 0)  # the earliest date of a zip file; constant, so that equal units give equal files


class Variable(NamedTuple):
    """An input or output in the model description."""

    name: str
    unit: str
    says: str


def fmu_files(model: FilterModel) -> dict[str, bytes]:
    """NAME.fmu of the filter, file name to bytes: input ``reading``, output ``force`` in N, at the model's rate."""
    sources = c_files(model)
    reading = model.calibration.reading_unit
    return _unit(
        model,
        {name: sources[name] for name in (f"{model.name}.h", f"{model.name}.c")},
        Variable("reading", reading.symbol, "reading of the unit, offset included"),
        Variable("force", NEWTON.symbol, "force, compression positive"),
        start_value=model.calibration.offset,
    )


def twin_files(model: TwinModel) -> dict[str, bytes]:
    """NAME.fmu of the unit itself, file name to bytes: input ``load`` in N, output ``reading``."""
    reading = model.calibration.reading_unit
    return _unit(
        model,
        model.sources(),
        Variable("load", NEWTON.symbol, "load on the unit, compression positive"),
        Variable("reading", reading.symbol, "reading of the unit, offset included"),
        start_value=0.0,
    )


def _unit(
    model: FilterModel | TwinModel,
    sources: Mapping[str, str],
    given: Variable,
    found: Variable,
    *,
    start_value: float,
) -> dict[str, bytes]:
    from smartshoe.version import __version__

    # The token tells whether binary and description belong together.
    token = hashlib.sha256("".join(sources.values()).encode()).hexdigest()[:32]
    values: dict[str, Any] = {
        "token": token,
        "step_s": repr(1.0 / model.sample_rate_hz),
        "start_value": repr(start_value),
        "input": given,
        "output": found,
        "says": f"{model.calibration.unit or 'unnamed unit'}, {model.provenance['model']}",
        "version": __version__,
        "units": _units(model.calibration.reading_unit),
    }
    texts = {
        "modelDescription.xml": render("modelDescription.xml.j2", model, **values),
        "documentation/index.html": render("documentation.html.j2", model, **values),
        "sources/buildDescription.xml": render("buildDescription.xml.j2", model),
        "sources/fmi3.c": render("fmi3.c.j2", model, **values),
        **{f"sources/{name}": text for name, text in sources.items()},
    }
    files = {name: text.encode() for name, text in texts.items()}
    files |= _binary(model.name, {name: files[f"sources/{name}"] for name in (*sources, "fmi3.c")})
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, DATED)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return {f"{model.name}.fmu": packed.getvalue()}


def compiler() -> str | None:
    """The C compiler: that of the environment variable CC, else cc, gcc or clang; None where there is none."""
    wanted = os.environ.get("CC")
    return next((path for name in (wanted, "cc", "gcc", "clang") if name and (path := shutil.which(name))), None)


def _binary(name: str, sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """The compiled library for this platform, path in the unit to bytes.

    Raises `UsageError` without a compiler, on a platform that FMI has no name for, and where the code does not compile.
    """
    found = compiler()
    system, machine = LIBRARY.get(platform.system()), MACHINES.get(platform.machine().lower())
    if found is None or system is None or machine is None:
        lacking = "a C compiler (set CC, or install gcc or clang)" if found is None else "a platform that FMI knows"
        raise UsageError(f"target fmu needs {lacking}: the unit runs on its own library; or export with --to c")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for file, content in sources.items():
            (folder / file).write_bytes(content)
        out = folder / f"{name}{system[1]}"
        code = [file for file in sources if file.endswith(".c")]
        # Compiled inside the folder, so that no absolute path gets into the library.
        done = subprocess.run(
            [found, *FLAGS, *code, "-o", out.name, "-lm"], cwd=folder, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise UsageError(f"{found} could not compile the unit ({' '.join(done.stderr.split())[:300]}): set CC")
        return {f"binaries/{machine}-{system[0]}/{out.name}": out.read_bytes()}


def _units(reading: Unit) -> list[dict[str, str]]:
    """Names and base units of the variables' units; only pressure and force are related to SI."""
    base = 'kg="1" m="1" s="-2"'
    known = {"N": base, "s": 's="1"'}
    if reading.quantity == "pressure":
        known[reading.symbol] = f'kg="1" m="-1" s="-2" factor="{reading.scale!r}"'
    elif reading.quantity == "force":
        known[reading.symbol] = f'{base} factor="{reading.scale!r}"'
    else:
        known[reading.symbol] = ""
    return [{"name": name, "base": text} for name, text in known.items()]
