"""Walks only what is not known: no design twice in an iteration, none that was walked before."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.iteration import Known
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, Evaluator
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.sim.outcome import Outcome, Status

_NEW: Final = -1

Keys = tuple[bytes | None, ...]

_log = logging.getLogger(__name__)


def evaluate_unknown(
    evaluator: Evaluator,
    store: Store | None,
    request: EvaluationRequest,
    keys: Sequence[bytes],
    should_stop: Callable[[], bool],
) -> tuple[tuple[Outcome, ...], Keys]:
    """Evaluate a request, but for what the store knows and what occurs in it twice.

    The outcomes are those of evaluating all of it, to the bit, because a walk's outcome depends on
    design and case alone. A store that does not answer knows nothing.
    """
    if store is None or not keys:
        return evaluator.evaluate(request, should_stop), tuple(keys)
    first = {key: index for index, key in reversed(list(enumerate(keys)))}
    known = _known(store, request, tuple(first))
    walked = sorted(index for key, index in first.items() if key not in known)
    if len(walked) == len(keys):
        return evaluator.evaluate(request, should_stop), tuple(keys)
    found: tuple[Outcome, ...] | None = None
    if walked:
        found = evaluator.evaluate(replace(request, designs=request.designs[walked]), should_stop)
    row_of = {index: row for row, index in enumerate(walked)}
    rows = np.array([row_of.get(first[key], _NEW) for key in keys])
    outcomes = []
    for number, case in enumerate(request.cases):
        objectives = np.empty((len(keys), len(case.objectives)))
        statuses = np.empty(len(keys), dtype=np.uint8)
        if found is not None:
            here = rows != _NEW
            objectives[here] = found[number].objectives[rows[here]]
            statuses[here] = found[number].statuses[rows[here]]
        for index in np.flatnonzero(rows == _NEW).tolist():
            earlier = known[keys[index]]
            objectives[index] = earlier.objectives[number]
            statuses[index] = earlier.statuses[number]
        outcomes.append(Outcome(objectives, statuses))
    new = set(walked)
    return tuple(outcomes), tuple(key if i in new else None for i, key in enumerate(keys))


def _known(store: Store, request: EvaluationRequest, keys: tuple[bytes, ...]) -> dict[bytes, Known]:
    """What the store has of these keys, as far as it is fit for use."""
    try:
        found = store.known(keys)
    except StoreUnavailable as error:
        _log.warning("job %s: all is walked anew: %s", request.job_id, error)
        return {}
    widths = {len(case.objectives) for case in request.cases}
    shapes = {(len(request.cases), width) for width in widths}
    return {
        key: known
        for key, known in found.items()
        if known.objectives.shape in shapes and _complete(known)
    }


def _complete(known: Known) -> bool:
    """Not so where a number was stored as null, as infinities are."""
    ok = known.statuses == Status.OK
    return bool(np.isfinite(known.objectives[ok]).all())
