"""PI against Fuzzy-PI: jobs of the database, found again by name, spec and provenance."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.cli.studies.controllers import Budget, comparisons, study_document, study_table
from gaitswarm.jobs.database.embedded import earlier_job
from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.search.registry import OPTIMIZERS
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import open_store
from tests.cli.conftest import Gaitswarm

pytestmark = pytest.mark.slow

TINY = ("--particles", "2", "--iterations", "1", "--robots", "szabadka2")
HERE = ("--evaluator", "in-process")


def study(gaitswarm: Gaitswarm, db: Path, *options: str) -> tuple[Any, list[str]]:
    """The study's document, and names of the jobs that it ran."""
    done = gaitswarm("study", "controllers", *TINY, *options, "--db", db, *HERE, "--json")
    assert done.code == 0, done.err
    lines = [line for line in done.err.splitlines() if line.startswith("job ")]
    return done.json, [line.partition(": ")[2] for line in lines]


def stored(db: Path) -> list[Job]:
    with closing(open_store(str(db))) as store:
        return list(store.jobs(limit=100).items)


def test_both_are_optimized_alike_and_compared(gaitswarm: Gaitswarm, db: Path) -> None:
    document, ran = study(gaitswarm, db, "--seeds", "2")
    assert len(ran) == 8
    chapter_3, chapter_4 = document["comparisons"]
    assert (chapter_3["chapter"], chapter_3["quantity"]) == (3, "F")
    assert (chapter_4["chapter"], chapter_4["quantity"]) == (4, "f_G")
    jobs = {job.id: job for job in stored(db)}
    for comparison in (chapter_3, chapter_4):
        specs = [
            jobs[job_id].spec
            for runs in (comparison["pi"], comparison["fuzzy"])
            for job_id in runs["jobs"]
        ]
        assert [spec.seed for spec in specs] == [1, 2, 1, 2]
        assert len({(s.optimizer, s.iterations, s.case_names, s.robot) for s in specs}) == 1
        assert specs[0].optimizer == OPTIMIZERS["pso-thesis"].model_copy(
            update={"particles": specs[0].optimizer.particles}
        )
    searched = {
        (comparison["chapter"], runs["controller"]): len(
            jobs[runs["jobs"][0]].spec.design_space().variables
        )
        for comparison in (chapter_3, chapter_4)
        for runs in (comparison["pi"], comparison["fuzzy"])
    }
    assert searched == {(3, "pi"): 7, (3, "fuzzy-pi-3"): 17, (4, "pi"): 2, (4, "fuzzy-pi"): 9}


def test_the_gain_is_how_much_greater_f_is_or_how_much_less_the_fitness(
    gaitswarm: Gaitswarm, db: Path
) -> None:
    document, _ = study(gaitswarm, db, "--seeds", "1")
    chapter_3, chapter_4 = document["comparisons"]
    ((pi,), (fuzzy,)) = chapter_3["pi"]["values"], chapter_3["fuzzy"]["values"]
    assert chapter_3["ratio"]["median"] == pytest.approx(fuzzy / pi)
    ((pi,), (fuzzy,)) = chapter_4["pi"]["values"], chapter_4["fuzzy"]["values"]
    assert chapter_4["ratio"]["median"] == pytest.approx(pi / fuzzy)


def test_what_has_been_run_is_not_run_again(gaitswarm: Gaitswarm, db: Path) -> None:
    first, _ = study(gaitswarm, db, "--seeds", "1", "--chapters", "3")
    again, ran = study(gaitswarm, db, "--seeds", "1", "--chapters", "3")
    assert (again, ran) == (first, [])
    more, ran = study(gaitswarm, db, "--seeds", "2", "--chapters", "3")
    assert ran == [
        f"study of controllers: chapter 3, {controller}, szabadka2, seed 2"
        for controller in ("pi", "fuzzy-pi-3")
    ]
    (comparison,) = more["comparisons"]
    assert comparison["pi"]["values"][:1] == first["comparisons"][0]["pi"]["values"]
    _, ran = study(gaitswarm, db, "--seeds", "1", "--chapters", "3", "--optimizer", "pso")
    assert len(ran) == 2


