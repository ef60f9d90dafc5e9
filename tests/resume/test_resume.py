"""A job killed at any instant equals one never killed; concurrent jobs equal single ones"""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.services.optimizer.analysis.verification import check_history
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.search.hype import HypeSettings
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, open_store, run_embedded
from tests.examples.forked import PROCESSES
from tests.examples.jobs import history
from tests.examples.preferences import DOCUMENT, small
from tests.examples.walks import SHORT_WALK, UPHILL_WALK
from tests.resume import job_process

pytestmark = pytest.mark.slow

SPEC = JobSpec.model_validate(
    {
        "controller": "fuzzy-pi",
        "scenarios": [
            SHORT_WALK | {"name": "level", "cycles": 2},
            UPHILL_WALK,
        ],
        "optimizer": {"name": "pso", "particles": 5},
        "iterations": 10,
        "seed": 4,
    }
)


@pytest.fixture(scope="module")
def evaluator() -> Iterator[Evaluator]:
    opened = open_evaluator("in-process", cpus=2)
    yield opened
    opened.close()


@pytest.fixture
def url(database: Path) -> str:
    return f"sqlite:///{database}"


def queue(store: Store, spec: Spec = SPEC) -> str:
    job, _ = store.create_job(spec)
    return job.id


def run_alone(store: Store, evaluator: Evaluator, spec: Spec = SPEC) -> str:
    job_id = queue(store, spec)
    assert run_embedded(store, evaluator, job_id).state is JobState.SUCCEEDED
    return job_id


Walked = tuple[list[Any], tuple[bytes, float] | None, list[str | None]]
"""All iterations of a job, the reevaluation of its best design, and the chained digests."""


def walked(store: Store, job_id: str) -> Walked:
    check = check_history(store, store.job(job_id))
    assert check.problem == ""
    return history(store, job_id), best_in_double(store, job_id), digests(store, job_id)


def digests(store: Store, job_id: str) -> list[str | None]:
    return [iteration.digest for iteration in store.iterations(job_id).items]


@pytest.fixture(scope="module")
def alone(evaluator: Evaluator, tmp_path_factory: pytest.TempPathFactory) -> Walked:
    """What `SPEC` comes to, run alone once for all tests."""
    with closing(open_store(f"sqlite:///{tmp_path_factory.mktemp('alone')}/jobs.db")) as store:
        return walked(store, run_alone(store, evaluator))


def best_in_double(store: Store, job_id: str) -> tuple[bytes, float] | None:
    """Reevaluation of the best design; None for a search in double precision."""
    best = store.best(job_id)
    assert best is not None
    reevaluation = best.reevaluation
    assert (reevaluation is None) == (store.job(job_id).spec.precision == "double")
    return (
        None if reevaluation is None else (reevaluation.objectives.tobytes(), reevaluation.fitness)
    )


class Life:
    """A process that runs a job."""

    def __init__(self, url: str, job_id: str, kind: str = "in-process") -> None:
        self._states, sender = PROCESSES.Pipe(duplex=False)
        self._process = PROCESSES.Process(target=job_process.main, args=(url, job_id, kind, sender))
        self._process.start()
        sender.close()

    def wait_for_a_commit(self) -> None:
        """Until it has committed an iteration, so that start-up is not all that is killed."""
        self._states.recv()

    def kill(self) -> None:
        self._process.kill()
        self._end()

    def code(self) -> int | None:
        """Its exit code, once it has ended by itself."""
        with suppress(EOFError):
            while True:
                self._states.recv()
        return self._end()

    def _end(self) -> int | None:
        self._process.join(120.0)
        code = self._process.exitcode
        self._process.close()
        self._states.close()
        return code


@pytest.mark.variants("double")
@pytest.mark.parametrize(
    "given",
    [
        {"precision": "double"},
        {
            "precision": "single",
            "optimizer": HypeSettings(particles=5, population=8, offspring=8),
        },
    ],
    ids=["double", "single-multi-objective"],
)
def test_resumed_job_equals_one_never_killed(
    store: Store, url: str, evaluator: Evaluator, given: dict[str, Any]
) -> None:
    spec = SPEC.model_copy(update=given)
    begun = time.monotonic()
    whole = run_alone(store, evaluator, spec)
    one_iteration = (time.monotonic() - begun) / SPEC.iterations

    job_id = queue(store, spec)
    chance = random.Random(7)
    progress: list[int] = []
    while len(progress) < 2:
        life = Life(url, job_id)
        life.wait_for_a_commit()
        time.sleep(chance.uniform(0.0, 1.5 * one_iteration))
        life.kill()
        progress.append(store.job(job_id).progress.iterations)

    assert Life(url, job_id).code() == 0
    assert store.job(job_id).state is JobState.SUCCEEDED
    assert 1 <= progress[0] < progress[1] <= SPEC.iterations
    assert walked(store, job_id) == walked(store, whole)


ROUGH = SHORT_WALK | {"terrain": {"kind": "rough", "amplitude": 0.02}}
IN_WORLDS = {"count": 3, "ranges": ["world_seed"], "aggregate": "cvar"}


@pytest.mark.parametrize(
    "spec",
    [
        small(iterations=2, worlds=1, tuning=DOCUMENT["tuning"] | {"iterations": 1}),
        JobSpec.model_validate(
            SPEC.model_dump() | {"scenarios": [ROUGH], "worlds": IN_WORLDS, "iterations": 4}
        ).with_gait_searched(),
    ],
    ids=["preferences", "rough ground"],
)
def test_a_job_stopped_in_its_midst_equals_one_never_stopped(
    store: Store, evaluator: Evaluator, spec: Spec
) -> None:
    whole, stopped = run_alone(store, evaluator, spec), queue(store, spec)
    stop = threading.Event()
    run_embedded(store, evaluator, stopped, stop=stop, on_iteration=lambda _: stop.set())
    assert 1 <= store.job(stopped).progress.iterations < store.job(whole).progress.iterations
    assert run_embedded(store, evaluator, stopped).state is JobState.SUCCEEDED
    assert walked(store, stopped) == walked(store, whole)


