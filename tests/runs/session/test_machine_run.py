"""A machine that moves by itself runs beside the stream; what goes wrong in it reaches the session."""

from __future__ import annotations

import threading
import time

import pytest

from smartshoe.devices import ChannelDescription, TestMachine, open_machine
from smartshoe.errors import DeviceError, LimitError
from smartshoe.protocol import MachineLimits, Protocol, dynamic_protocol
from smartshoe.recording import Recording
from smartshoe.runs.session._machine_run import RunMachine

QUICK = dynamic_protocol((800.0,), rest_s=0.5)


class _TakesTime(TestMachine):
    """Answers as the simulated one does, after a while; or fails."""

    def __init__(self, failure: Exception | None = None) -> None:
        super().__init__()
        self._inner, self._failure = open_machine("sim:instron"), failure

    def __str__(self) -> str:
        return "slow machine"

    @property
    def limits(self) -> MachineLimits:
        return self._inner.limits

    @property
    def logs(self) -> tuple[Recording, ...]:
        return self._inner.logs

    def describe(self) -> tuple[ChannelDescription, ...]:
        return self._inner.describe()

    def _run_internal(self, protocol: Protocol) -> Recording:
        time.sleep(0.1)
        if self._failure is not None:
            raise self._failure
        with self._inner:
            return self._inner.run(protocol)


def _waited(side: RunMachine) -> Recording:
    until_s = time.monotonic() + 5.0
    while time.monotonic() < until_s:
        found = side.log()
        if found is not None:
            return found
        time.sleep(0.01)
    raise AssertionError("the machine did not end")


def test_a_machine_that_takes_time_does_not_hold_up_the_stream() -> None:
    side = RunMachine(_TakesTime().open())
    side.start(QUICK)
    assert side.log() is None
    # A program that ends does not wait for a machine that hangs.
    assert [one.daemon for one in threading.enumerate() if "slow machine runs" in one.name] == [True]
    log = _waited(side)
    assert log.of_role("load")
    assert not log.sensors  # its own log, not the joined recording
    side.close()
    assert not side.machine.is_open


def test_a_machine_that_fails_says_so_in_the_sessions_own_thread() -> None:
    side = RunMachine(_TakesTime(LimitError("the frame's limit switch was reached: raise the crosshead")).open())
    side.start(QUICK)
    with pytest.raises(LimitError, match="limit switch"):
        _waited(side)
    side = RunMachine(_TakesTime(RuntimeError("driver")).open())
    side.start(QUICK)
    with pytest.raises(DeviceError, match=r"slow machine failed \(RuntimeError"):
        _waited(side)
