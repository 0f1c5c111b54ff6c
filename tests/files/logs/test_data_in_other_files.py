"""A data file never makes the program open another one, nor ask for memory that its size does not warrant."""

from __future__ import annotations

import os
from pathlib import Path

import h5py
import numpy as np
import pytest

import smartshoe
from smartshoe.errors import FormatError, InputError

SECRET = b"what nobody else may read\n" * 8


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    path = tmp_path / "secret"
    path.write_bytes(SECRET)
    return path


def _with_time(path: Path) -> h5py.File:
    if path.suffix == ".mat":  # MATLAB's own files of level 7.3 have a header of 512 bytes
        with h5py.File(path, "w", userblock_size=512):
            pass
        with path.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    file = h5py.File(path, "a")
    file["time"] = np.arange(16) * 0.01
    file["time"].attrs["units"] = "s"
    return file


def _refused(path: Path) -> None:
    with pytest.raises(FormatError, match="another file") as refusal:
        smartshoe.read(path)
    assert str(path) in str(refusal.value)


@pytest.mark.parametrize("ending", ["h5", "mat"])
def test_external_storage_is_refused(ending: str, tmp_path: Path, secret: Path) -> None:
    path = tmp_path / f"raw.{ending}"
    with _with_time(path) as file:
        file.create_dataset("pressure", (16,), dtype="u1", external=[(str(secret), 0, 16)])
    _refused(path)


def test_external_storage_on_a_pipe_does_not_hang(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    path = tmp_path / "raw.h5"
    with _with_time(path) as file:
        file.create_dataset("pressure", (16,), dtype="u1", external=[(str(tmp_path / "pipe"), 0, 16)])
    _refused(path)


@pytest.mark.parametrize("ending", ["h5", "mat"])
def test_an_external_link_is_refused(ending: str, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = np.arange(16.0)
    path = tmp_path / f"raw.{ending}"
    with _with_time(path) as file:
        file["pressure"] = h5py.ExternalLink("other.h5", "/x")
    _refused(path)


@pytest.mark.parametrize("ending", ["h5", "mat"])
def test_a_virtual_dataset_is_refused(ending: str, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = np.arange(16.0)
    path = tmp_path / f"raw.{ending}"
    with _with_time(path) as file:
        layout = h5py.VirtualLayout((16,), dtype="f8")
        layout[:] = h5py.VirtualSource("other.h5", "x", (16,))
        file.create_virtual_dataset("pressure", layout)
    _refused(path)


def test_the_same_in_a_group_of_a_mat_file_is_refused(tmp_path: Path, secret: Path) -> None:
    path = tmp_path / "raw.mat"
    with _with_time(path) as file:
        file.create_dataset("deep/er/pressure", (16,), dtype="u1", external=[(str(secret), 0, 16)])
    _refused(path)


def test_a_mat_file_of_level_7_3_is_read(tmp_path: Path) -> None:
    path = tmp_path / "raw.mat"
    with _with_time(path) as file:
        file["pressure"] = np.arange(16.0)
    assert smartshoe.read(path, time="time[s]")["pressure"].values.tolist() == list(range(16))


def test_a_soft_link_within_the_file_does_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "raw.h5"
    with _with_time(path) as file:
        file["pressure"] = np.arange(16.0)
        file["again"] = h5py.SoftLink("/pressure")
        file["nowhere"] = h5py.SoftLink("/missing")
        file["loop"] = h5py.SoftLink("/loop")
    assert list(smartshoe.read(path).channels) == ["pressure"]


@pytest.mark.parametrize("shape", [{"shape": (1_500_000_000,)}, {"shape": (10,), "chunks": (200_000_000,)}])
def test_a_small_file_that_declares_much_is_refused(shape: dict[str, tuple[int]], tmp_path: Path) -> None:
    path = tmp_path / "raw.h5"
    with _with_time(path) as file:
        file.create_dataset("pressure", maxshape=(None,), dtype="f8", compression="gzip", **shape)
    assert path.stat().st_size < 100_000
    with pytest.raises(InputError, match="declares"):
        smartshoe.read(path)