@pytest.mark.thorough(
    "test_resumed_job_equals_one_never_killed, for all methods",
)
def test_a_job_of_any_method_killed_in_its_middle_equals_one_never_killed(
    store: Store, url: str, evaluator: Evaluator
) -> None:
    jobs: dict[str, tuple[str, str]] = {}
    middles: dict[str, int] = {}
    for name, method in METHODS.built_in.items():
        if method.missing:
            continue
        search = method.settings.model_validate({"name": name, "particles": 5})
        shorter = {"scenarios": SPEC.scenarios[:1], "optimizer": search, "iterations": 6}
        spec = SPEC.model_copy(update=shorter)
        jobs[name] = run_alone(store, evaluator, spec), queue(store, spec)
        whole, killed = jobs[name]
        middles[killed] = store.job(whole).progress.iterations // 2
    halted, sender = PROCESSES.Pipe(duplex=False)
    life = PROCESSES.Process(target=job_process.run_to_the_middle, args=(url, middles, sender))
    life.start()
    sender.close()
    assert {halted.recv() for _ in middles} == set(middles)
    life.kill()
    life.join()
    halted.close()

    for name, (whole, killed) in jobs.items():
        assert store.job(killed).progress.iterations == middles[killed], name
        assert run_embedded(store, evaluator, killed).state is JobState.SUCCEEDED
        assert walked(store, killed) == walked(store, whole), name


@pytest.mark.thorough(
    "test_a_job_that_is_extended_twice_has_the_same_bits_however_often_it_is_killed"
)
def test_a_job_that_is_extended_and_killed_equals_one_that_is_only_extended(
    store: Store, url: str, evaluator: Evaluator
) -> None:
    whole, killed = (run_alone(store, evaluator) for _ in range(2))
    for job_id in (whole, killed):
        store.extend(job_id, SPEC.iterations + 3)
    life = Life(url, killed)
    life.wait_for_a_commit()
    life.kill()
    assert store.job(killed).progress.iterations > SPEC.iterations

    assert Life(url, killed).code() == 0
    assert run_embedded(store, evaluator, whole).state is JobState.SUCCEEDED
    assert store.job(killed).progress.iterations == SPEC.iterations + 3
    assert history(store, killed) == history(store, whole)
    assert digests(store, killed) == digests(store, whole)


@pytest.mark.thorough(
    "test_resumed_job_equals_one_never_killed",
    "test_results_are_those_of_one_batch_in_index_order_to_the_bit",
)
def test_a_job_resumed_on_ray_equals_one_run_in_threads(
    store: Store, url: str, alone: Walked
) -> None:
    job_id = queue(store)
    killed = Life(url, job_id)
    killed.wait_for_a_commit()
    killed.kill()
    assert Life(url, job_id, "ray").code() == 0
    assert walked(store, job_id) == alone


@pytest.mark.thorough("test_a_runner_runs_jobs_side_by_side_to_the_bits_of_jobs_run_alone")
def test_two_jobs_at_once_equal_the_same_jobs_run_alone(
    store: Store, evaluator: Evaluator, alone: Walked
) -> None:
    specs = [SPEC, SPEC.model_copy(update={"seed": 5, "iterations": 6})]
    other = run_alone(store, evaluator, specs[1])
    apart = [alone, walked(store, other)]
    together = [queue(store, spec) for spec in specs]
    runner = Runner(store, evaluator, concurrency=2, poll_seconds=0.05)
    runner.start()
    deadline = time.monotonic() + 120.0
    both_running = False
    while any(not store.job(job_id).state.terminal for job_id in together):
        states = {store.job(job_id).state for job_id in together}
        both_running = both_running or states == {JobState.RUNNING}
        assert time.monotonic() < deadline
        time.sleep(0.05)
    runner.stop()
    assert both_running
    assert [walked(store, job_id) for job_id in together] == apart


def test_a_job_stopped_and_resumed_repeatedly_equals_one_never_stopped(
    store: Store, evaluator: Evaluator, alone: Walked
) -> None:
    job_id = queue(store)
    lives = 0
    while not store.job(job_id).state.terminal:
        stop = threading.Event()
        timer = threading.Timer(0.05 + 0.11 * lives, stop.set)
        timer.start()
        run_embedded(store, evaluator, job_id, stop=stop)
        timer.cancel()
        lives += 1
    assert lives > 2
    assert walked(store, job_id) == alone


def test_a_partly_cached_job_equals_one_that_simulates_all(
    store: Store, evaluator: Evaluator
) -> None:
    shorter = SPEC.model_copy(update={"iterations": 1})
    earlier = store.evaluations(run_alone(store, evaluator, shorter), 0)
    start = tuple(SPEC.design_space().shown(row.design.tolist()) for row in earlier[1:4])
    started = SPEC.model_copy(update={"seed": 5, "iterations": 3, "start": start})
    known, walked = queue(store, started), queue(store, started)
    saved = run_embedded(store, evaluator, known, cache=True).progress.evaluations_saved
    assert saved == len(start)
    assert run_embedded(store, evaluator, walked).progress.evaluations_saved == 0
    assert history(store, known) == history(store, walked)
    assert digests(store, known) == digests(store, walked)
