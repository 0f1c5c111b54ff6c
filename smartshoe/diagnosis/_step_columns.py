"""Steps at moments of a session: contributions that start there and stay, without a column of samples for each."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.diagnosis._session import Session


@dataclass(frozen=True, eq=False)
class StepColumns:
    """Steps of size ``by`` (n,) from each of ``starts`` (k,) on, both over the fitted samples."""

    by: Array
    starts: Index

    @classmethod
    def of(cls, session: Session, by: Array, moments: Index) -> StepColumns:
        """From ``by`` (n,) and ordered ``moments`` (k,), both over all samples."""
        return cls(by[session.fitted], np.searchsorted(np.flatnonzero(session.fitted), moments))

    def products(self, columns: Array) -> Array:
        """(m, k) inner products with columns (n, m)."""
        if not self.starts.size:
            return np.zeros((columns.shape[1], 0))
        parts = [columns[a:b].T @ self.by[a:b] for a, b in pairwise((*self.starts, self.by.size))]
        return np.asarray(np.cumsum(np.stack(parts[::-1], axis=1), axis=1)[:, ::-1])

    @property
    def power(self) -> Array:
        """(k,) sums of squares."""
        return np.asarray(self.products(self.by[:, None])[0])
