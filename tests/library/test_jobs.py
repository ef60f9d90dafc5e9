"""Jobs answer alike in a database and behind a server, to programs that block and to those that
do not.
"""

from __future__ import annotations

import io
import os
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyarrow.parquet as pq
import pytest

import gaitswarm
from gaitswarm.services.runtime import open_store
from gaitswarm.sim.robot import load_robot
from tests.examples.walks import SHORT_WALK
from tests.library.conftest import SMALL, Finished, Reach

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}
PUBLISHED = gaitswarm.CONTROLLERS["fuzzy-pi"].published["A"]


def test_a_job_is_submitted_by_keywords_and_then_found(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    job = jobs.submit(**SMALL)
    assert (job.state, job.name, job.controller) == ("queued", "small", "pi")
    assert job.scenarios == ["short", "uphill"]
    assert (job.particles, job.iterations_planned, job.spec.seed) == (3, 2, 7)
    assert jobs.job(job.id) == job
    assert [found.id for found in jobs.jobs()] == [job.id]


def test_a_spec_is_an_object_or_a_document_and_keywords_are_laid_over_it(
    reach: Reach, db: Path
) -> None:
    jobs = reach(db)
    spec = gaitswarm.JobSpec(controller="pi", iterations=5, seed=3)
    by_object = jobs.submit(spec)
    by_document = jobs.submit({"controller": "pi", "iterations": 5, "seed": 3})
    assert by_object.spec == by_document.spec
    changed = jobs.submit(spec, seed=4, particles=6)
    assert (changed.spec.iterations, changed.spec.seed, changed.particles) == (5, 4, 6)


def test_the_same_key_makes_one_job_and_another_spec_is_a_conflict(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    first = jobs.submit(idempotency_key="k", **SMALL)
    assert jobs.submit(idempotency_key="k", **SMALL).id == first.id
    with pytest.raises(gaitswarm.IdempotencyConflict):
        jobs.submit(idempotency_key="k", **{**SMALL, "seed": 8})
    assert jobs.submit(**SMALL).id != first.id


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "unknown scenario": ({"scenarios": ["moon"]}, "scenarios.0"),
    "inverted bounds": ({"variables": [{"name": "P", "low": 1.0, "high": 0.1}]}, "variables.0"),
    "unknown field": ({"budget": 5}, "budget"),
    "no particles": ({"particles": 0}, "optimizer.particles"),
    "empty preset": (
        {"optimizer": "pso-falling-inertia", "particles": 0},
        "optimizer.particles",
    ),
    "unknown robot": ({"robot": "spot"}, "robot"),
    "gait out of reach": (
        {"scenarios": {"name": "giant", "cycle_time": 1.5, "radius": 0.9, "hip_height": 0.15}},
        "scenarios.0",
    ),
}


def test_a_job_that_makes_no_sense_is_refused_by_field_and_not_stored(
    reach: Reach, db: Path
) -> None:
    jobs = reach(db)
    for name, (change, field) in MISTAKES.items():
        for ask in (jobs.submit, jobs.estimate):
            with pytest.raises(gaitswarm.InvalidRequest) as raised:
                ask(**{**SMALL, **change})
            assert (name, raised.value.field) == (name, field)
            assert str(raised.value).startswith(f"{field}: ")
    assert list(jobs.jobs()) == []


def test_what_a_job_costs_is_estimated_and_not_stored(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    estimate = jobs.estimate(**SMALL)
    assert (estimate.evaluations, estimate.walks) == (6, 12)
    assert estimate.simulated_seconds == pytest.approx(6 * (1.0 + 1.5))
    assert list(jobs.jobs()) == []


def test_jobs_are_listed_by_state_search_and_order(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    new = jobs.submit(**{**SMALL, "name": "Another"})
    assert [job.id for job in jobs.jobs()] == [new.id, finished.id]
    assert [job.id for job in jobs.jobs(order="fitness")] == [finished.id, new.id]
    assert [job.id for job in jobs.jobs(state="queued")] == [new.id]
    assert [job.id for job in jobs.jobs(search="SMALL")] == [finished.id]
    assert [job.id for job in jobs.jobs(limit=1)] == [new.id]
    assert list(jobs.jobs(limit=0)) == []


def test_a_list_longer_than_a_page_is_whole(reach: Reach, many_jobs: Path) -> None:
    assert [int(job.name) for job in reach(many_jobs).jobs()] == list(range(103))[::-1]


REFUSED: dict[str, tuple[Callable[[gaitswarm.Jobs, str], Any], str]] = {
    "unknown state": (lambda jobs, _: list(jobs.jobs(state="flying")), "state"),
    "unknown order": (lambda jobs, _: list(jobs.jobs(order="age")), "order"),
    "unknown format": (lambda jobs, job: list(jobs.export(job, cast(Any, "xlsx"))), "format"),
    "unknown preference": (lambda jobs, job: jobs.ranking(job, cast(Any, "Z")), "preference"),
    "rank nothing": (lambda jobs, job: jobs.ranking(job, "A", top=0), "top"),
    "spent budget": (lambda jobs, job: jobs.extend(job, 1), "iterations"),
    "compare nothing": (lambda jobs, _: jobs.parameters([]), "job_ids"),
    "one id as text": (lambda jobs, job: jobs.parameters(job), "job_ids"),
    "targets of a drive": (lambda jobs, job: jobs.targets([job]), "job_id"),
    "leave out what": (
        lambda jobs, job: jobs.targets([job], leave_out=cast(Any, "row")),
        "leave_out",
    ),
    "a drive's certificate": (lambda jobs, job: jobs.certificate(job), "job_id"),
    "no world": (lambda jobs, job: jobs.certificate(job, worlds=0), "worlds"),
    "verify by no digest": (lambda jobs, job: jobs.verify(job, head="abc"), "head"),
}


def test_an_argument_that_makes_no_sense_is_refused_by_name(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    for name, (ask, field) in REFUSED.items():
        with pytest.raises(gaitswarm.InvalidRequest) as raised:
            ask(jobs, finished.id)
        assert (name, raised.value.field) == (name, field)


MISSING: tuple[Callable[[gaitswarm.Jobs], Any], ...] = (
    lambda jobs: jobs.job("nosuchjob"),
    lambda jobs: jobs.job(".."),
    lambda jobs: jobs.pause("nosuchjob"),
    lambda jobs: jobs.extend("nosuchjob", 9),
    lambda jobs: jobs.best("nosuchjob"),
    lambda jobs: list(jobs.iterations("nosuchjob")),
    lambda jobs: list(jobs.history("nosuchjob")),
    lambda jobs: jobs.evaluations("nosuchjob"),
    lambda jobs: list(jobs.follow("nosuchjob")),
    lambda jobs: jobs.wait("nosuchjob"),
    lambda jobs: jobs.ranking("nosuchjob", "B"),
    lambda jobs: jobs.parameters(["nosuchjob"]),
    lambda jobs: jobs.targets(["nosuchjob"]),
    lambda jobs: jobs.certificate("nosuchjob"),
    lambda jobs: list(jobs.export("nosuchjob")),
    lambda jobs: jobs.recording("0" * 32),
)


def test_what_is_not_there_is_not_found(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    for ask in MISSING:
        with pytest.raises(gaitswarm.NotFound):
            ask(jobs)


def test_commands_change_the_state_until_the_job_has_ended(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    job = jobs.submit(**SMALL)
    assert jobs.pause(job.id).state == "paused"
    with pytest.raises(gaitswarm.Conflict, match="cannot pause a job that is paused"):
        jobs.pause(job.id)
    assert jobs.resume(job.id).state == "queued"
    assert jobs.pause(job.id).state == "paused"
    assert jobs.cancel(job.id).state == "cancelled"
    with pytest.raises(gaitswarm.Conflict):
        jobs.extend(job.id, 9)


def test_consent_to_changes_is_kept_with_the_job(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    job = jobs.submit(**SMALL)
    for accepted in (True, False):
        jobs.pause(job.id)
        jobs.resume(job.id, accept_changes=accepted)
        with closing(open_store(str(db))) as store:
            assert store.job(job.id).accepts_changes is accepted


def test_a_job_that_succeeded_is_extended(reach: Reach, finished: Finished) -> None:
    extended = reach(finished.db).extend(finished.id, 4)
    assert (extended.state, extended.iterations, extended.iterations_planned) == ("queued", 2, 4)


def test_a_job_of_another_version_is_listed_and_what_needs_its_spec_is_refused(
    reach: Reach, finished: Finished
) -> None:
    with closing(sqlite3.connect(finished.db)) as connection, connection:
        connection.execute("UPDATE jobs SET spec = json_set(spec, '$.schema_version', 99)")
    jobs = reach(finished.db)
    assert [job.id for job in jobs.jobs()] == [finished.id]
    job = jobs.job(finished.id)
    asks: tuple[Callable[[], Any], ...] = (
        lambda: job.spec,
        lambda: jobs.evaluations(job.id),
        lambda: list(jobs.history(job.id)),
        lambda: list(jobs.export(job.id)),
        lambda: jobs.ranking(job.id, "B"),
    )
    for ask in asks:
        with pytest.raises(gaitswarm.Conflict, match="schema_version"):
            ask()


def test_a_job_without_a_design_that_walks_has_no_best(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    job = jobs.submit(**SMALL)
    assert job.best is None
    with pytest.raises(gaitswarm.NotFound, match="design yet"):
        jobs.best(job.id)


def test_history_iterations_and_best_are_those_of_the_run(reach: Reach, finished: Finished) -> None:
    jobs, result = reach(finished.db), finished.result
    assert jobs.best(finished.id) == result.best
    iterations = list(jobs.iterations(finished.id))
    assert tuple(iterations) == result.iterations
    assert list(jobs.iterations(finished.id, after=0)) == iterations[1:]
    history = list(jobs.history(finished.id))
    assert [h.best_so_far for h in history] == [i.best_so_far for i in iterations]
    found = [e for h in history for e in h.evaluations if e.fitness == result.best.fitness]
    assert found[0].design == result.best.design


def test_evaluations_are_a_table_of_the_same_numbers(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    table = jobs.evaluations(finished.id)
    particles = [e for h in jobs.history(finished.id) for e in h.evaluations]
    assert table.fitness.tolist() == [e.fitness for e in particles]
    assert table.designs.tolist() == [list(e.design.values()) for e in particles]
    assert table.variables == tuple(particles[0].design)
    assert table.statuses.tolist() == [
        [walk.status for walk in e.scenarios.values()] for e in particles
    ]
    assert table.objectives.tolist() == [
        [list(walk.objectives.values()) for walk in e.scenarios.values()] for e in particles
    ]


def test_an_export_is_the_whole_table_in_parts(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    content = b"".join(jobs.export(finished.id, "parquet"))
    assert pq.read_table(io.BytesIO(content)).equals(jobs.evaluations(finished.id).to_arrow())
    lines = b"".join(jobs.export(finished.id, "csv")).splitlines()
    assert len(lines) == 7
    assert lines[0].startswith(b"iteration,particle,fitness,design.")


def test_following_a_job_tells_what_is_committed_and_how_it_ended(
    reach: Reach, finished: Finished
) -> None:
    *iterations, state = reach(finished.db).follow(finished.id)
    assert tuple(iterations) == finished.result.iterations
    assert isinstance(state, gaitswarm.StateView)
    assert (state.state, state.iterations) == ("succeeded", 2)


def test_following_leaves_out_what_is_known(reach: Reach, finished: Finished) -> None:
    iteration, state = reach(finished.db).follow(finished.id, after=0)
    assert iteration == finished.result.iterations[1]
    assert isinstance(state, gaitswarm.StateView)


def test_a_job_is_not_followed_to_a_good_end_in_a_database_that_was_overwritten(
    finished: Finished,
) -> None:
    with gaitswarm.open(finished.db) as jobs:
        events = jobs.follow(finished.id)
        next(events)
        finished.db.write_bytes(os.urandom(finished.db.stat().st_size))
        with pytest.raises(gaitswarm.StoreUnavailable, match="database"):
            list(events)


def test_a_job_is_followed_from_its_submission_to_its_end(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    job = jobs.submit(**SMALL)
    events = iter(jobs.follow(job.id))
    first = next(events)
    assert isinstance(first, gaitswarm.StateView)
    assert first.state == "queued"
    with gaitswarm.open(db) as here:
        here.run(job.id)
    rest = list(events)
    indices = [e.index for e in rest if isinstance(e, gaitswarm.IterationView)]
    states = [e.state.value for e in rest if isinstance(e, gaitswarm.StateView)]
    assert indices == [0, 1]
    assert states[-1] == "succeeded"
    assert states[:-1] in ([], ["running"])


def test_waiting_for_a_job_returns_it_as_it_ended(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    assert jobs.wait(finished.id).state == "succeeded"
    other = jobs.submit(**SMALL)
    jobs.cancel(other.id)
    assert jobs.wait(other.id).state == "cancelled"


def test_designs_are_ranked_by_another_preference(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    torque = gaitswarm.Preference(bias=(0, 0, 0, 0, 0), exponent=(1, 0, 0, 0, 0))
    ranking = jobs.ranking(finished.id, torque, top=2)
    assert (ranking.evaluations, len(ranking.top)) == (6, 2)
    table = jobs.evaluations(finished.id)
    by_torque = np.sort(np.exp(np.log(table.objectives[:, :, 0]).mean(axis=1)))
    assert [design.fitness for design in ranking.top] == pytest.approx(by_torque[:2])
    assert jobs.ranking(finished.id, "B").preference == "B"


def test_the_stored_history_is_verified(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    head = jobs.job(finished.id).head
    found = jobs.verify(finished.id, replay=2, seed=1, head=head)
    assert found.verified and [check.name for check in found.checks] == ["chain", "head", "replay"]
    assert (found.iterations, found.head, found.seed) == (2, head, 1)
    assert found.head == finished.result.job.head == list(jobs.iterations(finished.id))[-1].digest
    with closing(sqlite3.connect(finished.db)) as connection:
        connection.execute("UPDATE evaluations SET fitness = 1 WHERE iteration = 1")
        connection.commit()
    changed = jobs.verify(finished.id)
    assert not changed.verified and changed.broken_at == 1


def test_runs_of_other_seeds_tell_which_parameters_agree(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    other = gaitswarm.optimize(db=finished.db, **{**SMALL, "seed": 8})
    agreement = jobs.parameters([finished.id, other.job.id])
    assert agreement.fitness == [finished.result.best.fitness, other.best.fitness]
    assert [parameter.name for parameter in agreement.parameters] == ["P", "I"]
    queued = jobs.submit(**{**SMALL, "seed": 9})
    with pytest.raises(gaitswarm.Conflict, match=queued.id):
        jobs.parameters([finished.id, queued.id])
    with pytest.raises(gaitswarm.InvalidRequest, match="another problem"):
        jobs.parameters([finished.id, jobs.submit(seed=10).id])


def test_a_calibration_is_compared_with_its_targets(reach: Reach, db: Path) -> None:
    walk = {"name": "pi", "controller": "pi", "design": PI, "scenarios": [SHORT_WALK]}
    target = {"walk": "pi", "quantity": "speed", "value": 0.15, "tolerance": 0.1}
    spec = {
        "kind": "calibration",
        "walks": [walk],
        "targets": [target, target | {"quantity": "energy", "value": 45.0}],
        "variables": ["contact_law"],
        "optimizer": {"particles": 3},
        "iterations": 1,
    }
    run = gaitswarm.optimize(spec, db=db, evaluator="in-process")
    reached = reach(db).targets([run.job.id], leave_out="target")
    assert (reached.job, reached.fitness) == (run.job.id, run.best.fitness)
    assert reached.design == run.best.design
    speed, energy = reached.targets
    assert speed.simulated == pytest.approx(
        1.0 / (run.best.scenarios["pi"].objectives["reciprocal_speed"] or 0.0)
    )
    assert energy.left_out is not None


def test_a_certificate_is_summed_up(reach: Reach, db: Path) -> None:
    spec = {
        "kind": "certificate",
        "controller": "pi",
        "design": PI,
        "scenarios": [SHORT_WALK],
        "variables": ["friction_factor"],
        "worlds": 6,
    }
    run = gaitswarm.optimize(spec, db=db, evaluator="in-process")
    found = reach(db).certificate(run.job.id, most=2)
    worths = run.evaluations().fitness.tolist()[1:]
    assert found.worlds == 6
    assert found.fitness.worst == max(worths)
    assert [world.fitness for world in found.worst] == sorted(worths, reverse=True)[:2]
    assert reach(db).certificate(run.job.id, worlds=3).worlds == 3


def test_a_recorded_walk_is_kept_and_taken_back(reach: Reach, db: Path) -> None:
    joints = load_robot("szabadka2").joint_names
    walk = gaitswarm.RecordedWalk(
        scenario=gaitswarm.SCENARIOS[0],
        controller="pi",
        design=PI,
        first_tick=0,
        joints=joints,
        current=((0.1,) * len(joints), (0.2,) * len(joints)),
    )
    jobs = reach(db)
    kept = jobs.record(walk)
    assert kept.rows == 2
    assert kept.mean_current == pytest.approx(0.15)
    assert jobs.recording(kept.id) == walk
    [listed] = jobs.recordings(search="FAST", limit=2)
    assert (listed.id, listed.rows, listed.seconds) == (kept.id, 2, kept.seconds)
    assert list(jobs.recordings(search="slow")) == []
    assert jobs.record(walk).id == kept.id


def test_closing_twice_does_no_harm(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    assert jobs.job(finished.id).id == finished.id
    jobs.close()
    jobs.close()


def test_it_says_where_the_jobs_are(
    reach: Reach, db: Path, serve: Callable[[Path], str], request: pytest.FixtureRequest
) -> None:
    by_server = "server" in request.node.callspec.params["reach"]
    assert reach(db).url == (serve(db) if by_server else str(db))
