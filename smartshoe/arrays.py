"""Arrays by what they hold; their shapes stand in the docstrings, ``(n,)`` for n samples, ``(n, r)`` for r columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]
Integers = NDArray[np.int64]
