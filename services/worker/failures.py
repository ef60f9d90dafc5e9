"""What a request fails with when its tasks cannot be run as they should."""

from __future__ import annotations

from collections.abc import Sequence

from gaitswarm.services.optimizer.errors import KilledWorker, ProvenanceChanged
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.cutting import Chunk
from gaitswarm.services.worker.tasks import Answer
from gaitswarm.sim.provenance import Provenance


def killed_workers(request: EvaluationRequest, chunk: Chunk, times: int) -> KilledWorker:
    """The error for a task that worker after worker died of.

    Args:
        request: What was asked.
        chunk: The part of it that the task was.
        times: How many died.

    Returns:
        The error, which names designs and cases.
    """
    ranges: dict[tuple[int, int], list[str]] = {}
    for part in chunk.parts:
        ranges.setdefault((part.start, part.stop), []).append(repr(request.cases[part.case].name))
    walks = "; ".join(
        f"{_designs(start, stop)} of the iteration in {', '.join(names)}"
        for (start, stop), names in ranges.items()
    )
    return KilledWorker(
        f"{times} worker processes died, one after the other, of the same task: {walks}. If its"
        " walks are not at fault, the workers may lack memory; resume the job to try again"
    )


def _designs(start: int, stop: int) -> str:
    return f"design {start}" if stop - start == 1 else f"designs {start} to {stop - 1}"


def misshapen(shapes: Sequence[tuple[int, ...]], wanted: Sequence[tuple[int, int]]) -> RuntimeError:
    """The error for an answer that does not fit its task.

    Args:
        shapes: Of the objectives in the answer, by part.
        wanted: Of those that the task asks for.

    Returns:
        The error.
    """
    return RuntimeError(
        f"a worker sent objectives of shapes {shapes} for a chunk of {wanted};"
        " it runs other code than this process"
    )


def unlike(expected: Provenance, answer: Answer) -> ProvenanceChanged:
    """The error for an answer that comes from other code, libraries or backend.

    Args:
        expected: By the request.
        answer: As the worker gave it.

    Returns:
        The error, which names the worker and what differs.
    """
    why = "; ".join(expected.changes(answer.provenance))
    return ProvenanceChanged(
        f"a worker on {answer.host} does not compute what this job's numbers depend on: {why}. Its"
        " walks were not used; give all workers the same gaitswarm and a C compiler, and resume"
        " the job"
    )
