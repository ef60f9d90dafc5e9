"""Contract of all evaluators."""

from __future__ import annotations

import itertools
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, ProvenanceChanged
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped, Evaluator
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.sim import simulate
from gaitswarm.sim.case import Walk
from gaitswarm.sim.errors import KernelBuildError, SimulationInputError
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.robot import RobotVariant
from gaitswarm.sim.scenario import Scenario
from tests.examples.walks import short_walk
from tests.worker.cases import slow
from tests.worker.requests import SCENARIOS, bits, never, request, walked_at_once

pytestmark = pytest.mark.slow

MORE_CASES_THAN_SLOTS = (*SCENARIOS, short_walk(name="slower", cycle_time=1.2))


@pytest.mark.variants("in_process-1-2", "*-7-3")
@pytest.mark.parametrize("scenarios", [SCENARIOS, MORE_CASES_THAN_SLOTS], ids=["2", "3"])
@pytest.mark.parametrize("count", [1, 7, 41])
def test_results_are_those_of_one_batch_in_index_order_to_the_bit(
    evaluator: Evaluator, count: int, scenarios: tuple[Scenario, ...]
) -> None:
    wanted = request(count, scenarios=scenarios)
    # The second time, the work is cut by what was measured in the first.
    for _ in range(2):
        assert bits(evaluator.evaluate(wanted, never)) == bits(walked_at_once(wanted))


def test_a_design_is_worth_the_same_in_whatever_company(evaluator: Evaluator) -> None:
    wanted = request(13)
    shuffled = np.random.default_rng(2).permutation(13)
    straight = evaluator.evaluate(wanted, never)
    mixed = evaluator.evaluate(replace(wanted, designs=wanted.designs[shuffled]), never)
    for a, b in zip(straight, mixed, strict=True):
        assert a.objectives[shuffled].tobytes() == b.objectives.tobytes()


def test_designs_are_not_changed(evaluator: Evaluator) -> None:
    wanted = request(5)
    before = wanted.designs.copy()
    wanted.designs.flags.writeable = False
    evaluator.evaluate(wanted, never)
    np.testing.assert_array_equal(wanted.designs, before)


def test_an_error_of_the_simulation_comes_through_as_itself(evaluator: Evaluator) -> None:
    wanted = request(9)
    wanted.designs[6, 0] = 1e9
    with pytest.raises(SimulationInputError, match="P"):
        evaluator.evaluate(wanted, never)
    sound = request(3)
    assert bits(evaluator.evaluate(sound, never)) == bits(walked_at_once(sound))


def test_walks_of_another_provenance_are_refused_in_words(evaluator: Evaluator) -> None:
    sound = request(9)
    changed = {"code_digest": "other", "libraries": {"casadi": "0.1"}, "robot_digest": "other"}
    wanted = replace(sound, provenance=sound.provenance.model_copy(update=changed))
    with pytest.raises(
        ProvenanceChanged, match=r"changed simulation code; casadi [0-9.]+ instead of 0.1"
    ):
        evaluator.evaluate(wanted, never)
    assert bits(evaluator.evaluate(sound, never)) == bits(walked_at_once(sound))


def test_work_is_dropped_when_it_is_stopped(evaluator: Evaluator) -> None:
    asked = itertools.count()
    begun = time.monotonic()
    with pytest.raises(EvaluationStopped):
        evaluator.evaluate(slow(400, 0.1), lambda: next(asked) > 1)
    assert time.monotonic() - begun < 10.0


