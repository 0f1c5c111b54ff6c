"""The first exchange with a shoe: which format it speaks, its information, its first samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from smartshoe.arrays import Array
from smartshoe.devices.serial_link._arrivals import Arrivals
from smartshoe.devices.serial_link._port import Port
from smartshoe.devices.serial_link._settings import SerialSettings
from smartshoe.devices.wire.frames import Command, FrameDecoder, encode_command
from smartshoe.devices.wire.information import Information
from smartshoe.devices.wire.lines import LineDecoder
from smartshoe.devices.wire.samples import Samples
from smartshoe.devices.wire.sniff import guess, looks_like
from smartshoe.errors import DeviceTimeoutError

# How long a device may take to send by itself before it is sent a start command.
LISTEN_S = 0.3
ASK_AGAIN_S = 1.0
# A device that takes no commands sends its information once a second (docs/wire.md); one frame may be lost.
INFORMATION_WAIT_S = 2.2
# Text lines do not state their rate: times rounded to a millisecond give it within 0.1 % over this long.
RATED_S = 1.0
# Lines may arrive in bursts, so waiting for that second of device time may take this long.
RATING_WAIT_S = 3.0
SNIFFED_BYTES = 4096

Decoder = FrameDecoder | LineDecoder


@dataclass(eq=False)
class Greeting:
    """How the shoe communicates: its decoder, its information if any, the samples so far and their arrival times."""

    decoder: Decoder
    first: list[tuple[Samples, Array]] = field(default_factory=list)
    arrivals: Arrivals = field(default_factory=Arrivals)

    @property
    def takes_commands(self) -> bool:
        """Whether the device accepts commands: frames have them, text lines do not."""
        return isinstance(self.decoder, FrameDecoder)

    def is_complete(self, now_s: float) -> bool:
        """Whether samples arrived and what they lack (information for frames, a rate for lines) came or is overdue."""
        if not self.first:
            return False
        waited_s = now_s - float(self.first[0][1][0])
        if self.takes_commands:
            return self.information is not None or waited_s > INFORMATION_WAIT_S
        first, last = self.first[0][0], self.first[-1][0]
        return waited_s > RATING_WAIT_S or float(last.device_time_s[-1] - first.device_time_s[0]) >= RATED_S

    def has_other_channels(self, samples: Samples) -> bool:
        """Whether the number of channels in ``samples`` differs from the one the decoder was made for."""
        return self.information is not None and len(self.information.channels) != len(samples.names)

    @property
    def information(self) -> Information | None:
        """The information that the device sent about itself, or None."""
        return self.decoder.information


def decoder_for(format_: str, settings: SerialSettings, information: Information | None = None) -> Decoder:
    """A new decoder of "frames" (with the channels that ``information`` names) or "lines"."""
    if format_ == "frames":
        decoder = FrameDecoder() if information is None else FrameDecoder(information.names)
        decoder.information = information
        return decoder
    return LineDecoder(settings.columns, settings.time, settings.unit)


def hello(settings: SerialSettings) -> bytes:
    """The commands that wake a shoe: send information, set the rate, start."""
    rate = (Command("rate", settings.rate),) if settings.rate else ()
    return b"".join(encode_command(c) for c in (Command("information"), *rate, Command("start")))


def farewell() -> bytes:
    """The command that stops a shoe."""
    return encode_command(Command("stop"))


def greet(name: str, port: Port, settings: SerialSettings, clock: Callable[[], float], until_s: float) -> Greeting:
    """Exchange until samples arrive; raises `DeviceTimeoutError`, describing the bytes, at ``until_s`` of ``clock``.

    Frames are awaited together with the information frame; where it is missing for `INFORMATION_WAIT_S`, readings stay
    counts. Of text lines `RATED_S` are collected to measure their rate, for `RATING_WAIT_S` at most. Once samples have
    arrived, ``until_s`` no longer applies.
    """
    begin_s = clock()
    asked_s = begin_s - ASK_AGAIN_S if settings.format == "frames" else begin_s + LISTEN_S - ASK_AGAIN_S
    seen = b""
    greeting: Greeting | None = None
    while (now_s := clock()) < until_s or (greeting is not None and greeting.first):
        speaks_lines = greeting is not None and not greeting.takes_commands
        if settings.format != "lines" and not speaks_lines and now_s >= asked_s + ASK_AGAIN_S:
            port.write(hello(settings))
            asked_s = now_s
        data = port.read()
        arrival_s = clock()
        seen = (seen + data)[-SNIFFED_BYTES:]
        if greeting is None:
            format_ = settings.format if settings.format != "auto" else guess(seen)
            if format_ is None:
                continue
            greeting, data = Greeting(decoder_for(format_, settings)), seen
        greeting.arrivals.note(len(data), arrival_s)
        samples = greeting.decoder.feed(data)
        if greeting.has_other_channels(samples):
            greeting = Greeting(decoder_for("frames", settings, greeting.information))
            continue
        if len(samples):
            greeting.first.append((samples, greeting.arrivals.of(samples.end)))
        if greeting.is_complete(arrival_s):
            return greeting
    raise DeviceTimeoutError(
        f"{name} sent no valid {_what(settings, greeting)} in {settings.wait_s:g} s: {_why(settings, seen)}"
    )


def _what(settings: SerialSettings, greeting: Greeting | None) -> str:
    if greeting is not None:
        return "frame" if greeting.takes_commands else "line"
    return {"auto": "frame or line", "frames": "frame", "lines": "line"}[settings.format]


def _why(settings: SerialSettings, seen: bytes) -> str:
    if not seen:
        return (
            "no byte came; switch the shoe on, see that this is its port and that its sketch sends, or give a longer"
            " wait_s in the address"
        )
    return f"what came is {looks_like(seen, len(settings.columns))}; check baud, format and columns in the address"
