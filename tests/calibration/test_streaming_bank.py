"""The compiled bank against its slow twin, `Compensator`, and the safety of ``out``."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Compensator, stack
from smartshoe.errors import InputError, UsageError
from smartshoe.units import MILLIBAR


def some_filters(units: int) -> list[Compensator]:
    return [Compensator(0.1 + 0.3 * n, 1.593 + n, 0.3249, offset=1.5 * n) for n in range(units)]


def some_readings(seed: int, ticks: int, units: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    readings = 100.0 * rng.standard_normal((ticks, units)).cumsum(axis=0)
    readings[rng.random(readings.shape) < 0.15] = np.nan
    readings[rng.random(readings.shape) < 0.05] = -np.inf
    return readings


@given(
    seed=st.integers(0, 1000),
    units=st.integers(1, 9),
    ticks=st.integers(0, 60),
    cuts=st.lists(st.integers(0, 60), max_size=6),
)
@settings(max_examples=60)
def test_a_bank_has_the_bits_of_its_filters_in_any_chunks(seed: int, units: int, ticks: int, cuts: list[int]) -> None:
    filters, readings = some_filters(units), some_readings(seed, ticks, units)
    singles = [filter_.push(readings[:, unit]) for unit, filter_ in enumerate(filters)]
    bank = stack(filters)
    parts = [bank.push(part) for part in np.split(readings, sorted(cuts))]
    assert np.array_equal(np.concatenate(parts), np.stack(singles, axis=1))
    assert bank.missing_count == tuple(filter_.missing_count for filter_ in filters)
    bank.reset()
    buffer = np.empty(units)
    for tick, expected in zip(readings, np.stack(singles, axis=1), strict=True):
        assert bank.push(tick, out=buffer) is buffer
        assert np.array_equal(buffer, expected)
    assert bank.missing_count == tuple(filter_.missing_count for filter_ in filters)


@pytest.mark.parametrize("kind", ["list", "float32", "strided", "read-only", "fortran", "in place"])
@pytest.mark.parametrize("with_out", [True, False])
@pytest.mark.parametrize("ndim", [1, 2])
def test_any_kind_of_array_gives_the_same_forces(kind: str, with_out: bool, ndim: int) -> None:
    block = np.round(some_readings(3, 20, 8)) if ndim == 2 else np.arange(8.0)
    wide = np.zeros((*block.shape[:-1], 16))
    wide[..., ::2] = block
    frozen = block.copy()
    frozen.flags.writeable = False
    given_as = {
        "list": block.tolist(), "float32": block.astype(np.float32), "strided": wide[..., ::2],
        "read-only": frozen, "fortran": np.asfortranarray(block), "in place": block.copy(),
    }[kind]  # fmt: skip
    out = (given_as if kind == "in place" else np.empty(block.shape)) if with_out else None
    forces_n = stack(some_filters(8)).push(given_as, out=out)
    assert np.array_equal(forces_n, stack(some_filters(8)).push(block))
    assert out is None or forces_n is out


def test_a_bank_is_as_long_as_its_filters_are_many() -> None:
    assert [len(stack([Compensator(0.2, 5.0, 1.0)] * units)) for units in (1, 4)] == [1, 4]


def test_a_filter_and_a_bank_say_what_they_are() -> None:
    assert repr(stack(some_filters(2))) == "<CompensatorBank of 2 filters at 100 Hz>"
    assert repr(Compensator(0.2, 5.0, 1.0, sample_rate_hz=50.0)) == "<Compensator at 50 Hz>"
    of_pressure = Compensator(0.2, 5.0, 1.0, reading_unit=MILLIBAR)
    assert repr(of_pressure) == "<Compensator at 100 Hz of readings in mbar>"


def test_a_returned_array_is_never_written_to_again() -> None:
    bank = stack(some_filters(3))
    first = bank.push(np.ones(3))
    kept = first.copy()
    bank.push(np.full(3, 50.0))
    assert np.array_equal(first, kept)


def test_a_refused_push_leaves_the_bank_as_it_was() -> None:
    bank, other = stack(some_filters(3)), stack(some_filters(3))
    frozen = np.empty(3)
    frozen.flags.writeable = False
    for out in (np.empty(2), np.empty((3, 1)), np.empty(3, dtype=np.float32), np.empty(6)[::2], frozen):
        with pytest.raises(UsageError, match="out"):
            bank.push(np.full(3, 9.0), out=out)
    for wrong in (np.zeros(2), np.zeros((2, 2)), np.zeros((1, 1, 3)), 1.0):
        with pytest.raises(InputError, match="shape"):
            bank.push(wrong, out=np.empty(3))
    assert np.array_equal(bank.push(np.ones(3)), other.push(np.ones(3)))
    assert bank.missing_count == (0, 0, 0)
