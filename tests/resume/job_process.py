"""Runs one stored job to its end, as `gaitswarm optimize` does; a process made to be killed."""

from __future__ import annotations

import sys

from services.runtime import open_evaluator, open_store, run_embedded
from services.worker.ray_evaluator import RayEvaluator


def main(url: str, job_id: str, kind: str) -> None:
    store = open_store(url)
    # On Ray from the first walk on, however short the job is.
    evaluator = RayEvaluator(cpus=2) if kind == "ray" else open_evaluator("in-process", cpus=2)

    def tell(done: object, state: object) -> None:
        sys.stdout.write(f"{state}\n")
        sys.stdout.flush()

    run_embedded(store, evaluator, job_id, on_commit=tell)
    evaluator.close()
    store.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
