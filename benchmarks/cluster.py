"""A job on three raylets of which one is lost again and again: the same bits as alone?

    python -m benchmarks.cluster [--iterations 150] [--every 20] [--json]

Ray's head and three nodes with a CPU each run on this machine. Every so many seconds all processes
of one node are killed, from time to time those of all nodes, and as many new ones are started. Then
the same job is run in threads of one process, and every stored evaluation is compared to the bit.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from tests.examples.jobs import history
from tests.worker import cluster_host
from tests.worker.cluster_host import Process

NODES = 3


def run_job(database: str, address: str, job_id: str) -> dict[str, Any]:
    """In a process of its own: the job on the cluster, from its claim to its end."""
    store = open_store(database)
    evaluator = open_evaluator("ray", address=address)
    runner = Runner(store, evaluator, concurrency=1)
    runner.start()
    slots: dict[int, float] = {}
    begun = seen = time.monotonic()
    while not store.job(job_id).state.terminal:
        time.sleep(0.2)
        now = time.monotonic()
        slots[evaluator.slots] = slots.get(evaluator.slots, 0.0) + now - seen
        seen = now
    job = store.job(job_id)
    runner.stop()
    evaluator.close()
    store.close()
    return {
        "state": str(job.state),
        "error": job.error,
        "iterations": job.progress.iterations,
        "evaluations": job.progress.evaluations,
        "seconds": time.monotonic() - begun,
        "seconds_by_slots": {str(n): round(slots[n], 1) for n in sorted(slots)},
    }


def lose_nodes(host: Process, every: float, done: threading.Event) -> dict[str, int]:
    """Until the job has ended; how many nodes were lost, and how often all of them."""
    lost, all_lost = 0, 0
    while not done.wait(every):
        nodes = host.run(cluster_host.nodes)
        doomed = nodes if lost and (all_lost + 1) * 5 <= lost else nodes[:1]
        for node in doomed:
            host.run(cluster_host.lose, node)
        lost += len(doomed)
        all_lost += len(doomed) == len(nodes)
        for _ in doomed:
            host.run(cluster_host.add)
    return {"nodes_lost": lost, "times_all_lost": all_lost}


def campaign(iterations: int, every: float, folder: Path) -> dict[str, Any]:
    """The job on the cluster, then alone; what came of it."""
    os.environ.update(cluster_host.ray_environment(folder))
    store = open_store(str(folder / "jobs.db"))
    spec = JobSpec.model_validate({"iterations": iterations, "seed": 1, "preference": "A"})
    there, _ = store.create_job(spec)
    done = threading.Event()
    losses: dict[str, int] = {}
    with Process() as host, Process() as runner:
        address = host.run(cluster_host.start)
        for _ in range(NODES):
            host.run(cluster_host.add)
        walked = runner.begin(run_job, str(folder / "jobs.db"), address, there.id)
        thread = threading.Thread(target=lambda: losses.update(lose_nodes(host, every, done)))
        thread.start()
        try:
            came = walked()
        finally:
            done.set()
            thread.join()
            host.run(cluster_host.stop)
    here, _ = store.create_job(spec)
    evaluator = open_evaluator("in-process")
    run_embedded(store, evaluator, here.id)
    evaluator.close()
    on_cluster, alone = history(store, there.id), history(store, here.id)
    store.close()
    differing = sum(a != b for a, b in zip(on_cluster, alone, strict=False))
    return (
        came
        | losses
        | {
            "evaluations_compared": len(alone),
            "evaluations_lost": len(alone) - len(on_cluster),
            "evaluations_that_differ": differing,
        }
    )


def main() -> None:
    """Print what came of it; exit with 1 if an evaluation was lost or differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--iterations", type=int, default=150)
    parser.add_argument("--every", type=float, default=20.0, help="seconds between losses")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="gsc-"))
    try:
        found = campaign(options.iterations, options.every, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    if options.json:
        print(json.dumps(found, indent=2))
    else:
        for name, value in found.items():
            print(f"{name.replace('_', ' '):24} {value}")
    if found["evaluations_lost"] or found["evaluations_that_differ"]:
        sys.exit(1)


if __name__ == "__main__":
    main()
