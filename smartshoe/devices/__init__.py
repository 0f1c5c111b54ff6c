"""The hardware seam: abstract devices and their backends, opened by URL."""

from smartshoe.devices.base import Bladder, Block, ChannelDescription, Device, Sensor, Shoe, TestMachine
from smartshoe.devices.registry import open_machine, open_shoe

__all__ = [
    "Bladder",
    "Block",
    "ChannelDescription",
    "Device",
    "Sensor",
    "Shoe",
    "TestMachine",
    "open_machine",
    "open_shoe",
]