def test_people_see_the_gain_beside_that_of_the_thesis(gaitswarm: Gaitswarm, db: Path) -> None:
    asked = ("study", "controllers", *TINY, "--seeds", "1", "--chapters", "3", "--db", db, *HERE)
    shown = gaitswarm(*asked)
    assert shown.code == 0, shown.err
    assert "3 (F)" in shown.out and "%" in shown.out
    assert "+22 % (table 3.6, PSO-PS) and +20 % on average" in shown.err


def test_without_a_design_that_walks_there_is_nothing_to_compare() -> None:
    budget = Budget(seeds=1, particles=2, iterations=1, optimizer="pso")
    planned = comparisons([4], {"szabadka2": "szabadka2"}, budget)
    (document,) = study_document(planned)["comparisons"]
    assert (document["pi"]["values"], document["pi"]["median"], document["ratio"]) == (
        [],
        None,
        None,
    )
    *_, median, interval = study_table(planned).columns
    assert [*median.cells, *interval.cells] == ["–"] * 6


@pytest.fixture
def service(db: Path) -> Iterator[JobService]:
    with closing(open_store(str(db))) as store:
        yield JobService(store)


def test_a_study_that_was_stopped_goes_on_where_it_was(
    gaitswarm: Gaitswarm, db: Path, service: JobService
) -> None:
    budget = Budget(seeds=1, particles=2, iterations=1, optimizer="pso-thesis")
    (planned,) = comparisons([3], {"szabadka2": "szabadka2"}, budget)
    stopped, _ = service.submit(planned.fuzzy.specs[0])
    service.command(stopped.id, Command.PAUSE)
    document, ran = study(gaitswarm, db, "--seeds", "1", "--chapters", "3")
    assert document["comparisons"][0]["fuzzy"]["jobs"] == [stopped.id]
    assert ran[1] == stopped.spec.name


def test_a_job_is_found_again_by_name_and_spec_unless_it_was_cancelled(
    gaitswarm: Gaitswarm, db: Path, service: JobService
) -> None:
    document, _ = study(gaitswarm, db, "--seeds", "1", "--chapters", "3")
    job = service.job(document["comparisons"][0]["pi"]["jobs"][0])
    assert earlier_job(service, job.spec) == job
    assert earlier_job(service, job.spec.model_copy(update={"name": "another"})) is None
    assert earlier_job(service, job.spec.model_copy(update={"iterations": 2})) is None
    unwanted, _ = service.submit(job.spec.model_copy(update={"name": "unwanted"}))
    service.command(unwanted.id, Command.CANCEL)
    assert earlier_job(service, unwanted.spec) is None


def test_a_job_of_other_code_is_not_taken_for_one_of_this(
    gaitswarm: Gaitswarm, db: Path, service: JobService
) -> None:
    document, _ = study(gaitswarm, db, "--seeds", "1", "--chapters", "3")
    job = service.job(document["comparisons"][0]["pi"]["jobs"][0])
    now = service.provenance(job.spec)
    other = now.model_copy(update={"optimizer_digest": "another"})
    changed = replace(service, provenance=lambda _: other)
    assert earlier_job(changed, job.spec) is None


@pytest.mark.parametrize(
    ("options", "field"),
    [
        (("--chapters", "5"), "chapters"),
        (("--chapters", ""), "chapters"),
        (("--robots", "spot"), "unknown robot 'spot'"),
        (("--optimizer", "annealer"), "unknown optimizer 'annealer'"),
        (("--iterations", "0"), "iterations"),
        (("--particles", "0"), "optimizer.particles"),
    ],
)
def test_a_study_that_makes_no_sense_is_refused_by_name(
    gaitswarm: Gaitswarm, db: Path, options: tuple[str, ...], field: str
) -> None:
    refused = gaitswarm("study", "controllers", *options, "--db", db)
    assert refused.code == 2
    assert field in refused.err
    assert not db.exists()
