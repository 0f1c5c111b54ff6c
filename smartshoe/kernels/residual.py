"""Passes over a residual for its tests: autocorrelation and orthogonalisation."""

from __future__ import annotations

import math

from numba import njit

CHUNK = 1024  # samples that stay in the first-level cache
DEPENDENT = 1e-10  # of its norm: a row with less left after projection depends on those before
_LAX = {"reassoc", "contract", "nsz"}


@njit(cache=True, fastmath=_LAX)
def _dot(a, b):  # type: ignore[no-untyped-def]
    total = 0.0
    for j in range(a.size):
        total += a[j] * b[j]
    return total


@njit(cache=True, fastmath=_LAX)
def lagged_products(signal, counted, products, pairs):  # type: ignore[no-untyped-def]
    """Add the sums over k of signal[k] signal[k - lag], lag 0 ..., to ``products``, and their counts to ``pairs``.

    ``signal`` (n,) must be 0 where the mask ``counted`` (n,) is False; only pairs of counted samples are included.
    """
    whole = False
    for at in range(0, signal.size, CHUNK):
        end = min(at + CHUNK, signal.size)
        count = 0
        for k in range(at, end):
            count += counted[k]
        whole_before, whole = whole, count == end - at
        for lag in range(products.size):
            first = max(at, lag)
            if first >= end:
                break
            now, before = signal[first:end], signal[first - lag : end - lag]
            products[lag] += _dot(now, before)
            if whole and (whole_before or at == 0) and lag <= CHUNK:
                pairs[lag] += end - first
            else:
                here, there = counted[first:end], counted[first - lag : end - lag]
                both = 0
                for j in range(here.size):
                    both += here[j] & there[j]
                pairs[lag] += both


@njit(cache=True, fastmath=_LAX)
def orthogonalise(rows, basis):  # type: ignore[no-untyped-def]
    """Orthonormalise the first ``basis`` of ``rows`` (r, n); normalise the rest, then project the basis out; in place.

    Modified Gram-Schmidt, since normal equations would lose half of the digits. A row of the basis that depends on
    those before becomes 0.
    """
    for i in range(rows.shape[0]):
        row = rows[i]
        norm = math.sqrt(_dot(row, row))
        scale = 1.0 / norm if norm > 0.0 else 0.0
        for j in range(row.size):
            row[j] *= scale
        for _ in range(2 if i < basis else 1):  # twice, as the remainder of a basis row may be small
            for k in range(min(i, basis)):
                other = rows[k]
                share = _dot(row, other)
                for j in range(row.size):
                    row[j] -= share * other[j]
        if i < basis:
            left = math.sqrt(_dot(row, row))
            scale = 1.0 / left if left > DEPENDENT else 0.0
            for j in range(row.size):
                row[j] *= scale
