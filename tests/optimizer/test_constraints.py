"""Constraints of tuning jobs: what may be required, and which design is the best"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

import gaitswarm
from gaitswarm.jobs.base import job_view
from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.services.optimizer.analysis.verification import check_history
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.constraints import Constraint, excesses, feasible_first
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.run.runner import run_embedded
from gaitswarm.services.optimizer.search.hype import pareto_ranks
from gaitswarm.services.optimizer.search.optimizer import stored_state
from gaitswarm.services.optimizer.search.registry import METHODS, OPTIMIZERS, create_search
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, RESULTS, Status
from tests.examples.jobs import history
from tests.examples.walks import SHORT_WALK, UPHILL_WALK
from tests.optimizer.formula import SPEC, TradeOff

SCENARIOS = ("normal-fast", "slope-fast")
SPEED = [column.name for column in RESULTS].index("speed")
METHOD_NAMES = sorted(name for name in METHODS if not METHODS[name].missing and name != "auto")


def spec(*constraints: Any, **changes: Any) -> JobSpec:
    return JobSpec.model_validate(SPEC.model_dump() | {"constraints": constraints} | changes)


def results(*speeds: tuple[float, float]) -> np.ndarray:
    """Designs with these speeds in both scenarios; everything else is 1."""
    found = np.ones((len(speeds), 2, len(RESULTS)))
    found[:, :, SPEED] = speeds
    return found


def judged(job: JobSpec, found: np.ndarray, failed: Any = False) -> tuple[list[float], list[float]]:
    """Violations, and the order of the feedback."""
    lost = np.broadcast_to(failed, found.shape[:2])
    fitness = job.judge(found, lost).fitness
    violations = job.violations(found, lost)
    assert violations is not None
    assert np.isfinite(fitness).tolist() == (violations == 0.0).tolist()
    feedback = job.search_feedback(found, lost, fitness)
    return violations.tolist(), np.argsort(feedback, kind="stable").tolist()


@pytest.mark.parametrize(
    ("text", "document"),
    [
        ("speed>=0.05", {"quantity": "speed", "min": 0.05}),
        (
            " slope-fast : speed >= 3e-2 ",
            {"quantity": "speed", "scenario": "slope-fast", "min": 0.03},
        ),
        ("peak_current<=2", {"quantity": "peak_current", "max": 2}),
        (
            "energy<=0.9*published:A",
            {"quantity": "energy", "max": 0.9, "relative_to": "published:A"},
        ),
        ("*<=published:A", {"quantity": "*", "max": 1, "relative_to": "published:A"}),
        (
            "*:energy<=1.1*job:k2q7zr5dm9xw",
            {"quantity": "energy", "max": 1.1, "relative_to": "k2q7zr5dm9xw"},
        ),
    ],
)
def test_a_constraint_may_be_written_as_text(text: str, document: dict[str, Any]) -> None:
    job = spec(text)
    assert job.constraints == (Constraint.model_validate(document),)
    assert spec(str(job.constraints[0])).constraints == job.constraints


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        (["sped>=0.05"], "constraints.0.quantity: unknown quantity 'sped'; did you mean 'speed'?"),
        (["speed>=1", "slop-fast:speed>=1"], "did you mean 'slope-fast'?"),
        (["speed=0.05"], "'speed=0.05' is not [SCENARIO:]QUANTITY<=LIMIT"),
        (["speed>=fast"], "'speed>=fast' is not"),
        ([{"quantity": "speed"}], "has no limit; set min, max or both"),
        ([{"quantity": "speed", "min": 2.0, "max": 1.0}], "min: 2 exceeds max, which is 1"),
        (["*<=1"], "quantity: * requires relative_to"),
        (
            ["speed>=0.1", "slope-fast:speed<=0.05"],
            "constraints.1: slope-fast:speed<=0.05 contradicts speed>=0.1: in slope-fast speed",
        ),
    ],
)
def test_what_no_design_can_keep_is_refused_by_name(constraints: list[Any], message: str) -> None:
    with pytest.raises(ValidationError) as refused:
        spec(*constraints)
    assert message in str(refused.value)


def test_the_violation_is_the_sum_of_relative_excesses() -> None:
    job = spec(
        "speed>=0.1", "slope-fast:speed>=0.2", {"quantity": "torque", "min": 0.5, "max": 0.8}
    )
    violations, _ = judged(job, results((0.2, 0.2), (0.05, 0.3), (0.1, 0.1)))
    torque = 2.0 * (1.0 - 0.8) / 0.8
    assert violations == pytest.approx([torque, torque + 0.5, torque + 0.5])
    limits = job.limits()
    rows = excesses(limits, results((0.05, 0.3)))[:, 0]
    assert [(limit.case, limit.sign) for limit, x in zip(limits, rows, strict=True) if x] == [
        *((0, -1.0), (0, 1.0), (1, 1.0)),
    ]


def test_a_limit_of_zero_is_exceeded_by_the_value_itself() -> None:
    violations, _ = judged(spec("height_loss<=0"), results((1.0, 1.0)))
    assert violations == [2.0]


def test_a_quantity_without_a_value_keeps_no_limit() -> None:
    violations, _ = judged(spec("speed<=0.5"), results((0.3, math.nan), (0.3, 0.3)))
    assert violations == [math.inf, 0.0]


def test_feasible_designs_come_first_then_less_violation_and_failures_last() -> None:
    found = results((0.3, 0.3), (0.1, 0.3), (0.3, 0.3), (0.05, 0.3), (0.3, 0.3))
    found[0, :, 0] = 50.0
    failed = np.zeros((5, 2), dtype=np.bool_)
    failed[2, 1] = True
    found[2, 1] = np.nan
    violations, order = judged(spec("speed>=0.2"), found, failed)
    assert violations == pytest.approx([0.0, 0.5, math.inf, 0.75, 0.0])
    assert order == [4, 0, 1, 3, 2]


def test_without_constraints_the_search_learns_the_fitness_alone() -> None:
    found, lost = results((0.3, 0.1)), np.zeros((1, 2), dtype=np.bool_)
    fitness = SPEC.judge(found, lost).fitness
    assert SPEC.violations(found, lost) is None
    assert SPEC.search_feedback(found, lost, fitness) is fitness


@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 1e60),
            st.one_of(st.just(0.0), st.floats(1e-12, 1e9), st.just(math.inf)),
        ),
        min_size=2,
        max_size=20,
    )
)
def test_numbers_for_the_search_keep_the_order_of_debs_rules(designs: list[Any]) -> None:
    values = [math.inf if violation else fitness for fitness, violation in designs]
    numbers = feasible_first(np.array(values), np.array([v for _, v in designs]))
    expected = sorted(range(len(designs)), key=lambda k: (designs[k][1], values[k]))
    assert np.argsort(numbers, kind="stable").tolist() == expected
    assert not np.isnan(numbers).any()


def test_of_objective_vectors_feasible_ones_dominate_and_others_compare_by_violation() -> None:
    hype = {"name": "hype", "particles": 4, "population": 6, "offspring": 6}
    job = spec("speed>=0.2", optimizer=hype)
    found = results((0.1, 0.3), (0.3, 0.3), (0.05, 0.3), (0.3, 0.3))
    found[0, :, :5] = 0.01
    found[3, :, 0], found[1, :, 1] = 2.0, 2.0
    lost = np.zeros((4, 2), dtype=np.bool_)
    vectors = job.search_feedback(found, lost, job.judge(found, lost).fitness)
    assert pareto_ranks(vectors).tolist() == [1, 0, 2, 0]


@pytest.mark.parametrize("name", METHOD_NAMES)
def test_every_method_learns_to_keep_constraints_and_resumes(name: str) -> None:
    """Minimize the distance from the origin beyond a plane; one corner fails."""
    space = Space.continuous([-2.0] * 3, [2.0] * 3)
    settings = OPTIMIZERS[name].model_copy(update={"particles": 10})

    def feedback(points: np.ndarray) -> np.ndarray:
        distance = 20.0 + np.square(points).sum(axis=1)
        violation = np.maximum(0.0, 1.0 - points.sum(axis=1))
        violation[points.min(axis=1) > 1.0] = np.inf
        numbers = feasible_first(np.where(violation > 0.0, np.inf, distance), violation)
        return np.stack([numbers, numbers], axis=1) if METHODS[name].multi_objective else numbers

    # A model of all designs before takes long: that of few already leads close to the best.
    budget = 40 if name == "bayesian" else 150
    search = create_search(settings, space, budget, 1, np.empty((0, 0)))
    best, resumed = math.inf, False
    with np.errstate(all="raise", under="ignore"):
        while search.evaluations < budget:
            points = search.ask(budget - search.evaluations)
            state = stored_state(search)
            values = feedback(points)
            best = min(best, float(values.min()))
            search.tell(values)
            if not resumed and search.evaluations > budget // 2:
                resumed = True
                again = create_search(settings, space, budget, 1, np.empty((0, 0)))
                again.load(json.loads(json.dumps(state)))
                again.tell(values)
                assert again.ask().tobytes() == search.ask().tobytes()
    # The nearest feasible point has 20.33; random points come within 20.6.
    assert resumed and 20.33 < best < (21.0 if name == "random" else 20.9)


def run(store: Store, job: JobSpec) -> Job:
    done = run_embedded(store, TradeOff(), JobService(store).submit_embedded(job))
    assert done.state is JobState.SUCCEEDED, done.error
    return done


FAST = "reciprocal_speed<=1"
"""Kept by gains above 0.9; the fitness without constraints is best at 0.7."""


def test_the_best_design_is_the_best_feasible_one(store: Store) -> None:
    job = run(store, spec(FAST))
    columns = store.evaluation_columns(job.id, 0, 100)
    assert columns is not None
    slow = (columns.objectives[:, :, 4] > 1.0).any(axis=1)
    failed = columns.failed.any(axis=1)
    unconstrained = SPEC.judge(columns.objectives, columns.failed).fitness
    assert (slow & ~failed).any() and (~slow & ~failed).any() and failed.any()
    assert np.array_equal(columns.fitness, np.where(slow, math.inf, unconstrained))
    assert unconstrained.min() < job.progress.best_fitness == columns.fitness.min()
    assert job.progress.infeasible == int((slow & ~failed).sum())
    assert job.progress.least_violation == 0.0
    iterations = store.iterations(job.id).items
    assert sum(i.failed for i in iterations) == int(failed.sum())
    assert sum(i.infeasible for i in iterations) == job.progress.infeasible
    assert not check_history(store, job).problem
    for forged in ({"infeasible": 0}, {"least_violation": 0.5}):
        edited = replace(job, progress=job.progress._replace(**forged))
        assert "infeasible designs are not those" in check_history(store, edited).problem


def test_a_constrained_job_killed_after_every_iteration_has_the_same_bits(store: Store) -> None:
    job = spec(FAST)
    whole = run(store, job)
    job_id = store.create_job(job.resolved())[0].id

    class KilledError(Exception):
        pass

    def kill(done: CompletedIteration, state: JobState) -> None:
        raise KilledError

    while not store.job(job_id).state.terminal:
        taken = store.claim("runner", lease_seconds=30.0, job_id=job_id)
        assert taken is not None
        with pytest.raises(KilledError):
            run_claim(taken, RunContext(store, TradeOff(), on_commit=kill))
    assert history(store, job_id) == history(store, whole.id)


def test_a_constraint_that_no_design_met_is_a_result_that_says_why(store: Store) -> None:
    job = run(store, spec(FAST, "slope-fast:reciprocal_speed<=0.1", iterations=2))
    view = job_view(JobService(store), job)
    assert view.best is None and view.closest is not None
    columns = store.evaluation_columns(job.id, 0, 2)
    assert columns is not None
    violations = job.spec.violations(columns.objectives, columns.failed)
    assert violations is not None
    row = int(violations.argmin())
    assert view.closest.violation == job.progress.least_violation == violations[row]
    assert (view.closest.iteration, view.closest.particle) == (
        columns.iteration[row],
        columns.particle[row],
    )
    worst = view.closest.violated[0]
    assert (worst.case, worst.quantity, worst.limit) == ("slope-fast", "reciprocal_speed", 0.1)
    assert worst.value == columns.objectives[row, 1, 4]
    assert view.closest.explanation.startswith("no design met the constraints; closest is")
    assert "reciprocal_speed in slope-fast is" in view.closest.explanation
    with pytest.raises(gaitswarm.NotFound, match="no design met the constraints"):
        DatabaseJobs(JobService(store), "").best(job.id)


def test_a_constraint_holds_in_every_world(store: Store) -> None:
    worlds = {"count": 2, "ranges": ["friction_factor"]}
    job = spec("slope-fast:speed>=0.2", worlds=worlds)
    assert job.case_names[2:] == ("slope-fast.world-0", "slope-fast.world-1")
    found = np.ones((2, 4, len(RESULTS)))
    found[0, 3, SPEED] = 0.1
    found[1, :2, SPEED] = 0.1
    assert judged(job, found)[0] == pytest.approx([0.5, 0.0])


WALKS = {"scenarios": [SHORT_WALK, UPHILL_WALK], "iterations": 1}


def test_references_are_simulated_once_and_the_search_starts_from_them(store: Store) -> None:
    service = JobService(store)
    first, _ = service.submit(
        spec("*<=published:validation", "speed>=0.5*published:validation", **WALKS)
    )
    assert isinstance(first.spec, JobSpec)
    published = dict(CONTROLLERS["pi"].published["validation"])
    simulated = gaitswarm.simulate(published, controller="pi", scenarios=[SHORT_WALK, UPHILL_WALK])
    for k, (case, values) in enumerate((first.spec.constraints[0].reference or {}).items()):
        assert case == first.spec.case_names[k]
        assert tuple(values) == OBJECTIVE_NAMES[:5]
        assert list(values.values()) == simulated.objectives[0, k, :5].tolist()
    assert first.spec.start == (published,)
    raw = np.concatenate([simulated.objectives, simulated.measurements], axis=2)
    assert first.spec.violations(raw, np.zeros((1, 2), dtype=np.bool_)) == [0.0]
    assert SPEC.resolved().start == ()

    design = dict(published)
    second, _ = service.submit(spec({"quantity": "*", "relative_to": design, "max": 1.0}, **WALKS))
    assert isinstance(second.spec, JobSpec)
    assert second.spec.constraints[0].reference == first.spec.constraints[0].reference


@pytest.mark.parametrize(
    ("constraint", "message"),
    [
        (
            "energy<=published:Z",
            "constraints.0.relative_to: no published design 'Z' of pi; known are",
        ),
        ("energy<=job:k2q7zr5dm9xw", "constraints.0.relative_to: there is no job 'k2q7zr5dm9xw'"),
        ({"quantity": "*", "relative_to": {"P": 1.0}, "max": 1.0}, "the design has no I"),
        (
            {"quantity": "energy", "relative_to": {"P": 0.0, "I": 0.0}, "max": 1.0},
            "constraints.0.relative_to: it fails in ",
        ),
    ],
)
def test_a_reference_without_values_is_refused_by_name(
    store: Store, constraint: Any, message: str
) -> None:
    with pytest.raises(InvalidRequest) as refused:
        JobService(store).submit(spec(constraint, **WALKS))
    assert message in f"{refused.value.field}: {refused.value}"


def test_a_job_without_a_feasible_design_is_no_reference(store: Store) -> None:
    job = run(store, spec("reciprocal_speed<=0.01", iterations=1))
    with pytest.raises(InvalidRequest, match="has no feasible design yet"):
        JobService(store).submit(spec(f"energy<=job:{job.id}"))


def test_a_contradiction_with_a_reference_is_found_at_submission(store: Store) -> None:
    both = spec("speed>=9", "speed<=2*published:validation", **WALKS)
    with pytest.raises(
        InvalidRequest, match="contradicts speed>=9: in short speed would"
    ) as refused:
        JobService(store).submit(both)
    assert refused.value.field == "constraints.1"


def test_a_gait_is_searched_without_the_cycle_time_that_tells_scenarios_apart() -> None:
    names = {v.name for v in JobSpec(controller="pi").with_gait_searched().design_space().variables}
    assert names == {"P", "I", "stride", "height", "duty_factor", "fir_ms"}
    alone = JobSpec(controller="pi", scenarios=("normal-fast",)).with_gait_searched()
    assert "cycle_time" in alone.design_space().names


def test_a_search_of_controller_and_gait_starts_from_the_reference_in_its_own_gait(
    store: Store,
) -> None:
    free = JobSpec(controller="pi").with_gait_searched().design_space()
    job = spec("*<=published:validation", **WALKS).with_gait_searched()
    bounds = {v.name: (v.low, v.high) for v in job.design_space().variables}
    assert [v.name for v in free.variables if bounds[v.name] != (v.low, v.high)] == [
        *("stride", "height")
    ]
    assert (bounds["stride"], bounds["height"]) == ((0.06, 0.18), (0.01, 0.043))
    published = dict(CONTROLLERS["pi"].published["validation"])
    submitted, _ = JobService(store).submit(job)
    assert isinstance(submitted.spec.start, tuple)
    (start,) = submitted.spec.start
    gait = {"stride": 0.06, "height": 0.043, "duty_factor": 0.56, "fir_ms": 12.0}
    assert start == {"P": published["P"], "I": published["I"]} | gait
    scenarios = [SHORT_WALK, UPHILL_WALK]
    in_gait = gaitswarm.simulate(dict(start), controller="pi", scenarios=scenarios)
    as_published = gaitswarm.simulate(published, controller="pi", scenarios=scenarios)
    assert in_gait.objectives.tobytes() == as_published.objectives.tobytes()


def test_a_fork_is_judged_by_its_own_constraints_without_simulation(store: Store) -> None:
    parent = run(store, spec())
    service = JobService(store)
    request = ForkRequest.model_validate(
        {"from_iteration": 6, "iterations": 7, "constraints": [FAST]}
    )
    fork, _ = service.fork(parent.id, request)
    whole = run(store, spec(FAST))
    assert fork.lineage is not None and fork.lineage.changed == ("constraints",)
    columns = store.evaluation_columns(parent.id, 0, 6)
    assert columns is not None
    expected = fork.spec.judge(columns.objectives, columns.failed).fitness
    assert fork.lineage.carried == "search"
    assert store.job(fork.id).progress.best_fitness == expected.min()
    assert store.job(fork.id).progress.infeasible > 0
    done = run_embedded(store, TradeOff(), fork.id)
    assert done.state is JobState.SUCCEEDED and not check_history(store, done).problem
    lifted, _ = service.fork(
        whole.id,
        ForkRequest.model_validate({"from_iteration": 6, "iterations": 7, "constraints": []}),
    )
    assert isinstance(lifted.spec, JobSpec) and lifted.spec.constraints == ()


WEIGHTED: dict[str, Any] = {"scenario_weights": {"slope-fast": 4.0}}
WORST: dict[str, Any] = {"scenario_aggregate": "worst"}


@pytest.mark.parametrize(("before", "measure"), [({}, WORST), (WORST, WEIGHTED)])
def test_a_history_is_forked_and_ranked_with_other_weights_of_scenarios(
    store: Store, before: dict[str, Any], measure: dict[str, Any]
) -> None:
    parent = run(store, spec(FAST, **before))
    service = JobService(store)
    columns = store.evaluation_columns(parent.id, 0, 6)
    assert columns is not None
    expected = spec(FAST, **measure).judge(columns.objectives, columns.failed).fitness

    request = ForkRequest.model_validate({"from_iteration": 6, "iterations": 7, **measure})
    fork, _ = service.fork(parent.id, request)
    assert fork.lineage is not None and fork.lineage.carried == "search"
    assert isinstance(fork.spec, JobSpec)
    assert fork.spec.aggregation == spec(**measure).aggregation
    assert store.job(fork.id).progress.best_fitness == expected.min()

    top = DatabaseJobs(service, "").ranking(parent.id, **measure, top=1000).top
    assert [design.fitness for design in top] == pytest.approx(
        sorted(expected[np.isfinite(expected)].tolist())
    )


def test_statuses_count_as_failures_alone(store: Store) -> None:
    job = run(store, spec("reciprocal_speed<=0.01", iterations=1))
    columns = store.evaluation_columns(job.id, 0, 1)
    assert columns is not None
    (only,) = store.iterations(job.id).items
    assert only.failed == int((columns.statuses != Status.OK).any(axis=1).sum())
    assert only.infeasible == len(columns) - only.failed
    assert only.best is None


def test_a_history_is_ranked_under_other_constraints_without_simulation(store: Store) -> None:
    job = run(store, spec(FAST))
    jobs = DatabaseJobs(JobService(store), "")
    columns = store.evaluation_columns(job.id, 0, 100)
    assert columns is not None
    assert isinstance(job.spec, JobSpec)
    for constraints in (None, [], ["slope-fast:reciprocal_speed<=0.98", "torque<=4"]):
        measure = spec(*(job.spec.constraints if constraints is None else constraints))
        expected = measure.judge(columns.objectives, columns.failed).fitness
        ranking = jobs.ranking(job.id, constraints=constraints, top=1000)
        assert [design.fitness for design in ranking.top] == pytest.approx(
            sorted(expected[np.isfinite(expected)].tolist())
        )
        assert ranking.infeasible == len(columns) - len(ranking.top) - int(
            columns.failed.any(axis=1).sum()
        )
        by_b = jobs.ranking(job.id, "B", constraints=constraints, top=1000)
        places = {(design.iteration, design.particle) for design in ranking.top}
        assert {(design.iteration, design.particle) for design in by_b.top} == places

        front = jobs.front(job.id, constraints=constraints)
        assert {(design.iteration, design.particle) for design in front.designs} <= places
        assert (front.designs_judged, front.infeasible) == (len(ranking.top), ranking.infeasible)
        winner = next(winner for winner in front.winners if winner.preference == "job")
        assert winner.fitness == pytest.approx(float(expected.min()))


def test_analyses_of_preferences_know_feasible_designs_alone(store: Store) -> None:
    job = run(store, spec(FAST))
    jobs = DatabaseJobs(JobService(store), "")
    columns = store.evaluation_columns(job.id, 0, 100)
    assert columns is not None
    slow = (columns.objectives[:, :, 4] > 1.0).any(axis=1) & ~columns.failed.any(axis=1)
    infeasible = set(
        zip(columns.iteration[slow].tolist(), columns.particle[slow].tolist(), strict=True)
    )
    iteration, particle = min(infeasible)
    with pytest.raises(gaitswarm.Conflict, match="violates the job's constraints"):
        jobs.preference_for(job.id, iteration, particle)
    best = job.progress
    assert best.best_iteration is not None and best.best_particle is not None
    assert jobs.preference_for(job.id, best.best_iteration, best.best_particle).wins
