"""Reuse of stored results, without any other effect."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
from gaitswarm.services.optimizer.run.coordinator import walk_keys
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.run.execution import (
    Journal,
    RunContext,
    evaluate_uncached,
    run_claim,
)
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import Outcome
from tests.examples.jobs import history
from tests.optimizer.formula import HERE, FormulaEvaluator, job, walk
from tests.optimizer.formula import SPEC as LONGER

SPEC = LONGER.model_copy(update={"iterations": 3})


class CountingEvaluator(FormulaEvaluator):
    """Counts the designs that walk."""

    def __init__(self) -> None:
        super().__init__()
        self.walked = 0

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        self.walked += len(request.designs)
        return super().evaluate(request, should_stop)


def spec(**given: Any) -> JobSpec:
    return JobSpec.model_validate({**SPEC.model_dump(), **given})


def run(
    store: Store, wanted: JobSpec = SPEC, *, cache: bool = True, provenance: JobProvenance = HERE
) -> tuple[Job, int]:
    """The job, and how many designs walked for it."""
    job, _ = store.create_job(wanted)
    claim = store.claim("runner", lease_seconds=30.0, job_id=job.id)
    assert claim is not None
    evaluator = CountingEvaluator()
    around = RunContext(store, evaluator, cache=cache, provenance=lambda _: provenance)
    ended = run_claim(claim, around)
    assert ended.state is JobState.SUCCEEDED
    return ended, evaluator.walked


def request(designs: list[list[float]]) -> EvaluationRequest:
    rows = np.array(designs)
    return EvaluationRequest("a-job", SPEC.cases({}), rows, HERE.simulation)


def keys_of(asked: EvaluationRequest) -> tuple[bytes, ...]:
    return walk_keys(SPEC, HERE.simulation, asked.designs)


def bits(outcomes: tuple[Outcome, ...]) -> list[tuple[bytes, bytes]]:
    return [(outcome.objectives.tobytes(), outcome.statuses.tobytes()) for outcome in outcomes]


def through(evaluator: CountingEvaluator) -> Journal:
    return Journal(Claim(job(), "runner", 1, None), Knows({}), evaluator)


class Knows(Store):
    """A store with given cached outcomes."""

    def __init__(self, known: dict[bytes, Outcome]) -> None:
        self.cached = known

    def known(self, keys: Any) -> dict[bytes, Outcome]:
        return {key: self.cached[key] for key in keys if key in self.cached}


def test_a_multi_objective_job_under_another_preference_needs_no_walk(store: Store) -> None:
    by_a, by_c = (
        JobSpec.model_validate(SPEC.model_dump() | {"optimizer": "hype", "preference": name})
        for name in ("A", "C")
    )
    first, walked = run(store, by_a)
    assert (walked, first.progress.evaluations_saved) == (by_a.budget, 0)
    again, walked = run(store, by_c)
    assert (walked, again.progress.evaluations_saved) == (0, by_c.budget)
    assert again.progress.best_fitness != first.progress.best_fitness


def test_a_job_that_was_run_before_needs_no_walk_and_has_the_same_bits(store: Store) -> None:
    first, walked = run(store)
    assert (walked, first.progress.evaluations_saved) == (SPEC.budget, 0)
    again, walked = run(store)
    assert (walked, again.progress.evaluations_saved) == (0, SPEC.budget)
    assert history(store, again.id) == history(store, first.id)
    assert again.progress.best_fitness == first.progress.best_fitness


def test_without_the_cache_all_is_walked_to_the_same_bits(store: Store) -> None:
    first, _ = run(store)
    again, walked = run(store, cache=False)
    assert (walked, again.progress.evaluations_saved) == (SPEC.budget, 0)
    assert history(store, again.id) == history(store, first.id)


def test_another_plan_shares_the_first_swarm(store: Store) -> None:
    run(store)
    longer, walked = run(store, spec(iterations=12))
    assert longer.progress.evaluations_saved == SPEC.optimizer.particles
    assert walked == longer.spec.budget - SPEC.optimizer.particles


def test_another_preference_judges_the_same_walks_by_itself(store: Store) -> None:
    first, _ = run(store)
    other, walked = run(store, spec(preference="B"))
    assert walked + other.progress.evaluations_saved == SPEC.budget
    assert other.progress.evaluations_saved >= SPEC.optimizer.particles
    assert other.progress.best_fitness != first.progress.best_fitness


def test_a_start_from_an_earlier_job_is_not_walked_again(store: Store) -> None:
    earlier, _ = run(store)
    best = store.best(earlier.id)
    assert best is not None
    start = [SPEC.design_space().shown(best.design.tolist())]
    job, walked = run(store, spec(seed=99, start=start))
    assert (walked, job.progress.evaluations_saved) == (SPEC.budget - 1, 1)


@pytest.mark.variants("scenarios", "precision")
@pytest.mark.parametrize(
    "given",
    [
        {"scenarios": ["normal-fast"]},
        {"scenarios": ["slope-fast", "normal-fast"]},
        {"robot": "szabadka2"},
        {"precision": "single"},
    ],
    ids=["scenarios", "their order", "robot", "precision"],
)
def test_walks_of_another_kind_are_not_shared(store: Store, given: dict[str, Any]) -> None:
    run(store)
    _, walked = run(store, spec(**given))
    assert walked >= SPEC.budget


@pytest.mark.variants("code")
@pytest.mark.parametrize(
    "change",
    [{"code_digest": "other"}, {"robot_digest": "other"}, {"backend": "reference"}],
    ids=["code", "robot", "backend"],
)
def test_walks_of_another_provenance_are_not_shared(store: Store, change: dict[str, Any]) -> None:
    run(store)
    simulation = HERE.simulation.model_copy(update=change)
    _, walked = run(store, provenance=HERE.model_copy(update={"simulation": simulation}))
    assert walked == SPEC.budget


def test_a_design_that_is_asked_for_twice_walks_once() -> None:
    asked = request([[0.5, 0.1], [0.2, 0.3], [0.5, 0.1], [0.5, 0.1]])
    evaluator = CountingEvaluator()
    keys = keys_of(asked)
    outcomes, walked = evaluate_uncached(through(evaluator), Knows({}), asked, keys, lambda: False)
    assert evaluator.walked == 2
    assert walked == (keys[0], keys[1], None, None)
    assert bits(outcomes) == bits(walk(asked))


def test_known_and_unknown_designs_come_in_the_order_of_the_request() -> None:
    asked = request([[0.5, 0.1], [0.2, 0.3], [0.7, 0.2]])
    keys, outcomes = keys_of(asked), walk(asked)
    known = Outcome(
        np.stack([outcome.objectives[1] for outcome in outcomes]),
        np.array([outcome.statuses[1] for outcome in outcomes], dtype=np.uint8),
    )
    evaluator = CountingEvaluator()
    found, walked = evaluate_uncached(
        through(evaluator), Knows({keys[1]: known}), asked, keys, lambda: False
    )
    assert (evaluator.walked, walked) == (2, (keys[0], None, keys[2]))
    assert bits(found) == bits(outcomes)


def test_an_outcome_that_lost_a_number_when_it_was_stored_is_walked_again() -> None:
    asked = request([[0.5, 0.1]])
    (key,) = keys_of(asked)
    objectives = np.stack([outcome.objectives[0] for outcome in walk(asked)])
    known = Outcome(
        np.where(objectives == objectives[0, 0], np.nan, objectives), np.zeros(2, dtype=np.uint8)
    )
    evaluator = CountingEvaluator()
    outcomes, _ = evaluate_uncached(
        through(evaluator), Knows({key: known}), asked, (key,), lambda: False
    )
    assert evaluator.walked == 1
    assert bits(outcomes) == bits(walk(asked))


def test_a_store_that_does_not_answer_knows_nothing() -> None:
    class Gone(Knows):
        def known(self, keys: Any) -> dict[bytes, Outcome]:
            raise StoreUnavailable("gone")

    asked = request([[0.5, 0.1], [0.2, 0.3]])
    outcomes, walked = evaluate_uncached(
        through(CountingEvaluator()), Gone({}), asked, keys_of(asked), lambda: False
    )
    assert (bits(outcomes), walked) == (bits(walk(asked)), keys_of(asked))


def test_walks_without_keys_are_all_walked() -> None:
    asked, evaluator = request([[0.5, 0.1], [0.5, 0.1]]), CountingEvaluator()
    assert evaluate_uncached(through(evaluator), Knows({}), asked, (), lambda: False)[1] == ()
    assert evaluator.walked == 2


def test_a_key_does_not_depend_on_what_is_fixed_and_what_is_searched() -> None:
    fixed = spec(variables=["P"], fixed={"I": 0.25})
    turned = spec(variables=["I", "P"])
    simulation = HERE.simulation
    key = walk_keys(SPEC, simulation, np.array([[0.5, 0.25]]))
    assert SPEC.design_space().names == fixed.design_space().names == ("P", "I")
    assert walk_keys(fixed, simulation, np.array([[0.5, 0.25]])) == key
    assert walk_keys(turned, simulation, np.array([[0.25, 0.5]])) == key
    assert walk_keys(SPEC, simulation, np.array([[0.25, 0.5]])) != key