@pytest.mark.variants("in_process")
def test_whether_to_stop_is_asked_at_least_once_a_second(
    evaluator: Evaluator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one of some tries: what else the machine does can only make a pause longer."""
    # A kernel that takes more than a second, and then a task that takes as long.
    monkeypatch.setattr(simulate, "prepare", lambda _, precision: time.sleep(1.1))

    def longest_pause() -> float:
        asked = [time.monotonic()]

        def stop_after_two_seconds() -> bool:
            asked.append(time.monotonic())
            return asked[-1] - asked[0] > 2.2

        with pytest.raises(EvaluationStopped):
            evaluator.evaluate(slow(2, 1.2), stop_after_two_seconds)
        asked.append(time.monotonic())
        return max(later - earlier for earlier, later in itertools.pairwise(asked))

    assert any(longest_pause() < 1.0 for _ in range(3))


def test_a_kernel_that_is_being_built_holds_up_only_those_who_need_it_and_are_not_stopped(
    evaluator: Evaluator, monkeypatch: pytest.MonkeyPatch
) -> None:
    building, may_end = threading.Event(), threading.Event()
    other = request(5)
    variant = RobotVariant(name="szabadka2", contact_law="stick")
    cases = tuple(Walk(variant, "pi", scenario, ("P", "I")) for scenario in SCENARIOS)

    def build(robot: object, *, precision: Precision) -> None:
        if robot == variant:
            building.set()
            may_end.wait()

    monkeypatch.setattr(simulate, "prepare", build)
    with pytest.raises(EvaluationStopped):
        evaluator.evaluate(replace(request(5), cases=cases), building.is_set)
    assert bits(evaluator.evaluate(other, never)) == bits(walked_at_once(other))
    may_end.set()


def test_a_kernel_that_cannot_be_built_is_an_error_to_all_who_need_it(
    evaluator: Evaluator, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_robot: object, *, precision: Precision) -> None:
        raise KernelBuildError("cc: 7 errors")

    with monkeypatch.context() as patched:
        patched.setattr(simulate, "prepare", refuse)
        for _ in range(2):
            with pytest.raises(KernelBuildError, match="7 errors"):
                evaluator.evaluate(request(3), never)
    sound = request(3)
    assert bits(evaluator.evaluate(sound, never)) == bits(walked_at_once(sound))


def test_jobs_at_the_same_time_do_not_disturb_each_others_bits(evaluator: Evaluator) -> None:
    wanted = [request(5 + 3 * k, job_id=f"job {k}", seed=k) for k in range(4)]
    found: dict[int, tuple[Outcome, ...]] = {}

    def run(k: int) -> None:
        found[k] = evaluator.evaluate(wanted[k], never)

    threads = [threading.Thread(target=run, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k in range(4):
        assert bits(found[k]) == bits(walked_at_once(wanted[k]))


def test_a_small_job_is_served_while_a_big_one_runs(evaluator: Evaluator) -> None:
    begun, stop, big_ended = threading.Event(), threading.Event(), threading.Event()

    def should_stop() -> bool:
        begun.set()
        return stop.is_set()

    def run_big() -> None:
        try:
            evaluator.evaluate(slow(400, 0.1, job_id="big"), should_stop)
        except EvaluationStopped:
            return
        big_ended.set()

    thread = threading.Thread(target=run_big)
    thread.start()
    begun.wait()
    evaluator.evaluate(request(8, job_id="small"), never)
    assert not big_ended.is_set()
    stop.set()
    thread.join()


def test_slots_are_the_processors_it_was_given(evaluator: Evaluator) -> None:
    assert evaluator.slots == 2


def test_a_closed_evaluator_says_so() -> None:
    evaluator = InProcessEvaluator(1)
    evaluator.close()
    evaluator.close()
    with pytest.raises(EvaluatorUnavailable, match="closed"):
        evaluator.evaluate(request(1, scenarios=SCENARIOS[:1]), never)


def test_closing_ends_requests_under_way() -> None:
    evaluator = InProcessEvaluator(1)
    threading.Timer(0.2, evaluator.close).start()
    with pytest.raises(EvaluatorUnavailable):
        evaluator.evaluate(slow(400, 0.1), never)


def test_no_processors_are_refused() -> None:
    with pytest.raises(ValueError, match="cpus"):
        InProcessEvaluator(0)
