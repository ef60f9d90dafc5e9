"""Output files, and the files that they replace."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from gaitswarm.cli.output import replacing
from gaitswarm.services.optimizer.errors import InvalidRequest


def test_a_file_is_replaced_in_full_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "job.csv"
    path.write_bytes(b"before")
    with pytest.raises(TypeError), replacing(path, "output") as file:
        file.writelines([b"half", "no bytes"])  # type: ignore[list-item]
    assert path.read_bytes() == b"before"
    with replacing(path, "output") as file:
        file.write(b"after")
    assert path.read_bytes() == b"after"
    assert list(tmp_path.iterdir()) == [path]


def test_a_pipe_is_written_to_and_stays(tmp_path: Path) -> None:
    path = tmp_path / "walk.npz"
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    try:
        with replacing(path, "log") as file:
            file.write(b"walk")
        assert path.is_fifo()
        assert os.read(reader, 10) == b"walk"
    finally:
        os.close(reader)


def test_a_link_stays_and_its_file_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    file_of_link, link = tmp_path / "kept" / "real.csv", tmp_path / "link.csv"
    link.symlink_to(file_of_link)
    with replacing(link, "output") as file:
        file.write(b"table")
    assert link.is_symlink()
    assert file_of_link.read_bytes() == b"table"


@pytest.mark.parametrize("name", ["folder", "circle"])
def test_files_that_cannot_be_written_are_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "circle").symlink_to("circle")
    path = tmp_path / name
    with pytest.raises(InvalidRequest, match=f"cannot write {path}"), replacing(path, "log"):
        pass
