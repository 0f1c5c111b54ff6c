"""Commands: from the host's encoder to the device's decoder, and nothing in between."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.devices.wire._commands import Command, CommandDecoder, encode_command
from smartshoe.errors import UsageError

COMMANDS = st.one_of(
    st.sampled_from([Command("start"), Command("stop"), Command("information")]),
    st.integers(1, 2**32 - 1).map(lambda millihertz: Command("rate", millihertz / 1000.0)),
)


@settings(max_examples=50)
@given(st.lists(COMMANDS, max_size=6), st.binary(max_size=40), st.lists(st.integers(0, 200), max_size=10))
def test_commands_arrive_in_any_chunks_behind_any_garbage(commands: list[Command], garbage: bytes, cuts) -> None:  # type: ignore[no-untyped-def]
    data = garbage + b"".join(encode_command(command) for command in commands)
    decoder, got = CommandDecoder(), []
    edges = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    for start, stop in pairwise(edges):
        got += decoder.feed(data[start:stop])
    assert got[len(got) - len(commands) :] == commands


RATES = [0.001, 0.256, 1.0, 16.384, 25.0, 50.0, 65.536, 100.0, 200.0, 250.0, 400.0, 500.0, 1000.0, 1024.0]


@pytest.mark.parametrize(
    "command",
    [Command("start"), Command("stop"), Command("information"), *(Command("rate", rate) for rate in RATES)],
    ids=str,
)
def test_no_flipped_bit_makes_another_command(command: Command) -> None:
    frame = encode_command(command)
    for bit in range(8 * len(frame)):
        harmed = bytearray(frame + b"\0")
        harmed[bit // 8] ^= 1 << (bit % 8)
        assert all(got == command for got in CommandDecoder().feed(bytes(harmed)))


def test_commands_that_cannot_be_are_refused() -> None:
    for kind, rate in (("rate", None), ("start", 5.0), ("rate", 0.0), ("rate", 5e6), ("rate", float("nan"))):
        with pytest.raises(UsageError):
            Command(kind, rate)  # type: ignore[arg-type]
