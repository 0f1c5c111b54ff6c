"""A unit of a shoe under the machine: its stream is what the machine alone would have read, on a clock of its own."""

from __future__ import annotations

from itertools import islice
from typing import Any

import numpy as np
import pytest

from smartshoe.devices import open_machine, open_shoe
from smartshoe.devices.checks import check_shoe
from smartshoe.errors import DeviceError, UsageError
from smartshoe.protocol import dynamic_protocol

PROTOCOL = dynamic_protocol((200.0, 800.0), rest_s=2.0)


def _bench(**options: Any) -> tuple[Any, Any]:
    shoe: Any = open_shoe("sim:stand", **options)
    machine: Any = open_machine("sim:instron", seed=1)
    machine.under(shoe, "left_heel")
    return shoe, machine


def test_the_stream_is_the_machines_own_reading_on_the_shoes_clock() -> None:
    shoe, machine = _bench(clock_skew_ppm=150.0, clock_offset_s=2.5, seed=3)
    with shoe, machine:
        stream = shoe.blocks()
        blocks = list(islice(stream, 17))
        recording = machine.run(PROTOCOL)
        blocks += list(islice(stream, int(10 * PROTOCOL.duration_s) + 10))
    assert blocks[0].time_s[0] == 2.5
    time_s = np.concatenate([block.time_s for block in blocks])
    readings = np.concatenate([block.readings for block in blocks])
    began_s = 17 * 20 / 200.0 * (1.0 + 150e-6)
    assert shoe.bench.began_s == [pytest.approx(began_s)]
    machine_s = (time_s - 2.5) * (1.0 + 150e-6) - began_s
    inside = (machine_s >= 0.0) & (machine_s <= recording.time_s[-1])
    alone = np.interp(machine_s[inside], recording.time_s, recording.sensor.values)
    apart = readings[inside, blocks[0].names.index("left_heel")] - alone
    # Both have the sensor's noise, 0.05 % of 200 mbar; corners between two ticks of the myRIO add a little.
    assert np.std(apart) < 0.2
    assert abs(np.mean(apart)) < 0.02
    others = [column for column, name in enumerate(blocks[0].names) if name != "left_heel"]
    assert np.abs(readings[:, others]).max() < 1.0


def test_a_shoe_on_the_bench_keeps_the_contract_of_shoes_and_starts_anew_each_time() -> None:
    shoe, _ = _bench(seed=4)
    check_shoe(shoe)
    with shoe:
        first = next(shoe.blocks())
    with shoe:
        again = next(shoe.blocks())
    np.testing.assert_array_equal(first.time_s, again.time_s)


def test_a_test_that_is_not_over_cannot_be_begun_again() -> None:
    shoe, machine = _bench(seed=5)
    with shoe, machine:
        next(shoe.blocks())
        machine.run(PROTOCOL)
        with pytest.raises(DeviceError, match="still pressing"):
            machine.run(PROTOCOL)


def test_a_unit_that_the_shoe_does_not_have_cannot_lie_under_the_machine() -> None:
    with pytest.raises(UsageError, match="use one of left_toe"):
        open_machine("sim:instron").under(open_shoe("sim:stand"), "right_toe")
