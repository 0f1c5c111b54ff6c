"""The one gate through which everything from outside comes in: files, names, JSON, and readers that others wrote.

Behind it numbers are finite, sizes bounded before memory is taken, names inside their folder, and any fault is one
sentence (`smartshoe.errors`).
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
