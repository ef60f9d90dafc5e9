"""Which jobs are compared with each other, and what they come to together."""

from __future__ import annotations

import pytest

from gaitswarm.requests.tournament import run_problem, run_standings, run_tournaments
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.job import Command
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.sql_store import SqlStore
from tests.tournament.examples import entrant, submitted


@pytest.fixture
def service(store: SqlStore) -> JobService:
    return JobService(store)


def test_jobs_on_the_same_terms_are_one_tournament_and_any_of_them_stands_for_it(
    service: JobService,
) -> None:
    service.submit(JobSpec(controller="pi"))
    first = submitted(service, entrant("pso", "pso"), [0.5, 1e-4])
    other = submitted(service, entrant("pso", "pso", evaluations=41, checkpoints=(1, 41)))
    second = submitted(service, entrant("", "random"), [0.7, 0.8])

    (newer, older) = run_tournaments(service)
    assert (newer.id, [e.label for e in newer.entrants]) == (other.id, ["pso"])
    assert older.id == first.id
    assert [(e.label, e.method, e.job, e.runs, e.runs_planned) for e in older.entrants] == [
        ("pso", "pso", first.id, 2, 4),
        ("random", "random", second.id, 2, 4),
    ]
    assert (older.problems, older.evaluations) == (["D4C1R0I1", "D7C0R1I1"], 40)
    assert run_standings(service, second.id) == run_standings(service, first.id)


def test_jobs_of_other_code_and_cancelled_ones_take_no_part(store: SqlStore) -> None:
    service = JobService(store)
    first = submitted(service, entrant("pso", "pso"), [0.5])
    changed = JobService(
        store,
        provenance=lambda spec: job_provenance(spec).model_copy(
            update={"optimizer_digest": "0" * 32}
        ),
    )
    other = submitted(changed, entrant("random", "random"), [0.5])
    cancelled = submitted(service, entrant("ps", "ps"))
    service.command(cancelled.id, Command.CANCEL)

    assert {t.id: [e.label for e in t.entrants] for t in run_tournaments(service)} == {
        first.id: ["pso"],
        other.id: ["random"],
    }
    with pytest.raises(InvalidRequest, match="was cancelled"):
        run_standings(service, cancelled.id)


def test_labels_that_are_alike_are_told_apart_by_their_jobs(service: JobService) -> None:
    jobs = [submitted(service, entrant("pso", "pso", seed=seed)) for seed in (1, 2)]
    (found,) = run_tournaments(service)
    assert [e.label for e in found.entrants] == [f"pso ({job.id})" for job in jobs]


def test_settings_that_are_drawn_are_named(service: JobService) -> None:
    drawn = [{"name": "cognitive", "low": 0.5, "high": 2.0}]
    submitted(service, entrant("pso", "pso", variables=["seed", *drawn]))
    ((one,),) = [found.entrants for found in run_tournaments(service)]
    assert one.drawn == ["cognitive"]


def test_standings_are_those_of_the_runs_that_have_ended(service: JobService) -> None:
    job = submitted(service, entrant("good", "pso"), [1e-4, 1e-3, 0.5])
    submitted(service, entrant("bad", "random"), [0.7, 0.8])
    submitted(service, entrant("late", "ps"))

    found = run_standings(service, job.id)
    assert [e.label for e in found.tournament.entrants] == ["good", "bad", "late"]
    assert {m: r.value for m, r in found.mean_ranks.items()} == {"good": 1.0, "bad": 2.0}
    for problem in found.problems.values():
        good, bad = problem.methods["good"], problem.methods["bad"]
        assert problem.target == 1e-3
        assert (good.rank, good.runs, good.solved, good.least) == (1.0, 3, 2, 1e-4)
        # Two of three runs took 10 evaluations, the third all of its 40.
        assert good.expected_running_time.value == 30.0
        assert good.median_best == {"40": 1e-3}
        assert (bad.rank, bad.runs, bad.solved) == (2.0, 2, 0)
        assert bad.expected_running_time.value is None
    strict = next(profile for profile in found.profiles if profile.precision == 1e-3)
    assert strict.budgets[-1] == pytest.approx(40 / 5)
    # tau asks for 0.0051; the first checkpoint that shows it is at ten evaluations.
    assert strict.shares["good"][0] == 0.0
    assert strict.shares["good"][-1] == pytest.approx(2 / 3)
    assert strict.shares["bad"][-1] == 0.0


def test_a_problem_shows_every_run_and_their_quartiles(service: JobService) -> None:
    job = submitted(service, entrant("pso", "pso"), [1e-4, 0.2, 0.5, 0.9])
    found = run_problem(service, job.id, "D7C0R1I1")
    runs = found.methods["pso"]
    assert (found.checkpoints, found.dimension, found.target) == ([1, 10, 40], 7, 1e-3)
    assert runs.best == [1e-4, 0.2, 0.5, 0.9]
    assert runs.found_after == [10.0] * 4
    assert runs.solved_after == [10.0, None, None, None]
    assert (runs.lower, runs.median, runs.upper) == ([5, 1e-4, 1e-4], [5, 0.2, 0.2], [5, 0.5, 0.5])
    with pytest.raises(NotFound, match="it has D4C1R0I1, D7C0R1I1"):
        run_problem(service, job.id, "D4C0R0I0")


def test_mean_ranks_are_compared_with_those_on_other_problems(service: JobService) -> None:
    values = {"pso": [0.1, 0.1], "ps": [0.2, 0.2], "random": [0.3, 0.3]}
    elsewhere = {"problems": [{"function": "D4C0R0I0"}]}
    for changes in ({}, elsewhere):
        jobs = [submitted(service, entrant(m, m, **changes), v) for m, v in values.items()]
    one, other = (found.id for found in run_tournaments(service))
    assert jobs[0].id == one
    correlation = run_standings(service, one, other).rank_correlation
    assert correlation is not None
    assert (correlation.value, correlation.methods) == (1.0, ["pso", "ps", "random"])
    assert run_standings(service, one).rank_correlation is None


def test_what_there_is_not_is_said(service: JobService) -> None:
    waiting = submitted(service, entrant("pso", "pso"))
    with pytest.raises(Conflict, match=r"no run .* has ended yet"):
        run_standings(service, waiting.id)
    tuning, _ = service.submit(JobSpec(controller="pi"))
    with pytest.raises(InvalidRequest, match="is of kind tuning") as raised:
        run_standings(service, waiting.id, tuning.id)
    assert raised.value.field == "compare_with"
    with pytest.raises(NotFound):
        run_problem(service, "nosuchjob", "D4C1R0I1")
