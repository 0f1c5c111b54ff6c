"""One contract for every backend: simulated, replayed, logged and serial (a pseudo-terminal, or a real shoe)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from smartshoe.devices import Block, Shoe, TestMachine, open_machine, open_shoe
from smartshoe.devices.checks import DeviceContractError, check_machine, check_shoe
from smartshoe.devices.replay import ReplayedShoe
from smartshoe.errors import DeviceError, LimitError, UsageError
from smartshoe.files.logs import write
from smartshoe.files.logs.formats.bluehill import write_bluehill
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Recording

PROTOCOL = dynamic_protocol((400.0, 800.0), rest_s=2.0)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A Bluehill log and a data logger's TDMS of one simulated run."""
    folder = tmp_path_factory.mktemp("logs")
    with open_machine("sim:instron", seed=1) as machine:
        machine.run(PROTOCOL)
        bluehill, logger = machine.logs
    write_bluehill(bluehill, folder / "Specimen_RawData_1.csv")
    write(logger, folder / "left_toe.tdms")
    return folder / "Specimen_RawData_1.csv", folder / "left_toe.tdms"


@pytest.fixture(params=["simulated stand", "simulated walk", "replayed"])
def shoe(request: pytest.FixtureRequest, tmp_path: Path) -> Shoe:
    if request.param == "simulated stand":
        return open_shoe("sim:stand", duration_s=5.0)
    if request.param == "simulated walk":
        return open_shoe("sim:walk?seed=4", duration_s=5.0)
    with open_shoe("sim:walk", duration_s=5.0) as walking:
        write(walking.record(), tmp_path / "walk.csv")
    return open_shoe(f"replay:{tmp_path / 'walk.csv'}")


@pytest.fixture(params=["frames", "lines"])
def serial_shoe(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Shoe]:
    """The real backend at an emulated shoe."""
    from simulators.wire.firmware import Firmware
    from simulators.wire.pty_line import PtyLine
    from simulators.wire.serving import Emulator

    with open_shoe("sim:walk", duration_s=5.0) as walking:
        recording = walking.record()
    emulator = Emulator(Firmware(ReplayedShoe(recording), request.param), PtyLine(tmp_path / "shoe0"))
    with emulator.serving() as url:
        yield open_shoe(f"{url}?side=left")


@pytest.fixture(params=["simulated", "logged"])
def machine(request: pytest.FixtureRequest, logs: tuple[Path, Path]) -> TestMachine:
    if request.param == "simulated":
        return open_machine("sim:instron?unit=left_heel", seed=2)
    return open_machine(f"log:{logs[0]}?daq={logs[1]}")


def test_every_shoe_keeps_the_contract(shoe: Shoe) -> None:
    check_shoe(shoe)


@pytest.mark.wire
def test_a_serial_shoe_keeps_the_contract(serial_shoe: Shoe) -> None:
    check_shoe(serial_shoe)


@pytest.mark.hardware
def test_a_real_shoe_keeps_the_contract(request: pytest.FixtureRequest) -> None:
    check_shoe(open_shoe(request.config.getoption("--shoe-url")))


def test_every_machine_keeps_the_contract(machine: TestMachine) -> None:
    check_machine(machine, PROTOCOL)


def test_a_replay_gives_back_what_was_recorded(tmp_path: Path) -> None:
    with open_shoe("sim:walk", duration_s=3.0) as walking:
        recording = walking.record()
    write(recording, tmp_path / "walk.csv")
    with open_shoe(f"replay:{tmp_path / 'walk.csv'}?block_samples=7") as replayed:
        again = replayed.record()
    np.testing.assert_array_equal(again.time_s, recording.time_s)
    for first, second in zip(recording.sensors, again.sensors, strict=True):
        np.testing.assert_array_equal(first.values, second.values)


@pytest.mark.parametrize(
    ("unit", "options", "name"),
    [("left_toe", "", "left_toe"), ("", "?unit=heel", "heel"), ("T7", "", "pressure"), ("", "", "pressure")],
)
def test_a_replayed_unit_under_test_goes_by_its_place(tmp_path: Path, unit: str, options: str, name: str) -> None:
    given = {"time_s": np.arange(40) / 100, "pressure_mbar": np.arange(40.0), "force_n": np.arange(40.0)}
    write(Recording.from_arrays(**given, unit=unit or None), tmp_path / "check.csv")
    with open_shoe(f"replay:{tmp_path / 'check.csv'}{options}") as shoe:
        assert [channel.name for channel in shoe.describe()] == [name]
        assert next(iter(shoe.blocks())).names == (name,)


def test_a_log_cannot_be_run_as_another_protocol(logs: tuple[Path, Path]) -> None:
    with open_machine(f"log:{logs[0]}?daq={logs[1]}") as machine, pytest.raises(DeviceError, match="log of this"):
        machine.run(dynamic_protocol((400.0,), peak_n=400.0))


def test_the_sensors_proof_pressure_is_guarded_before_anything_moves() -> None:
    # 800 N on 40 cm^2 are 2 bar, less the wall's share: beyond 1 bar, though the frame stands 2000 N.
    small_area = {"effective_area_m2": 0.004}
    with (
        open_machine("sim:instron?unit=left_toe", bladder=small_area) as machine,
        pytest.raises(LimitError, match=r"(?i)pressure|bar|Pa"),
    ):
        machine.run(PROTOCOL)


@pytest.mark.parametrize("url", ["sim:nothing", "nothing:here", "instron", "sim:instron?seed=x", "replay:x?speed=2"])
def test_wrong_urls_are_refused_with_what_there_is(url: str) -> None:
    with pytest.raises(UsageError):
        (open_shoe if url.startswith("replay") else open_machine)(url)


class _Backwards(ReplayedShoe):
    """A faulty backend: the checker has to notice."""

    def _blocks_internal(self) -> Iterator[Block]:
        yield from reversed(list(super()._blocks_internal()))


def test_the_checker_notices_time_that_goes_back() -> None:
    recording = Recording.from_arrays(time_s=np.arange(100) / 100, toe_mbar=np.zeros(100))
    check_shoe(ReplayedShoe(recording))
    with pytest.raises(DeviceContractError, match="time increases"):
        check_shoe(_Backwards(recording))
