"""Fits the three coefficients of one experiment without returning to Python, for banks of many fits."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from smartshoe.kernels.first_order import COLUMNS, inner_products, respond
from smartshoe.kernels.srivc import INSTRUMENT, REGRESSOR, TARGET, instrument_products


@njit(cache=True)
def _solve3(matrix, right, out):  # type: ignore[no-untyped-def]
    """Solve the leading 3 by 3 system by Cramer's rule into ``out``; False where it is singular."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 0], matrix[1, 1], matrix[1, 2]
    g, h, i = matrix[2, 0], matrix[2, 1], matrix[2, 2]
    p, q, r = e * i - f * h, f * g - d * i, d * h - e * g
    determinant = a * p + b * q + c * r
    if not abs(determinant) > 1e-14 * abs(a * e * i):
        return False
    x, y, z = right[0], right[1], right[2]
    out[0] = (p * x + (c * h - b * i) * y + (b * f - c * e) * z) / determinant
    out[1] = (q * x + (a * i - c * g) * y + (c * d - a * f) * z) / determinant
    out[2] = (r * x + (b * g - a * h) * y + (a * e - b * d) * z) / determinant
    return True


@njit(cache=True)
def _start(u, y, step, pole, theta):  # type: ignore[no-untyped-def]
    """SRIVC (Chinimilli 2016, Section V) of ``u`` and ``y`` into theta = (ln alpha, p1, p2); False if it fails."""
    every = np.empty(0, dtype=np.bool_)
    products, normal, right, solution = np.empty((COLUMNS, COLUMNS)), np.empty((3, 3)), np.empty(3), np.empty(3)
    instrument = y.copy()
    for _ in range(20):
        products[:] = 0.0
        instrument_products(u, y, instrument, every, step, None, pole, products)
        for i in range(3):
            row = products[INSTRUMENT if i == 0 else i]
            normal[i, 0], normal[i, 1], normal[i, 2], right[i] = row[REGRESSOR], row[1], row[2], row[TARGET]
        if not _solve3(normal, right, solution) or not math.isfinite(solution[0]) or solution[0] == 0.0:
            return False
        alpha = min(max(abs(solution[0]), 1e-4 / (u.size * step)), 1.0 / step)
        settled = abs(alpha - pole) < 1e-3 * alpha
        pole = alpha
        p1, p2 = solution[1], solution[2] / alpha
        theta[0], theta[1], theta[2] = math.log(alpha), p1, p2
        if settled:
            return True
        respond(u, step, None, 0.0, alpha, p1, p2, 0.0, 0.0, instrument)
    return False


@njit(cache=True, nogil=True)
def fit_coefficients(u, y, step, pole, factor, theta, normal):  # type: ignore[no-untyped-def]
    """Gauss-Newton from SRIVC; returns cost, passes over the data, and whether it converged.

    ``u``, ``y`` (n,) are input and output ``step`` s apart, without offset or delay, steady before; ``pole`` is SRIVC's
    first lambda, on means of ``factor`` samples. ``theta`` (3,) becomes (ln alpha, p1, p2), ``normal`` (3, 3) J'J.
    """
    none, stored = np.empty(0), np.empty((0, 0))
    every = np.empty(0, dtype=np.bool_)
    products, change = np.empty((COLUMNS, COLUMNS)), np.empty(3)
    blocks = u.size // factor
    thin_u, thin_y = np.empty(blocks), np.empty(blocks)
    for k in range(blocks):
        s, t = 0.0, 0.0
        for j in range(k * factor, (k + 1) * factor):
            s += u[j]
            t += y[j]
        thin_u[k], thin_y[k] = s / factor, t / factor
    if not _start(thin_u, thin_y, step * factor, pole, theta) and not _start(u, y, step, pole, theta):
        return math.nan, 0, False
    cost = math.inf
    before = theta.copy()
    gradient = np.empty(3)
    scaled = np.empty((3, 3))
    for passes in range(1, 60):
        products[:] = 0.0
        inner_products(
            u, none, y, every, step, None, 0.0, math.exp(theta[0]), theta[1], theta[2], 0.0, 0.0, stored, products
        )
        following = products[COLUMNS - 1, COLUMNS - 1]
        if not following <= cost * (1.0 + 1e-14):
            for i in range(3):
                theta[i] = 0.5 * (theta[i] + before[i])
            continue
        cost = following
        for i in range(3):
            gradient[i] = products[i, COLUMNS - 1]
            for j in range(3):
                normal[i, j] = products[i, j]
        for i in range(3):
            for j in range(3):
                scaled[i, j] = normal[i, j] / math.sqrt(normal[i, i] * normal[j, j])
            gradient[i] /= math.sqrt(normal[i, i])
        if not _solve3(scaled, gradient, change):
            return cost, passes, False
        promised = change[0] * gradient[0] + change[1] * gradient[1] + change[2] * gradient[2]
        relative = 0.0
        for i in range(3):
            before[i] = theta[i]
            change[i] /= math.sqrt(normal[i, i])
            theta[i] -= change[i]
            relative = max(relative, abs(change[i]) / (abs(theta[i]) + 1e-300))
        # A step of 1e-5 standard errors is worth taking, but not another pass over the data.
        if promised <= 1e-10 * cost / u.size or relative < 1e-12:
            return cost, passes, True
    return cost, passes, False
