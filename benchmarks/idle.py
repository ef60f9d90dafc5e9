"""Share of the workers' time that a job uses, and one slot against two.

    python -m benchmarks.idle [--evaluator in-process] [--precision double] [--slots 1 2]
                              [--particles 25] [--iterations 25] [--rounds 1] [--json]

The demo's job, run here and now with a database on disk, in threads or on Ray throughout. Time
counts from the first committed iteration to the last, so that start-up is no part of it. Shares are
of the wall time of all slots:

    walking      in kernels, whose lanes are used as "lanes" says
    preparing    in tasks, outside of kernels: tables, desired angles, objectives
    waiting      in evaluations, outside of tasks: sending, answers, the last worker's end
    between      from one evaluation to the next: judging, telling, asking, storing

Efficiency is the wall time of one slot over twice that of two.
"""

from __future__ import annotations

import argparse
import itertools
import json
import tempfile
import time
from dataclasses import asdict, dataclass
from unittest.mock import patch

from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import open_store, run_embedded
from gaitswarm.services.worker import EvaluatorKind
from gaitswarm.services.worker.dispatch import Dispatcher, Work
from gaitswarm.services.worker.in_process import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.services.worker.tasks import Answer
from gaitswarm.sim.kernel.walk import LaneUse, Precision


@dataclass(frozen=True)
class Use:
    """Shares of the wall time of all slots [1]; seconds and fitness of the job."""

    slots: int
    seconds: float
    tasks: float
    lane_use: float
    walking: float
    preparing: float
    waiting: float
    between: float
    fitness: float


def run(
    kind: EvaluatorKind, slots: int, particles: int, iterations: int, precision: Precision
) -> Use:
    """One job on a number of slots."""
    answers: list[Answer] = []
    commits: list[tuple[float, float, int]] = []
    complete = Dispatcher.complete

    def note_answer(self: Dispatcher, work: Work, answer: Answer) -> None:
        answers.append(answer)
        complete(self, work, answer)

    def note_commit(done: CompletedIteration, _state: JobState) -> None:
        commits.append((time.perf_counter(), done.evaluate_seconds, len(answers)))

    spec = JobSpec(
        optimizer=PsoSettings(particles=particles), iterations=iterations, precision=precision
    )
    with (
        tempfile.TemporaryDirectory() as folder,
        patch.object(Dispatcher, "complete", note_answer),
    ):
        store = open_store(f"sqlite:///{folder}/jobs.db")
        evaluator = RayEvaluator(cpus=slots) if kind == "ray" else InProcessEvaluator(slots)
        job, _ = JobService(store).submit(spec)
        ended = run_embedded(store, evaluator, job.id, on_commit=note_commit)
        evaluator.close()
        store.close()
    first, last = commits[0], commits[-1]
    counted = answers[first[2] : last[2]]
    wall = last[0] - first[0]
    evaluated = sum(seconds for _, seconds, _ in commits[1:])
    walking = sum(answer.kernel_time.seconds for answer in counted)
    in_tasks = sum(answer.seconds for answer in counted)
    assert ended.progress.best_fitness is not None
    return Use(
        slots=slots,
        seconds=wall,
        tasks=len(counted) / (len(commits) - 1),
        lane_use=sum((answer.kernel_time.lane_use for answer in counted), LaneUse()).share,
        walking=walking / (slots * wall),
        preparing=(in_tasks - walking) / (slots * wall),
        waiting=evaluated / wall - in_tasks / (slots * wall),
        between=1.0 - evaluated / wall,
        fitness=ended.progress.best_fitness,
    )


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--evaluator", choices=["ray", "in-process"], default="in-process")
    parser.add_argument("--precision", choices=["double", "single"], default="double")
    parser.add_argument("--particles", type=int, default=25)
    parser.add_argument("--iterations", type=int, default=25)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--slots", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    uses = [
        run(options.evaluator, slots, options.particles, options.iterations, options.precision)
        for _, slots in itertools.product(range(options.rounds), options.slots)
    ]
    if options.json:
        print(json.dumps([asdict(use) for use in uses], indent=2))
        return
    print("slots seconds tasks lanes  walking preparing waiting between  fitness")
    for use in uses:
        print(
            f"{use.slots:5d} {use.seconds:7.2f} {use.tasks:5.1f} {use.lane_use:5.1%}"
            f" {use.walking:8.1%} {use.preparing:9.1%} {use.waiting:7.1%} {use.between:7.1%}"
            f"  {use.fitness!r}"
        )
    quickest = {
        slots: min(use.seconds for use in uses if use.slots == slots) for slots in options.slots
    }
    for slots in options.slots[1:]:
        efficiency = quickest[options.slots[0]] * options.slots[0] / (quickest[slots] * slots)
        print(f"efficiency of {slots} slots: {efficiency:.1%}")


if __name__ == "__main__":
    main()
