"""Operators with memory that several laws need, compiled or vectorised; steps are even, signals start at rest."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from smartshoe.arrays import Array


def integral(signal: Array, step_s: float) -> Array:
    """Integral (n,) by the trapezoid rule; the signal is 0 before the first sample."""
    before = np.concatenate([[0.0], signal[:-1]])
    return np.asarray(np.cumsum(0.5 * step_s * (signal + before)))


def lagged(signal: Array, time_constant_s: float, step_s: float) -> Array:
    """The signal (n,) through a first-order lag, exact where it is linear within a step."""
    out = np.empty(signal.size)
    modes(signal, step_s, np.array([1.0 / time_constant_s]), np.array([1.0]), out)
    return signal - out


def against_modes(signal: Array, step_s: float, rate: Array, weight: Array) -> Array:
    """sum_j w_j (x - q_j) (n,) with q_j' = rate_j (x - q_j): stress of Maxwell arms, or heat still in the gas."""
    out = np.empty(signal.size)
    modes(np.ascontiguousarray(signal), step_s, np.ascontiguousarray(rate), np.ascontiguousarray(weight), out)
    return out


@njit(cache=True)
def modes(signal: Array, step_s: float, rate: Array, weight: Array, out: Array) -> None:
    """Fill ``out`` (n,) with sum_j w_j (x - q_j), q_j' = rate_j (x - q_j); the compiled part of `against_modes`."""
    keep = np.exp(-rate * step_s)
    mean = -np.expm1(-rate * step_s) / (rate * step_s)
    q = np.zeros(rate.size)
    before = 0.0
    for i in range(signal.size):
        x = signal[i]
        total = 0.0
        for j in range(rate.size):
            q[j] = keep[j] * q[j] + (mean[j] - keep[j]) * before + (1.0 - mean[j]) * x
            total += weight[j] * (x - q[j])
        out[i] = total
        before = x


@njit(cache=True)
def norton(signal: Array, step_s: float, time_constant_s: float, scale: float, power: float, out: Array) -> None:
    """Fill ``out`` (n,) with s = x - q, q' = scale/tau |s/scale|^power sgn s: an arm whose dashpot is a power law.

    Implicit, with the secant of the stress, so that it is stable at any step.
    """
    q, before = 0.0, 0.0
    for i in range(signal.size):
        x = signal[i]
        middle = 0.5 * (x + before)
        stress = abs(middle - q) / scale
        rate = stress ** (power - 1.0) / time_constant_s if stress > 0.0 else 0.0
        for _ in range(3):
            half = 0.5 * step_s * rate
            new = (q * (1.0 - half) + 2.0 * half * middle) / (1.0 + half)
            stress = abs(middle - 0.5 * (q + new)) / scale
            rate = stress ** (power - 1.0) / time_constant_s if stress > 0.0 else 0.0
        q = new
        out[i] = x - q
        before = x


@njit(cache=True)
def slip(signal: Array, up: Array, down: Array, weight: Array, out: Array) -> None:
    """Fill ``out`` (n,) with sum_j w_j z_j, springs behind sliders that slip at ``up`` and at -``down``."""
    z = np.zeros(weight.size)
    before = 0.0
    for i in range(signal.size):
        way = signal[i] - before
        before = signal[i]
        total = 0.0
        for j in range(weight.size):
            z[j] = min(max(z[j] + way, -down[j]), up[j])
            total += weight[j] * z[j]
        out[i] = total


@njit(cache=True)
def jiles_atherton(signal: Array, pin: float, scale: float, out: Array) -> None:
    """Fill ``out`` (n,) with the lag of m behind the anhysteretic a = tanh(x/scale): dm/dx = (a - m)/(pin sgn dx).

    The slope is never negative: where the anhysteretic lies on the other side, m does not change (Jiles and Atherton
    1986, eq. 14).
    """
    m, before = 0.0, 0.0
    for i in range(signal.size):
        way = signal[i] - before
        before = signal[i]
        steps = 1 + int(abs(way) / (0.1 * pin))
        for k in range(steps):
            x = signal[i] - way * (1.0 - (k + 1.0) / steps)
            aim = math.tanh(x / scale)
            gap = aim - m
            if gap * way > 0.0:
                m += gap * -math.expm1(-abs(way) / (steps * pin))
        out[i] = math.tanh(signal[i] / scale) - m


@njit(cache=True)
def endochronic(signal: Array, width: float, hardening: float, out: Array) -> None:
    """Fill ``out`` (n,) with z, dz = dx/width - z |dx|/(width g), g = 1 + hardening ln(1 + path) (Valanis 1971)."""
    z, before, gone = 0.0, 0.0, 0.0
    for i in range(signal.size):
        way = signal[i] - before
        before = signal[i]
        grip = 1.0 + hardening * math.log1p(gone)
        keep = math.exp(-abs(way) / (width * grip))
        sense = 1.0 if way > 0.0 else -1.0
        if way != 0.0:
            z = keep * z + sense * grip * (1.0 - keep)
        gone += abs(way)
        out[i] = z


@njit(cache=True)
def cycles_done(signal: Array, begins: float, ends: float, out: Array) -> None:
    """Fill ``out`` (n,) with how often the signal has risen above ``begins`` and then fallen below ``ends``."""
    inside, done = False, 0.0
    for i in range(signal.size):
        if signal[i] > begins:
            inside = True
        elif inside and signal[i] < ends:
            inside = False
            done += 1.0
        out[i] = done


@njit(cache=True)
def opening_port(signal: Array, step_s: float, time_constant_s: float, opening: float, out: Array) -> None:
    """Fill ``out`` (n,) with y, y' = (1 + opening |y|)(x - y)/tau: a port that the pressure widens."""
    y = 0.0
    before = 0.0
    for i in range(signal.size):
        rate = (1.0 + opening * abs(y)) / time_constant_s
        z = rate * step_s
        keep = math.exp(-z)
        mean = (1.0 - keep) / z
        y = keep * y + (mean - keep) * before + (1.0 - mean) * signal[i]
        before = signal[i]
        out[i] = y
