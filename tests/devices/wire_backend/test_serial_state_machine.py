"""Whatever happens in whatever order, the serial shoe neither hangs nor loses a frame that came whole."""

from __future__ import annotations

import tempfile
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule
from puppet import RATE_HZ, STEP_S, Puppet, wait_until, within

from smartshoe.devices.serial_link._settings import SerialSettings
from smartshoe.devices.serial_link.shoe import SerialShoe
from smartshoe.errors import DeviceError

# A port that is closed because it was silent may take along what comes in that moment: not here, in a test of its own.
QUICK = SerialSettings(format="frames", wait_s=STEP_S / 2, silence_s=0.05, reopen_s=600.0, give_up_s=600.0)


class SerialMachine(RuleBasedStateMachine):
    """Open, send, lose, spoil, drop, return, read, close, in any order; each step within a bound."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.puppet = Puppet(Path(self.folder.name) / "shoe0")
        self.puppet.__enter__()
        self.shoe = SerialShoe(str(self.puppet.line.link), QUICK)
        self.got: list[int] = []

    def teardown(self) -> None:
        within(STEP_S, self.shoe.close)
        self.puppet.__exit__()
        self.folder.cleanup()

    @precondition(lambda self: not self.shoe.is_open and self.puppet.line.is_up)
    @rule()
    def open(self) -> None:
        self.puppet.settle()
        self.puppet.intact.clear()
        self.puppet.written = 0
        self.got.clear()
        within(STEP_S, self.shoe.open)
        with pytest.raises(DeviceError, match="open already"):
            self.shoe.open()

    @precondition(lambda self: not self.shoe.is_open and not self.puppet.line.is_up)
    @rule()
    def open_without_a_port(self) -> None:
        with pytest.raises(DeviceError, match="is not there"):
            within(STEP_S, self.shoe.open)

    @rule(count=st.integers(1, 300), chunk=st.integers(1, 400))
    def send(self, count: int, chunk: int) -> None:
        self.puppet.send(count, chunk)

    @rule(count=st.integers(1, 20), keep=st.integers(0, 18))
    def lose(self, count: int, keep: int) -> None:
        self.puppet.lose(count, keep)

    @rule(data=st.binary(min_size=1, max_size=60))
    def garbage(self, data: bytes) -> None:
        self.puppet.send_raw(data)

    @precondition(lambda self: self.puppet.line.is_up)
    @rule()
    def drop(self) -> None:
        self.puppet.drop(self.shoe)

    @precondition(lambda self: not self.puppet.line.is_up)
    @rule()
    def come_back(self) -> None:
        self.puppet.come_back()

    @precondition(lambda self: self.shoe.is_open and self.puppet.line.is_up)
    @rule()
    def read(self) -> None:
        """With the connection up, everything that went out whole comes, in order, once."""
        wait_until(lambda: self.puppet.is_started)
        # Whatever stands unsure at the end of the stream (a longer gap) is sure two frames later.
        self.puppet.send(2)
        sent = list(self.puppet.intact)

        def take() -> None:
            for block in self.shoe.blocks():
                self.got += np.rint(block.time_s * RATE_HZ).astype(int).tolist()
                if self.got and self.got[-1] >= sent[-1]:
                    return

        within(STEP_S, take)
        assert self.got[: len(sent)] == sent

    @precondition(lambda self: self.shoe.is_open)
    @rule(is_read_meanwhile=st.booleans())
    def close(self, is_read_meanwhile: bool) -> None:
        """Reading ends, here or in another thread."""

        def drain() -> None:
            for _ in self.shoe.blocks():
                pass

        reading = threading.Thread(target=drain if is_read_meanwhile else lambda: None, daemon=True)
        reading.start()
        within(STEP_S, self.shoe.close)
        reading.join(STEP_S)
        assert not reading.is_alive()
        with pytest.raises(DeviceError, match="not open"):
            next(self.shoe.blocks())


TestSerialMachine = pytest.mark.wire(SerialMachine.TestCase)
# Not shrunk: where a step hangs, each attempt would take its whole bound.
TestSerialMachine.settings = settings(
    max_examples=30, stateful_step_count=40, deadline=None, phases=[Phase.explicit, Phase.generate]
)
