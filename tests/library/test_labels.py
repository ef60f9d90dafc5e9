"""Labels of jobs: all four clients and the command."""

from __future__ import annotations

from typing import Any

import pytest

import gaitswarm
from tests.examples.commands import run_command
from tests.library.conftest import Finished, Reach

pytestmark = pytest.mark.slow


def test_a_job_is_named_noted_tagged_and_archived(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    before = jobs.job(finished.id)
    job = jobs.label(finished.id, name="renamed", note="why", tags=["a", "b"])
    assert (job.name, job.note, job.tags, job.archived) == ("renamed", "why", ["a", "b"], False)
    job = jobs.label(finished.id, archived=True)
    assert (job.name, job.tags, job.archived) == ("renamed", ["a", "b"], True)
    # Nothing of it determines results.
    assert (job.spec, job.head, job.best) == (before.spec, before.head, before.best)
    assert [found.id for found in jobs.jobs(archived=True, tag="b")] == [job.id]
    assert list(jobs.jobs(archived=False)) == []
    assert [found.id for found in jobs.jobs(controller="pi")] == [job.id]
    assert (job.robot, job.preference) == ("szabadka2-reconstructed", "A")


def test_labels_that_are_too_long_are_refused(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.label(finished.id, name="x" * 201)
    assert refused.value.field == "name"
    with pytest.raises(gaitswarm.NotFound):
        jobs.label("nowhere", note="x")


@pytest.mark.parametrize(
    ("label", "field"),
    [({"name": "a\x1b[2J"}, "name"), ({"tags": ["a\0"]}, "tags.0"), ({"note": "\x9b2J"}, "note")],
)
def test_labels_that_a_terminal_does_not_print_are_refused(
    reach: Reach, finished: Finished, label: dict[str, Any], field: str
) -> None:
    jobs = reach(finished.db)
    with pytest.raises(gaitswarm.InvalidRequest, match="printable") as refused:
        jobs.label(finished.id, **label)
    assert refused.value.field == field
    with pytest.raises(gaitswarm.InvalidRequest, match="printable"):
        jobs.submit({"name": "a\u202eb"})
    assert jobs.label(finished.id, note="Größe:\n\t1 µm\r\n").note == "Größe:\n\t1 µm\r\n"


def test_the_terminal_writes_and_finds_them(finished: Finished) -> None:
    written = run_command(
        *("label", finished.id, "--db", finished.db, "--name", "renamed", "--tag", "a", "--archive")
    )
    assert written.code == 0, written.err
    assert "'renamed', tag a, archived" in " ".join(written.out.split())
    listed = run_command("list", "--db", finished.db, "--tag", "a", "--archived", "--json").json
    assert [job["name"] for job in listed] == ["renamed"]
    assert run_command("list", "--db", finished.db, "--json").json == []
    assert (
        "no job matches; --all includes archived jobs"
        in run_command("list", "--db", finished.db).err
    )
    nothing = run_command("list", "--db", finished.db, "--all", "--search", "nowhere")
    assert (nothing.out, nothing.err) == ("", "no job matches\n")
    everything = run_command("list", "--db", finished.db, "--all")
    assert {"#a", "archived"} <= set(everything.out.split())
    emptied = run_command("label", finished.id, "--db", finished.db, "--no-tags", "--json").json
    assert emptied["tags"] == []


def test_a_list_says_that_there_is_more(reach: Reach, finished: Finished) -> None:
    spec = reach(finished.db).job(finished.id).spec
    with gaitswarm.open(finished.db) as jobs:
        for seed in (8, 9):
            jobs.submit(spec, seed=seed)
    result = run_command("list", "--db", finished.db, "--limit", "2")
    assert "more than 2 jobs match: raise --limit" in result.err
    assert "jobs match" not in run_command("list", "--db", finished.db, "--limit", "3").err


def test_jobs_are_compared(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    queued = jobs.submit(finished.result.job.spec, seed=8)
    view = jobs.comparison([finished.id, queued.id])
    assert [difference.field for difference in view.differences] == ["seed"]
    assert view.comparable
    assert view.jobs[0].best_fitness == finished.result.best.fitness
    result = run_command("diff", finished.id, queued.id, "--db", finished.db)
    assert result.code == 0, result.err
    assert any(line.split() == ["seed", "7", "8"] for line in result.out.splitlines())
    with pytest.raises(gaitswarm.InvalidRequest):
        jobs.comparison([finished.id, finished.id])
