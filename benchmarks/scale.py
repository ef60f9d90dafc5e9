"""What a task costs its evaluator and Ray, and an iteration its coordinator and store.

    python -m benchmarks.scale [--slots 10 1000 10000] [--nodes 4] [--cpus 4] [--sleep 0] [--json]

A cluster of raylets runs on this machine. Its tasks sleep, so that it can have more CPUs than the
machine. For each number of slots, the evaluator is made to believe that the cluster has so many: it
keeps twice as many tasks submitted, of which the cluster's CPUs run a few. Processor time of this
process, of the raylets and of the head is counted per task. A process that spends c seconds on each
task keeps 1/c cores busy with tasks of one second.

Iterations are those of a job whose designs cost nothing, in a database on disk.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.faults.supervisor import descendants, title
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.runtime import run_embedded
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.sim.outcome import OBJECTIVES, Outcome
from gaitswarm.sim.provenance import provenance_of
from tests.worker import cluster_host
from tests.worker.cluster_host import Process

TASKS_PER_SLOT = 3


@dataclass(frozen=True)
class Sleep:
    """A case whose every design is a task that sleeps."""

    name: str
    seconds: float
    duration = 1000.0
    robots = ()
    precision = "double"
    objectives = OBJECTIVES

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        time.sleep(self.seconds)
        return Outcome(np.ones((len(designs), len(OBJECTIVES))), np.zeros(len(designs), np.uint8))

    def run_until(self, designs: NDArray[np.float64], _stop: Callable[[], bool]) -> Outcome:
        return self.run(designs)


@dataclass(frozen=True)
class Tasks:
    """Costs per task. Times are of processors [ms], but for wall."""

    slots: int
    tasks: int
    wall_ms: float
    evaluator_ms: float
    raylets_ms: float
    head_ms: float
    cores_of_one_second_tasks: int


@dataclass(frozen=True)
class Iterations:
    """Processor time of an iteration without its simulations [ms], and what it stores."""

    designs: int
    iteration_ms: float
    database_kib: float


def processor_seconds(*names: str) -> float:
    """Of the cluster's processes whose titles contain one of some names."""
    ticks = 0
    for pid in descendants(os.getpid()):
        if any(name in title(pid) for name in names):
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


@contextmanager
def cluster(nodes: int, cpus: int) -> Iterator[RayEvaluator]:
    """A head and so many nodes of so many CPUs, in a process of its own."""
    folder = Path(tempfile.mkdtemp(prefix="gsc-"))
    os.environ.update(cluster_host.ray_environment(folder))
    with Process() as host:
        address = host.run(cluster_host.start)
        for _ in range(nodes):
            host.run(cluster_host.add, cpus)
        evaluator = RayEvaluator(address)
        evaluator.wait_until_open(lambda: False)
        yield evaluator
        evaluator.close()
        host.run(cluster_host.stop)
    shutil.rmtree(folder, ignore_errors=True)


def run_tasks(evaluator: RayEvaluator, slots: int, seconds: float) -> Tasks:
    """Run three tasks for each slot."""
    connection: Any = vars(evaluator)["_connection"]
    vars(connection).update(_count=lambda _session: None, slots=slots)
    cases: Any = tuple(Sleep(f"sleep-{k}", seconds) for k in range(6))
    designs = -(-TASKS_PER_SLOT * slots // len(cases))
    request = EvaluationRequest(
        f"{slots} {seconds}", cases, np.zeros((designs, 2)), provenance_of()
    )
    before = processor_seconds("raylet/raylet"), processor_seconds("gcs_server")
    begun, own = time.perf_counter(), time.process_time()
    evaluator.evaluate(request, lambda: False)
    wall, own = time.perf_counter() - begun, time.process_time() - own
    after = processor_seconds("raylet/raylet"), processor_seconds("gcs_server")
    tasks = designs * len(cases)
    return Tasks(
        slots,
        tasks,
        1e3 * wall / tasks,
        1e3 * own / tasks,
        1e3 * (after[0] - before[0]) / tasks,
        1e3 * (after[1] - before[1]) / tasks,
        round(tasks / own),
    )


class Free:
    """An evaluator of designs that cost nothing."""

    slots = 1

    def __init__(self) -> None:
        self.seconds = 0.0

    def evaluate(
        self, request: EvaluationRequest, _stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        begun = time.perf_counter()
        count = len(request.designs)
        values = 1.0 + request.designs.sum(axis=1, keepdims=True) ** 2
        results = np.tile(values, len(request.cases[0].objectives))
        outcome = Outcome(results, np.zeros(count, np.uint8))
        self.seconds += time.perf_counter() - begun
        return (outcome,) * len(request.cases)

    def close(self) -> None: ...


def run_iterations(designs: int, iterations: int = 5) -> Iterations:
    """Run a job of six scenarios in a database on disk."""
    with tempfile.TemporaryDirectory() as folder:
        database = Path(folder, "jobs.db")
        store = open_store(str(database))
        spec = JobSpec.model_validate(
            {"optimizer": {"name": "pso", "particles": designs}, "iterations": iterations}
        )
        job, _ = store.create_job(spec)
        commits: list[float] = []
        run_embedded(
            store, Free(), job.id, on_iteration=lambda _: commits.append(time.process_time())
        )
        store.close()
        size = sum(file.stat().st_size for file in Path(folder).iterdir())
    spent = (commits[-1] - commits[0]) / (len(commits) - 1)
    return Iterations(designs, 1e3 * spent, size / 1024 / iterations)


def main() -> None:
    """Print tables, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--slots", type=int, nargs="+", default=[10, 1000, 10_000])
    parser.add_argument("--designs", type=int, nargs="+", default=[25, 1000, 10_000])
    parser.add_argument("--nodes", type=int, default=4)
    parser.add_argument("--cpus", type=int, default=4, help="of each node")
    parser.add_argument("--sleep", type=float, default=0.0, help="seconds that a task takes")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    iterations = [run_iterations(designs) for designs in options.designs]
    with cluster(options.nodes, options.cpus) as evaluator:
        run_tasks(evaluator, options.nodes * options.cpus, 0.1)  # its processes start
        tasks = [run_tasks(evaluator, slots, options.sleep) for slots in options.slots]
    if options.json:
        print(
            json.dumps(
                {"tasks": list(map(asdict, tasks)), "iterations": list(map(asdict, iterations))}
            )
        )
        return
    for rows in (tasks, iterations):
        names = list(asdict(rows[0]))
        print("  ".join(names))
        for row in rows:
            cells = asdict(row)
            print("  ".join(f"{cells[name]:{len(name)}.5g}" for name in names))


if __name__ == "__main__":
    main()
