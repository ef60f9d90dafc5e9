"""Profile of a job of chapter 4 on all cores: physics, control, tables, workers, search, store.

python -m benchmarks.profile [--evaluator ray|in-process] [--precision double|single] [--json]
"""

from __future__ import annotations

import argparse
import json
import tempfile
import threading
import time
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Final, get_args

from gaitswarm.services.optimizer.jobs.iteration import Iteration
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.evaluator import TaskReport
from gaitswarm.services.optimizer.run.runner import run_embedded
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.store import Observer, open_store
from gaitswarm.services.runtime import ObservedEvaluator
from gaitswarm.services.worker import EvaluatorKind
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.sim.assembly import kernel_of
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.walk import LaneUse
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot

_SHARES: Final = {
    "physics": "kernel: physics steps",
    "control": "kernel: control ticks",
    "tables": "tasks: fuzzy tables",
    "preparation": "tasks: desired angles, parameters, objectives",
    "workers": "transfer of tasks and results, waiting for the last worker",
    "search": "judging designs and asking for the next",
    "store": "store",
}


@dataclass(frozen=True, slots=True)
class JobProfile:
    """Distribution of a job's time from its first committed iteration to its last."""

    evaluator: EvaluatorKind
    slots: int
    precision: Precision
    walks: int  # designs times scenarios
    seconds: float  # wall time [s]
    walks_per_second: float  # of all slots together
    lane_use: float  # used share of the kernel's lanes [1]
    shares: dict[str, float]  # of the slots' time [1]; the sum is 1


@dataclass(frozen=True, slots=True)
class _Reading:
    """All clocks at a commit [s]. evaluated, stored: since the job's start."""

    at: float
    evaluated: float
    stored: float
    tasks: _TaskTotals


@dataclass(frozen=True, slots=True)
class _TaskTotals:
    """Times of tasks in their workers, summed up [s]."""

    seconds: float = 0.0
    kernel_seconds: float = 0.0
    table_seconds: float = 0.0
    lane_use: LaneUse = field(default_factory=LaneUse)

    def plus(self, report: TaskReport) -> _TaskTotals:
        return _TaskTotals(
            self.seconds + report.compute_seconds,
            self.kernel_seconds + report.kernel_time.seconds,
            self.table_seconds + report.table_seconds,
            self.lane_use + report.kernel_time.lane_use,
        )

    def since(self, earlier: _TaskTotals) -> _TaskTotals:
        return _TaskTotals(
            self.seconds - earlier.seconds,
            self.kernel_seconds - earlier.kernel_seconds,
            self.table_seconds - earlier.table_seconds,
            self.lane_use - earlier.lane_use,
        )


def profile_job(
    *,
    evaluator: EvaluatorKind = "ray",
    precision: Precision = "double",
    particles: int = 25,
    iterations: int = 25,
    cpus: int | None = None,
) -> JobProfile:
    """Run the job of chapter 4 in a temporary database and profile it.

    Workers time their tasks, with the time in kernels and tables; this process times evaluations
    and the store. The kernel times a sample of its rounds, with their control ticks.
    """
    kernel_of(load_robot(DEFAULT_ROBOT), "native", precision=precision)
    spec = JobSpec(
        optimizer=PsoSettings(particles=particles),
        iterations=iterations,
        precision=precision,
        seed=1,
    )
    workers = _open(evaluator, cpus)
    timed_tasks = _TaskTotals()

    def note(report: TaskReport) -> None:
        nonlocal timed_tasks
        timed_tasks = timed_tasks.plus(report)

    observed = ObservedEvaluator(workers, lambda _: nullcontext(note))
    readings: list[_Reading] = []
    with tempfile.TemporaryDirectory() as folder:
        store = open_store(f"sqlite:///{Path(folder, 'jobs.db')}")
        timed = _StoreTime()
        store.observers.append(timed)

        def read(done: Iteration) -> None:
            before = readings[-1].evaluated if readings else 0.0
            evaluated = before + done.evaluate_seconds
            readings.append(_Reading(time.perf_counter(), evaluated, timed.seconds, timed_tasks))

        try:
            job, _ = store.create_job(spec)
            run_embedded(store, observed, job.id, on_iteration=read)
            slots = workers.slots
        finally:
            workers.close()
            store.close()
    walks = particles * len(spec.cases({})) * (len(readings) - 1)
    return _profile(evaluator, precision, slots, walks, readings[0], readings[-1])


def _profile(
    evaluator: EvaluatorKind,
    precision: Precision,
    slots: int,
    walks: int,
    first: _Reading,
    last: _Reading,
) -> JobProfile:
    wall = last.at - first.at
    evaluated, stored = last.evaluated - first.evaluated, last.stored - first.stored
    tasks = last.tasks.since(first.tasks)
    control = tasks.lane_use.control_share * tasks.kernel_seconds
    seconds = {
        "physics": tasks.kernel_seconds - control,
        "control": control,
        "tables": tasks.table_seconds,
        "preparation": tasks.seconds - tasks.kernel_seconds - tasks.table_seconds,
        "workers": slots * evaluated - tasks.seconds,
        "search": slots * (wall - evaluated - stored),
        "store": slots * stored,
    }
    return JobProfile(
        evaluator=evaluator,
        slots=slots,
        precision=precision,
        walks=walks,
        seconds=wall,
        walks_per_second=walks / wall,
        lane_use=tasks.lane_use.share,
        shares={name: spent / (slots * wall) for name, spent in seconds.items()},
    )


def _open(evaluator: EvaluatorKind, cpus: int | None) -> InProcessEvaluator | RayEvaluator:
    if evaluator != "ray":
        return InProcessEvaluator(cpus)
    cluster = RayEvaluator(cpus=cpus)
    cluster.wait_until_open(lambda: False)
    return cluster


class _StoreTime(Observer):
    """Time of transactions in the thread that created it, without the heartbeat's."""

    def __init__(self) -> None:
        self._thread = threading.get_ident()
        self.seconds = 0.0

    def transaction(self, operation: str, seconds: float, error: BaseException | None) -> None:  # noqa: ARG002
        if threading.get_ident() == self._thread:
            self.seconds += seconds


def main() -> None:
    """Print a profile, as text or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--evaluator", choices=("ray", "in-process"), default="ray")
    parser.add_argument("--precision", choices=get_args(Precision), default="double")
    parser.add_argument("--particles", type=int, default=25)
    parser.add_argument("--iterations", type=int, default=25)
    parser.add_argument("--cpus", type=int)
    parser.add_argument("--json", action="store_true")
    options = vars(parser.parse_args())
    as_json = options.pop("json")
    profile = profile_job(**options)
    if as_json:
        print(json.dumps(asdict(profile)))
        return
    print(
        f"{profile.walks} simulations of a chapter-4 job, {profile.slots} slots"
        f" ({profile.evaluator}), {profile.precision} precision: {profile.seconds:.2f} s,"
        f" {profile.walks_per_second:.0f} simulations/s, {profile.lane_use:.1%} of the kernel's"
        " lanes used\nshares of the slots' time:"
    )
    for name, share in profile.shares.items():
        print(f"  {name:12} {share:6.1%}  {_SHARES[name]}")


if __name__ == "__main__":
    main()
