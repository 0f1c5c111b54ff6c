"""Checks everything that comes from outside: files, names, JSON, and readers of other packages.

After these checks numbers are finite, sizes are bounded before memory is allocated, names stay inside their folder, and
any fault is one sentence (`smartshoe.errors`).
"""

from smartshoe.files.gate._files import read_bytes, read_text, require_regular_file
from smartshoe.files.gate._names import inside, require_file_name
from smartshoe.files.gate._objects import parsed_json
from smartshoe.files.gate._readers import foreign_code, require_columns, require_values
from smartshoe.files.gate.limits import Limits, limits, raise_limits

__all__ = [
    "Limits",
    "foreign_code",
    "inside",
    "limits",
    "parsed_json",
    "raise_limits",
    "read_bytes",
    "read_text",
    "require_columns",
    "require_file_name",
    "require_regular_file",
    "require_values",
]
