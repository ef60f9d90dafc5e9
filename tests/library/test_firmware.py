"""Firmware of a design and of a job's best, written in all four ways."""

from __future__ import annotations

from pathlib import Path

import pytest

import gaitswarm
from tests.examples.walks import short_walk
from tests.library.conftest import Finished, Reach

pytestmark = pytest.mark.slow

PI = {"P": 0.25, "I": 0.0}
BRIEF = short_walk(cycle_time=0.5, stride=0.04)


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_a_folder_is_the_same_wherever_it_is_made(reach: Reach, db: Path, tmp_path: Path) -> None:
    jobs = reach(db)
    view = jobs.write_firmware(PI, tmp_path / "there", controller="pi", scenarios=BRIEF, label="x")
    here = gaitswarm.write_firmware(
        PI, tmp_path / "here", controller="pi", scenarios=BRIEF, label="x"
    )
    assert contents(tmp_path / "there") == contents(tmp_path / "here")
    assert view == here.model_copy(update={"folder": str(tmp_path / "there")})


def test_a_jobs_best_has_the_jobs_controller_and_scenarios(
    reach: Reach, finished: Finished, tmp_path: Path
) -> None:
    jobs = reach(finished.db)
    view = jobs.write_firmware(finished.id, tmp_path / "best")
    best = finished.result.best
    assert (view.label, view.controller, view.design) == ("small", "pi", best.design)
    assert [walk.scenario for walk in view.walks] == ["normal-fast", "turn-right-fast"]
    gaitswarm.write_firmware(
        best.design, tmp_path / "here", controller="pi", scenarios=["1", "6"], label="small"
    )
    assert contents(tmp_path / "best") == contents(tmp_path / "here")


def test_what_cannot_be_written_is_refused(
    reach: Reach, finished: Finished, tmp_path: Path
) -> None:
    jobs, folder = reach(finished.db), tmp_path / "firmware"
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.write_firmware(finished.id, folder, table_bits=(8, 6))
    assert (refused.value.field, str(refused.value)) == (
        "table_bits",
        "table_bits: pi has no table",
    )
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.write_firmware(finished.id, folder, controller="pid")
    assert refused.value.field == "controller"
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.write_firmware(PI, folder, controller="pi", scenarios="moonwalk")
    assert refused.value.field == "scenarios.0"
    with pytest.raises(gaitswarm.NotFound):
        jobs.write_firmware("nowhere", folder)
    assert not folder.exists()
    folder.mkdir()
    (folder / "mine.txt").touch()
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.write_firmware(finished.id, folder)
    assert refused.value.field == "output"
    assert contents(folder) == {"mine.txt": b""}
