"""Replay of stored evaluations, compared bit by bit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.sim.identification.recorded_walk import Recordings
from gaitswarm.sim.mujoco.engines import ENGINE
from gaitswarm.sim.outcome import Outcome, Status
from gaitswarm.sim.provenance import provenance_of
from gaitswarm.views.verification import DifferenceView

Table = tuple[AnySpec, EvaluationColumns]
"""Evaluations with the spec that they belong to."""


def why_no_replay(spec: AnySpec) -> tuple[bool | None, str] | None:
    """Explain why evaluations of a job cannot be replayed here; None if they can."""
    if isinstance(spec, JobSpec) and spec.case is not None:
        return (
            None,
            f"designs were evaluated by the plug-in {spec.case.name}, which may give other bits",
        )
    if provenance_of(*spec.robot_sources, precision=spec.precision).backend == "reference":
        return False, (
            "there is no C compiler here: the interpreter gives other bits, and takes some hundred"
            " times as long"
        )
    return None


def has_same_bits_anywhere(spec: AnySpec, columns: EvaluationColumns) -> NDArray[np.bool_]:
    """Select evaluations that have the same bits on any machine."""
    if not isinstance(spec, CertificateSpec) or not spec.engines:
        return np.ones(len(columns), dtype=np.bool_)
    return np.asarray(columns.designs[:, spec.design_space().names.index(ENGINE)] == 0.0)


def simulated_differences(
    tables: Sequence[Table],
    recordings: Recordings,
    certificate: str | None = None,
) -> list[DifferenceView]:
    """Simulate evaluations and list differences of any bit."""
    found: list[DifferenceView] = []
    # Slow to import, and not needed to read evidence.
    from gaitswarm.services.runtime import open_evaluator

    with closing(open_evaluator("in-process")) as evaluator:
        for spec, columns in tables:
            request = EvaluationRequest(
                job_id="evidence",
                cases=spec.cases(recordings),
                designs=spec.design_space().simulated(columns.designs),
                provenance=provenance_of(*spec.robot_sources, precision=spec.precision),
            )
            outcomes = evaluator.evaluate(request, lambda: False)
            for number, (case, outcome) in enumerate(zip(spec.case_names, outcomes, strict=True)):
                found += _different(spec, columns, number, case, outcome)
    return [one.model_copy(update={"certificate": certificate}) for one in found]


def replay_answer(
    count: int, with_best: bool, spec: AnySpec, differences: Sequence[DifferenceView]
) -> tuple[bool, str]:
    """Summarize a replay."""
    among = ", the best among them," if with_best else ""
    what = f"{count} evaluations{among} in {len(spec.case_names)} cases"
    if not differences:
        return True, f"{what}: every bit is the same"
    evaluations = len({(d.iteration, d.particle) for d in differences})
    return False, f"{what}: {len(differences)} numbers of {evaluations} of them differ"


def _different(
    spec: AnySpec, columns: EvaluationColumns, number: int, case: str, outcome: Outcome
) -> Iterator[DifferenceView]:
    stored = columns.objectives[:, number]
    simulated = np.where(np.isfinite(outcome.objectives), outcome.objectives, np.nan)
    same = (stored == simulated) & (np.signbit(stored) == np.signbit(simulated))
    same |= np.isnan(stored) & np.isnan(simulated)
    for row in np.flatnonzero(~same.all(axis=1)).tolist():
        for k in np.flatnonzero(~same[row]).tolist():
            values = (float(stored[row, k]), float(simulated[row, k]))
            yield _difference(columns, row, case, spec.objectives[k].name, *values)
    for row in np.flatnonzero(columns.statuses[:, number] != outcome.statuses).tolist():
        statuses = (columns.statuses[row, number], outcome.statuses[row])
        labels = [Status(int(status)).label for status in statuses]
        yield _difference(columns, row, case, "status", *labels)


def _difference(
    columns: EvaluationColumns,
    row: int,
    case: str,
    what: str,
    stored: float | str,
    simulated: float | str,
) -> DifferenceView:
    shown = [
        None if isinstance(value, float) and np.isnan(value) else value
        for value in (stored, simulated)
    ]
    return DifferenceView(
        iteration=int(columns.iteration[row]),
        particle=int(columns.particle[row]),
        case=case,
        what=what,
        stored=shown[0],
        simulated=shown[1],
    )
