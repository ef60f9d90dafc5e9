"""Runs one stored job to its end, as `gaitswarm optimize` does; a process made to be killed."""

from __future__ import annotations

from multiprocessing.connection import Connection

from services.runtime import open_evaluator, open_store, run_embedded
from services.worker.ray_evaluator import RayEvaluator


def main(url: str, job_id: str, kind: str, told: Connection) -> None:
    """Evaluate on `kind`; the state of the job's search is sent after every commit."""
    store = open_store(url)
    # On Ray from the first walk on, however short the job is.
    evaluator = RayEvaluator(cpus=2) if kind == "ray" else open_evaluator("in-process", cpus=2)
    run_embedded(store, evaluator, job_id, on_commit=lambda _, state: told.send(str(state)))
    evaluator.close()
    store.close()
