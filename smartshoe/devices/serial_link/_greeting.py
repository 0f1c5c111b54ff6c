"""The first words with a shoe: which format it speaks, what it says of itself, its first samples."""

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

# A device that is silent until it is told to start gets this long to begin by itself.
LISTEN_S = 0.3
ASK_AGAIN_S = 1.0
# A device that takes no commands tells of itself once a second (docs/wire.md); one telling may be lost.
INFORMATION_WAIT_S = 2.2
# Text lines do not say their rate: times rounded to a millisecond give it within 0.1 % over this long.
RATED_S = 1.0
# They may come in bursts: as long is waited for that second, in the device's time.
RATING_WAIT_S = 3.0
SNIFFED_BYTES = 4096

Decoder = FrameDecoder | LineDecoder


@dataclass(eq=False)
class Greeting:
    """How the shoe talks: its decoder, its information where it has any, the samples so far and when they came."""

    decoder: Decoder
    first: list[tuple[Samples, Array]] = field(default_factory=list)
    arrivals: Arrivals = field(default_factory=Arrivals)

    @property
    def takes_commands(self) -> bool:
        """Frames have commands, text lines have none."""
        return isinstance(self.decoder, FrameDecoder)

    def is_complete(self, now_s: float) -> bool:
        """Whether samples came, and what they do not say: frames' information, lines' rate; each is waited for."""
        if not self.first:
            return False
        waited_s = now_s - float(self.first[0][1][0])
        if self.takes_commands:
            return self.information is not None or waited_s > INFORMATION_WAIT_S
        first, last = self.first[0][0], self.first[-1][0]
        return waited_s > RATING_WAIT_S or float(last.device_time_s[-1] - first.device_time_s[0]) >= RATED_S

    def has_other_channels(self, samples: Samples) -> bool:
        """Whether the device has another number of channels than its decoder was made for."""
        return self.information is not None and len(self.information.channels) != len(samples.names)

    @property
    def information(self) -> Information | None:
        """What the device said of itself."""
        return self.decoder.information


def decoder_for(format_: str, settings: SerialSettings, information: Information | None = None) -> Decoder:
    """A fresh decoder of "frames" (of the channels that ``information`` names) or "lines"."""
    if format_ == "frames":
        decoder = FrameDecoder() if information is None else FrameDecoder(information.names)
        decoder.information = information
        return decoder
    return LineDecoder(settings.columns, settings.time, settings.unit)


def hello(settings: SerialSettings) -> bytes:
    """The commands that wake a shoe: tell of yourself, take this rate, start."""
    rate = (Command("rate", settings.rate),) if settings.rate else ()
    return b"".join(encode_command(c) for c in (Command("information"), *rate, Command("start")))


def farewell() -> bytes:
    """The command that lets it rest."""
    return encode_command(Command("stop"))


def greet(name: str, port: Port, settings: SerialSettings, clock: Callable[[], float], until_s: float) -> Greeting:
    """Talk until samples come; raises `DeviceTimeoutError`, with what the bytes look like, at ``until_s`` of ``clock``.

    Frames are waited for together with the information frame; where samples come without it for `INFORMATION_WAIT_S`,
    they are taken as counts. Of text lines `RATED_S` are taken, for their rate, within `RATING_WAIT_S`. Once samples
    have come, ``until_s`` counts no more.
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
