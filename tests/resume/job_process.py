"""Runs one stored job to its end, as `gaitswarm optimize` does; a process made to be killed."""

from __future__ import annotations

import sys
from typing import cast

from services.runtime import EvaluatorKind, open_evaluator, open_store, run_embedded


def main(url: str, job_id: str, kind: str) -> None:
    store = open_store(url)
    evaluator = open_evaluator(cast("EvaluatorKind", kind), cpus=2)

    def tell(done: object, state: object) -> None:
        sys.stdout.write(f"{state}\n")
        sys.stdout.flush()

    run_embedded(store, evaluator, job_id, on_commit=tell)
    evaluator.close()
    store.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
