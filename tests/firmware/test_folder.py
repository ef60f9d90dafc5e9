"""Firmware folders are written completely or not at all, and replace nothing."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from gaitswarm.firmware import write_firmware
from gaitswarm.services.optimizer.errors import InvalidRequest
from tests.examples.walks import short_walk

PI = {"P": 0.25, "I": 0.0}
BRIEF = short_walk(cycle_time=0.5, stride=0.04)


def write(folder: Path, **changes: float) -> None:
    write_firmware(PI | changes, folder, controller="pi", scenarios=BRIEF)


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_the_same_design_gives_the_same_bytes(tmp_path: Path) -> None:
    write(tmp_path / "a")
    write(tmp_path / "b")
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_an_empty_folder_is_written(tmp_path: Path) -> None:
    (tmp_path / "firmware").mkdir()
    write(tmp_path / "firmware")
    assert (tmp_path / "firmware" / "controller.c").is_file()


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "firmware"
    write(folder)
    before = contents(folder)
    for place in (folder, folder / "controller.c"):
        with pytest.raises(InvalidRequest, match="not empty") as refused:
            write(place, P=0.5)
        assert refused.value.field == "output"
    assert contents(folder) == before


@pytest.mark.parametrize("fails", [Path.write_bytes, Path.replace], ids=["a file", "the folder"])
def test_a_failed_write_leaves_nothing(
    fails: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(path: Path, *_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, getattr(fails, "__name__", ""), failing)
    with pytest.raises(InvalidRequest, match="No space left"):
        write(tmp_path / "firmware")
    assert list(tmp_path.iterdir()) == []


def test_a_gait_out_of_reach_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="misses its foot trajectory"):
        write(tmp_path / "firmware", stride=0.6)
    assert not (tmp_path / "firmware").exists()
