"""Exported C compiled and run: what the tests of the export share."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
COMPILER = shutil.which("gcc") or shutil.which("cc")
ARM = shutil.which("arm-none-eabi-gcc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (gcc or cc) on the path")
needs_arm = pytest.mark.skipif(ARM is None, reason="no arm-none-eabi-gcc on the path")
CORES = {
    "Cortex-M0+": ["-mcpu=cortex-m0plus", "-mthumb"],
    "Cortex-M4": ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
}
NUMPY = {"double": np.float64, "float": np.float32, "int32_t": np.int32, "int16_t": np.int16}


def compiled(sources: list[Path], out: Path, *flags: str, compiler: str | None = COMPILER) -> Path:
    """``sources`` as ``out``; any warning fails."""
    assert compiler is not None
    done = subprocess.run(
        [compiler, *FLAGS, *flags, *map(str, sources), "-o", str(out), *([] if "-c" in flags else ["-lm"])],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return out


def run_filters(folder: Path, readings: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What filters in ``folder``, linked into one library, give for the readings (n,) under their names, as doubles."""
    kinds = {name: push_type(folder, name) for name in readings}
    lines = [f'#include "{name}.h"' for name in kinds] + [
        f"void run_{name}(const {kind} *in, {kind} *out, long n);\n"
        f"void run_{name}(const {kind} *in, {kind} *out, long n)\n{{\n    {name} filter;\n    long k;\n"
        f"    {name}_init(&filter);\n    for (k = 0; k < n; k++) {{\n        out[k] = {name}_push(&filter, in[k]);\n"
        "    }\n}"
        for name, kind in kinds.items()
    ]
    (folder / "run.c").write_text("\n".join(lines) + "\n")
    sources = [*(folder / f"{name}.c" for name in kinds), folder / "run.c"]
    library = ctypes.CDLL(str(compiled(sources, folder / "filters.so", "-shared", "-fPIC")))
    found = {}
    for name, kind in kinds.items():
        given = np.ascontiguousarray(readings[name], dtype=NUMPY[kind])
        out = np.empty_like(given)
        pointers = (ctypes.c_void_p(array.ctypes.data) for array in (given, out))
        getattr(library, f"run_{name}")(*pointers, ctypes.c_long(given.size))
        found[name] = out.astype(float)
    return found


def push_type(folder: Path, name: str) -> str:
    """The C type that the filter takes and gives."""
    found = re.search(rf"^(\w+) {name}_push\(", (folder / f"{name}.h").read_text(), re.MULTILINE)
    assert found is not None
    return found[1]


def macro(folder: Path, name: str) -> float:
    """A number that a header in ``folder`` defines."""
    (found,) = (
        m[1] for path in folder.glob("*.h") for m in re.finditer(rf"^#define {name} (\S+)$", path.read_text(), re.M)
    )
    return float(found)
