"""Designs as published names, files, standard input, or ids of jobs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from gaitswarm.cli.inputs import GivenDesign, given_design
from gaitswarm.cli.options import Place
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.robot import DEFAULT_ROBOT
from tests.calibration.conftest import spec as calibration
from tests.cli.conftest import Finished, WriteJson
from tests.examples.walks import PUBLISHED_A
from tests.setup import command_line


def given(text: str, db: Path | None = None, controller: str | None = None) -> GivenDesign:
    return given_design(text, controller, place=Place(None, None if db is None else str(db)))


def test_published_designs_are_named_with_their_controller() -> None:
    optimum = given("published:A")
    assert (optimum.label, optimum.controller) == ("published A", "fuzzy-pi")
    assert (optimum.values, optimum.spec) == (PUBLISHED_A, None)
    chapter_3 = given("published:pi-pso-ps", controller="pi")
    assert (chapter_3.controller, chapter_3.values["P"]) == ("pi", 0.454)


def test_a_file_is_read(write_json: WriteJson) -> None:
    path = write_json({"design": {"P": 0.4, "I": 0.1}}, "stiff.json")
    found = given(str(path), controller="pi")
    assert (found.label, found.values) == ("stiff", {"P": 0.4, "I": 0.1})


@pytest.mark.slow
def test_a_job_gives_its_best_with_the_spec_that_found_it(finished: Finished) -> None:
    found = given(finished.id, finished.db)
    assert found == given(f"job:{finished.id}", finished.db)
    assert found.spec is not None
    assert (found.label, found.controller) == ("small", "fuzzy-pi")
    assert found.values == finished.job["best"]["design"]
    assert [scenario.name for scenario in found.spec.resolved_scenarios()] == ["short"]


@pytest.mark.slow
def test_a_file_takes_precedence_over_a_job_without_prefix(
    finished: Finished, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(finished.id).write_text(json.dumps(PUBLISHED_A), encoding="utf-8")
    assert given(finished.id, finished.db).spec is None
    assert given(f"job:{finished.id}", finished.db).spec is not None


@pytest.mark.slow
def test_another_controller_than_the_jobs_is_refused(finished: Finished) -> None:
    with pytest.raises(InvalidRequest, match="tunes fuzzy-pi") as refused:
        given(finished.id, finished.db, controller="pi")
    assert refused.value.field == "controller"


def test_an_unknown_design_lists_the_choices(database: Path) -> None:
    with pytest.raises(NotFound, match="the id of a job, a file, or published:NAME"):
        given("nowhere", database)
    with pytest.raises(InvalidRequest, match="known are A, B, C"):
        given("published:D")


def test_a_job_that_tunes_no_drive_has_no_design(store: Store, database: Path) -> None:
    job, _ = store.create_job(calibration())
    with pytest.raises(InvalidRequest, match="kind calibration, which tunes no drive"):
        given(job.id, database)


def test_a_jobs_best_walks_on_the_jobs_robot_unless_another_is_named() -> None:
    spec = JobSpec(controller="pi", robot="szabadka2")
    best = GivenDesign("a job", "pi", {"P": 0.2, "I": 0.1}, spec)
    assert best.robot(None) == "szabadka2"
    assert best.robot("szabadka2-identified") == "szabadka2-identified"
    assert replace(best, spec=None).robot(None) == DEFAULT_ROBOT


def test_every_command_that_takes_a_design_has_options_of_its_job() -> None:
    options = command_line.commands()
    taking = command_line.taking(r"job:ID|DESIGN")
    assert len(taking) >= 8
    assert [name for name in taking if "--db" not in options[name]] == []
    # A certificate is computed where its job is stored.
    assert {name for name in taking if "--server" not in options[name]} == {"certify"}
