"""Gives an effect the requested strength: searches its amount, measuring the residual that each trial leaves."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from simulators.benches.instron import SimulatedInstron
from simulators.hidden._baseline import left_over
from simulators.hidden._machine import machine_of
from simulators.hidden.effects import SHARE_OF_RANGE, Hideable, Options, Subject, merged
from smartshoe.protocol import Protocol

Trial = Callable[[float], tuple[float, bool]]

TOLERANCE = 0.02  # of the requested strength
MOST_TRIALS = 24
SILENT: Options = {"load_noise_n": 0.0, "extension_noise_m": 0.0, "daq": {"bits": 24}}


@dataclass(frozen=True)
class HiddenEffect:
    """One hidden effect, with its parameters and strength.

    ``parameters`` are the truth's own, named by their place in the machine's options (``bladder.contact.gap_n``).
    ``catalogue`` are those of the catalogue's equation, as far as the two are comparable (`simulators.hidden.effects`).
    ``strength_percent_fs`` is the strength reached, ``asked_percent_fs`` the one requested; ``note`` says why where the
    two differ by more than a twentieth.
    """

    name: str
    family: str
    stage: str
    inside: bool
    asked_percent_fs: float
    strength_percent_fs: float
    parameters: Mapping[str, float]
    catalogue: Mapping[str, float]
    note: str = ""


def scaled(
    effect: Hideable, asked: float, subject: Subject, protocol: Protocol, seed: int, logger: Options
) -> tuple[Options, HiddenEffect]:
    """The machine options that give ``effect`` the strength ``asked``, or the nearest possible one."""
    draws = effect.draw(np.random.default_rng([seed, zlib.crc32(effect.name.encode())]), subject)

    def options(amount: float) -> Options:
        return effect.options(amount, draws, subject)

    def strength(amount: float) -> tuple[float, bool]:
        given = merged(subject.options(), logger, options(amount), SILENT)
        return _strength(given, subject, effect, protocol, seed)

    amount, reached, note = search(strength, asked, effect)
    return options(amount), HiddenEffect(
        name=effect.name,
        family=effect.family,
        stage=effect.stage,
        inside=effect.inside,
        asked_percent_fs=asked,
        strength_percent_fs=reached,
        parameters=_flat(options(amount)),
        catalogue=effect.catalogue(amount, draws, subject, logger["daq"]["sample_rate_hz"]),
        note=note,
    )


def _strength(
    options: Options, subject: Subject, effect: Hideable, protocol: Protocol, seed: int
) -> tuple[float, bool]:
    """Strength in percent of full scale of the unit with ``options``, and whether the sensor's output was clipped."""
    with machine_of(options, seed) as machine:
        recording = machine.run(protocol)
        clipped = clipped_at_an_end(machine)
    load_n = recording.force_n
    reading = recording["pressure"].with_nan()
    full_scale = SHARE_OF_RANGE * float(options["sensor"]["range_mbar"])
    left = left_over(load_n, reading, recording.sample_time_s, constant=not effect.needs_zero)
    return 100.0 * left / full_scale, clipped


def clipped_at_an_end(machine: SimulatedInstron) -> bool:
    """Whether the sensor's output reached an end of its range in the machine's last run."""
    if machine.truth is None:
        return False
    sensor = machine.specimen.sensor.parameters
    share = (machine.truth.reading_v - sensor.unloaded_v) / sensor.span_v
    return bool(np.abs(share).max() >= 1.0 + sensor.over_range_fraction - 1e-9)


def search(strength: Trial, asked: float, effect: Hideable) -> tuple[float, float, str]:
    """The amount for the strength ``asked``, the strength reached, and a remark where they differ.

    A secant in logarithms within the bracket of too weak and too strong amounts. Where even the largest amount is too
    weak, smaller ones are tried, since a baseline may absorb much of a large effect.
    """
    low, high = 0.0, effect.largest
    tried: list[tuple[float, float, bool]] = []
    amount = min(effect.typical * asked, 0.5 * effect.largest)
    for _ in range(MOST_TRIALS):
        found, clipped = strength(amount)
        tried.append((amount, found, clipped))
        if not clipped and abs(np.log(max(found, 1e-12) / asked)) <= TOLERANCE:
            return amount, found, ""
        if clipped or found > asked:
            high = amount
        else:
            low = amount
        if low >= effect.largest or (low > 0 and high / low < 1.0 + 1e-4) or high < 1e-6 * effect.typical:
            break
        guess = _secant(tried, asked)
        if clipped or not low < guess:
            guess = 0.5 * (low + high)
        if guess >= high:
            guess = effect.largest if high == effect.largest else 0.5 * (low + high)
        amount = guess
    if all(found < asked for _, found, _ in tried):
        for amount in np.geomspace(0.02, 0.7, 6) * effect.largest:
            tried.append((float(amount), *strength(float(amount))))
    sound = [(a, f) for a, f, clipped in tried if not clipped]
    if not sound:
        return 0.0, 0.0, "even the smallest amount clips the sensor's output"
    amount, found = min(sound, key=lambda t: abs(np.log(max(t[1], 1e-12) / asked)))
    if abs(found / asked - 1.0) <= 0.05:
        return amount, found, ""
    if any(clipped and f <= 2.0 * asked for _, f, clipped in tried) and found < asked:
        return amount, found, "more would clip the sensor's output"
    if found < asked and all(f < asked for _, f, _ in tried):
        return amount, found, f"the most that {effect.parameter} up to {effect.largest:g} {effect.unit} leaves"
    return amount, found, "its strength moves in steps"


def _secant(tried: list[tuple[float, float, bool]], asked: float) -> float:
    """The amount of strength ``asked``, if strength is a power of the amount between the last two trials."""
    amount, found, _ = tried[-1]
    slope = 1.0
    if len(tried) > 1:
        before, had, _ = tried[-2]
        if found > 0 and had > 0 and abs(np.log(amount / before)) > 1e-9:
            slope = float(np.clip(np.log(found / had) / np.log(amount / before), 0.3, 4.0))
    return amount * float(np.clip((asked / max(found, 1e-12)) ** (1.0 / slope), 1 / 30, 30))


def _flat(options: Options, before: str = "") -> dict[str, float]:
    flat: dict[str, float] = {}
    for key, value in options.items():
        if isinstance(value, dict):
            flat.update(_flat(value, f"{before}{key}."))
        elif isinstance(value, int | float) and not isinstance(value, bool):
            flat[before + key] = float(value)
    return flat
