"""A long history: read row by row and as columns, judged one by one and all at once.

    python -m benchmarks.history [--store jobs.db] [--iterations 4000] [--repeats 5] [--json]

Without a store of `benchmarks.large_store` one is made, which takes longest. Variants take turns in
this thread; the least of their times counts, for anything slower is the machine's other work.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import TypeAdapter

from benchmarks.large_store import fill
from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.services.optimizer.analysis.distribution import distribution
from gaitswarm.services.optimizer.analysis.history import HistoryCache
from gaitswarm.services.optimizer.analysis.preferences import rank
from gaitswarm.services.optimizer.jobs.constraints import Constraints
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job, JobOrder
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, judge
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store

ROW_BY_ROW = 100
"""Iterations that the slow variants read and judge; their times are scaled to the whole."""


def variants(store: Store, job: Job) -> dict[str, tuple[Callable[[], object], float]]:
    """What to time, and by how much a time is to be scaled."""
    cache = HistoryCache(store)
    columns = cache.columns(job)
    particles = job.spec.optimizer.particles
    some = min(ROW_BY_ROW, job.progress.iterations)
    part = columns.rows(slice(some * particles))
    scale = job.progress.iterations / some
    space, preference = job.spec.design_space(), PREFERENCES["B"]
    by_other = job.spec.model_copy(update={"preference": preference})
    limits = [{"quantity": "*", "relative_to": "published:A", "max": 2.65}, "speed>=0.01"]
    constrained = JobService(store).under(
        job.spec, constraints=TypeAdapter(Constraints).validate_python(limits)
    )

    def what_if() -> DatabaseJobs:
        """Jobs with nothing in memory; only references stay simulated."""
        return DatabaseJobs(JobService(store), "")

    return {
        "read row by row": (lambda: store.evaluations_between(job.id, 0, some), scale),
        "read as columns": (lambda: HistoryCache(store).columns(job), 1.0),
        "read again": (lambda: cache.columns(job), 1.0),
        "judge one by one": (lambda: judge(part.objectives, part.failed, preference), scale),
        "rank all at once": (lambda: rank(columns, by_other, top=20), 1.0),
        "rank under constraints": (lambda: rank(columns, constrained, top=20), 1.0),
        "read and rank so": (lambda: what_if().ranking(job.id, constraints=limits), 1.0),
        "read and find front so": (lambda: what_if().front(job.id, constraints=limits), 1.0),
        "distribution": (lambda: distribution(columns, space), 1.0),
        "list 200 jobs": (lambda: store.jobs(limit=200), 1.0),
        "list by name, search": (
            lambda: store.jobs(limit=50, search="short", order=JobOrder.NAME),
            1.0,
        ),
    }


def measure(store: Store, repeats: int) -> dict[str, object]:
    """Seconds by variant, of the longest job in a store."""
    job = longest(store)
    todo = variants(store, job)
    seconds = dict.fromkeys(todo, float("inf"))
    for _ in range(repeats):
        for name, (run, scale) in todo.items():
            begun = time.perf_counter()
            run()
            seconds[name] = min(seconds[name], scale * (time.perf_counter() - begun))
    return {
        "evaluations": job.progress.evaluations,
        "mebibytes": nbytes(HistoryCache(store).columns(job)) / 2**20,
        "seconds": seconds,
    }


def longest(store: Store) -> Job:
    """The newest job of `benchmarks.large_store`."""
    (job,) = store.jobs(search="long", limit=1).items
    return job


def nbytes(columns: EvaluationColumns) -> int:
    """Memory of the columns."""
    return sum(array.nbytes for array in columns.arrays)


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--store")
    parser.add_argument("--jobs", type=int, default=1000)
    parser.add_argument("--iterations", type=int, default=4000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        store = open_store(options.store or str(Path(folder, "jobs.db")))
        if options.store is None:
            fill(store, jobs=options.jobs, iterations=options.iterations)
        found = measure(store, options.repeats)
        store.close()
    if options.json:
        print(json.dumps(found, indent=2))
        return
    print(f"{found['evaluations']} evaluations, {found['mebibytes']:.1f} MiB as columns")
    seconds = found["seconds"]
    assert isinstance(seconds, dict)
    for name, value in seconds.items():
        print(f"{name:24} {1e3 * value:10.2f} ms")


if __name__ == "__main__":
    main()
