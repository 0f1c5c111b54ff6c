"""Checks that every backend must pass; third parties run them on their own (`check_shoe`, `check_machine`)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from smartshoe.devices._base import Device, Shoe, TestMachine
from smartshoe.errors import DeviceError, LimitError
from smartshoe.protocol import Protocol, Segment


class DeviceContractError(DeviceError):
    """A backend violates the contract of `smartshoe.devices._base`."""


def _require(holds: bool, device: Device, promise: str) -> None:
    if not holds:
        raise DeviceContractError(f"{device} breaks its contract: {promise}")


def _refuses(device: Device, kind: type[Exception], call: Callable[[], object], promise: str) -> None:
    try:
        call()
    except kind:
        return
    raise DeviceContractError(f"{device} breaks its contract: {promise}")


def check_lifecycle(device: Device) -> None:
    """Check that a device opens once, closes any number of times, and describes itself at any time."""
    _require(not device.is_open, device, "a new device is closed")
    device.close()
    with device:
        _require(device.is_open, device, "a with block opens the device")
        _refuses(device, DeviceError, device.open, "opening twice raises DeviceError")
        described = device.describe()
        _require(len(described) > 0, device, "describe() names at least one channel")
        for channel in described:
            _require(bool(channel.name) and bool(channel.quantity), device, "each channel has a name and a quantity")
            _require(channel.unit.quantity == channel.quantity, device, f"{channel.name}'s unit is one of its quantity")
            if channel.range_ is not None:
                _require(channel.range_[0] <= channel.range_[1], device, f"{channel.name}'s range is in order")
    _require(not device.is_open, device, "leaving the with block closes the device")
    device.close()


def check_shoe(shoe: Shoe, blocks: int = 20) -> None:
    """Check the lifecycle, then the first ``blocks`` blocks: shapes, names, finite readings, increasing time."""
    check_lifecycle(shoe)
    _refuses(shoe, DeviceError, lambda: next(shoe.blocks()), "reading a closed shoe raises DeviceError")
    with shoe:
        names = tuple(channel.name for channel in shoe.describe())
        _require(shoe.sample_rate_hz > 0, shoe, "the sample rate is positive")
        last = -np.inf
        for count, block in enumerate(shoe.blocks(), start=1):
            shape = (block.time_s.size, len(block.names))
            _require(block.names == names, shoe, "blocks carry the described channels in order")
            _require(block.readings.shape == shape == block.missing.shape, shoe, "readings and mask are (n, units)")
            _require(bool(np.isfinite(block.readings).all()), shoe, "readings are finite; missing ones are masked")
            if len(block):
                _require(bool(block.time_s[0] > last), shoe, "time increases from block to block")
                _require(bool((np.diff(block.time_s) > 0).all()), shoe, "time increases within a block")
                last = float(block.time_s[-1])
            if count >= blocks:
                break
        _require(np.isfinite(last), shoe, "at least one sample comes")


def check_machine(machine: TestMachine, protocol: Protocol) -> None:
    """Check the lifecycle, the refusal of a load beyond the limits, and the recording of ``protocol``."""
    check_lifecycle(machine)
    _refuses(machine, DeviceError, lambda: machine.run(protocol), "running a closed machine raises DeviceError")
    with machine:
        if machine.limits.load_n is not None:
            beyond = Protocol("beyond", (Segment("ramp", 1.01 * machine.limits.load_n, 100.0),))
            _refuses(machine, LimitError, lambda: machine.run(beyond), "a load beyond the limits raises LimitError")
        recording = machine.run(protocol)
        _require(len(recording) > 1, machine, "a run gives samples")
        _require(len(recording.of_role("load")) == 1, machine, "a run has one reference load")
        _require(len(recording.sensors) == 1, machine, "a run has one sensor's reading")
        peak = float(recording.force_n.max())
        _require(
            abs(peak - protocol.peak_load_n) <= 0.05 * protocol.peak_load_n,
            machine,
            f"the load reaches the protocol's peak ({protocol.peak_load_n:g} N; it reached {peak:g} N)",
        )
