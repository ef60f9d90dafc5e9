"""Failures of designs by scenario and status."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gaitswarm
from gaitswarm.services.optimizer.analysis.failures import failures
from gaitswarm.sim.outcome import Status
from tests.examples.columns import columns_of
from tests.examples.commands import run_command
from tests.examples.walks import SHORT_WALK
from tests.library.conftest import Reach


def test_designs_are_counted_by_case_and_status_with_the_latest_of_each() -> None:
    columns = columns_of(np.ones((8, 2, 5)), particles=4)
    columns.statuses[:] = [
        [Status.OK, Status.OK],
        [Status.FELL, Status.FELL],
        [Status.OK, Status.FELL],
        [Status.OK, Status.DIVERGED],
        [Status.OK, Status.FELL],
        [Status.FELL, Status.OK],
        [Status.OK, Status.OK],
        [Status.OK, Status.OK],
    ]
    view = failures(columns, ["level", "slope"])
    assert (view.designs, view.failed, view.recent) == (8, 5, 0.0)
    assert [(case.case, case.failed, case.alone) for case in view.cases] == [
        ("slope", 4, 3),
        ("level", 2, 1),
    ]
    fell, diverged = view.cases[0].statuses
    assert (fell.status, fell.designs, fell.iteration, fell.particle) == ("fell", 3, 1, 0)
    assert (diverged.status, diverged.designs) == ("diverged", 1)
    assert fell.reason == Status.FELL.phrase


def test_a_job_without_designs_has_no_share() -> None:
    view = failures(columns_of(np.ones((0, 1, 5))), ["level"])
    assert (view.designs, view.recent, view.cases) == (0, None, [])


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    db = tmp_path_factory.mktemp("failures") / "jobs.db"
    steep = SHORT_WALK | {"name": "steep", "slope": 44.0}
    gaitswarm.optimize(
        controller="pi", scenarios=[SHORT_WALK, steep], particles=2, iterations=2, db=db
    )
    return db


@pytest.mark.slow
def test_they_are_the_same_from_everywhere(reach: Reach, database: Path) -> None:
    jobs = reach(database)
    (job,) = jobs.jobs()
    view = jobs.failures(job.id)
    assert (view.designs, view.failed, view.recent) == (4, 4, 1.0)
    assert [(case.case, case.failed, case.alone) for case in view.cases] == [("steep", 4, 4)]
    with pytest.raises(gaitswarm.NotFound):
        jobs.failures("nowhere")


@pytest.mark.slow
def test_the_command_explains_every_status(database: Path) -> None:
    with gaitswarm.open(database) as jobs:
        (job,) = jobs.jobs()
        (case,) = jobs.failures(job.id).cases
    result = run_command("failures", job.id, "--db", database)
    assert result.code == 0, result.err
    words = " ".join(result.out.split())
    assert case.statuses[0].reason in words
    assert "4 of 4 designs failed in at least one scenario; 100 % of the latest quarter" in words
