"""Abstract devices (sensors, bladders, shoes, testing machines) and their backends, opened by URL."""

from smartshoe.devices._base import Bladder, Block, ChannelDescription, Device, Sensor, Shoe, TestMachine
from smartshoe.devices._events import Disconnected, Dropped, Gap, Reconnected, Restarted, ShoeEvent
from smartshoe.devices._registry import open_machine, open_shoe, schemes, split_url

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
    "schemes",
    "split_url",
    "Disconnected",
    "Dropped",
    "Gap",
    "Reconnected",
    "Restarted",
    "ShoeEvent",
]
