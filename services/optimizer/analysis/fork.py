"""Forks: the part of the parent's history and search that is taken over

change                   outcomes valid    search                       start of the fork
only the budget          yes               continues                    the parent's iterations
preference, constraints  yes               continues, its memory        the parent's iterations,
                                           rejudged if supported        rejudged
any other                no, except for    new                          the best designs, if
                         optimizer, bounds                              designs are searched for

If the search cannot be taken over under another preference, the fork starts from the best designs
by that preference.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain, zip_longest
from typing import Any, Final, NamedTuple

import numpy as np

from gaitswarm.services.optimizer.errors import (
    Conflict,
    GaitswarmError,
    InvalidRequest,
    ProvenanceChanged,
)
from gaitswarm.services.optimizer.jobs.constraints import feasible_first
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.documents import AnySpec, checked_spec
from gaitswarm.services.optimizer.jobs.fork import (
    Fork,
    ForkRequest,
    Lineage,
    TakenHistory,
    changed_fields,
    forked_spec,
)
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, changes_since
from gaitswarm.services.optimizer.jobs.spec import EarlierJobs, Spec
from gaitswarm.services.optimizer.search.optimizer import Optimizer, Rejudging, stored_state
from gaitswarm.sim.arrays import Floats


def retraced(
    spec: Spec,
    budgets: Sequence[int],
    positions: Sequence[Floats],
    feedback: Sequence[Floats],
    *,
    until: float = math.inf,
) -> Optimizer:
    """Replay a search up to its last ask, which is not answered.

    positions: (n, d) of every iteration. Raises ValueError if the search asks for other positions,
    and TimeoutError when `time.monotonic` exceeds `until`.
    """
    searches = [spec.model_copy(update={"iterations": n}).create_search() for n in budgets]
    search = searches.pop(0)
    for index, expected in enumerate(positions):
        if index:
            search.tell(feedback[index - 1])
        if time.monotonic() > until:
            raise TimeoutError(f"at iteration {index} of {len(positions)}")
        # Some methods' dumps grow with all their feedback.
        state = search.dump() if searches else {}
        # The shape of positions (n, d) follows from their number and their bytes.
        while search.ask(len(expected)).tobytes() != expected.tobytes():
            if not searches:
                raise ValueError(f"its search asks for other designs in iteration {index}")
            search = searches.pop(0)
            search.load(state)
    return search


Design = dict[str, float | str]


def with_start_designs(
    spec: Spec,
    job_of: Callable[[str], Job],
    columns_of: Callable[[Job], EvaluationColumns],
) -> Spec:
    """Look up the designs of the earlier jobs that a spec names as its start."""
    if not isinstance(spec.start, EarlierJobs):
        return spec
    searched = tuple(variable.name for variable in spec.design_space().variables)
    ranked = []
    for index, job_id in enumerate(spec.start.jobs):
        try:
            job = job_of(job_id)
            space, count = job.spec.design_space(), spec.start.count
            columns = columns_of(job)
            order = _ordered(job.spec, columns, columns.fitness)
            best = list(best_designs(space, columns.designs, order, searched, count))
            if not best:
                raise InvalidRequest(f"job {job_id} has no successful design")
            _check(spec, best)
        except (GaitswarmError, ValueError) as error:
            raise InvalidRequest(str(error), field=f"start.jobs.{index}") from error
        ranked.append(best)
    designs = [design for design in chain(*zip_longest(*ranked)) if design is not None]
    different = list({tuple(design.items()): design for design in designs}.values())
    start = tuple(different[: spec.start.count])
    if len(start) > spec.budget:
        raise InvalidRequest(
            f"{len(start)} designs are more than the budget of {spec.budget}; lower it, or use"
            " more iterations",
            field="start.count",
        )
    return spec.model_copy(update={"start": start})


def best_designs(
    space: DesignSpace, designs: Floats, order: Floats, searched: tuple[str, ...], count: int
) -> Iterator[Design]:
    """Yield the best distinct designs (r, v) of a job by ascending order (r,)."""
    seen = set[tuple[float | str, ...]]()
    for row in np.argsort(order, kind="stable").tolist():
        if len(seen) == count or not np.isfinite(order[row]):
            return
        shown = space.shown(designs[row].tolist())
        design = {name: shown[name] for name in searched if name in shown}
        if tuple(design.values()) not in seen:
            seen.add(tuple(design.values()))
            yield design


def _ordered(spec: Spec, columns: EvaluationColumns, fitness: Floats) -> Floats:
    """Return numbers (r,) that order designs: by fitness, infeasible ones by violation."""
    violations = spec.violations(columns.objectives, columns.failed)
    return fitness if violations is None else feasible_first(fitness, violations)


def _check(spec: Spec, designs: list[Design]) -> None:
    try:
        spec.design_space().positions(designs)
    except ValueError as error:
        place, _, problem = str(error).partition(": ")
        number, _, name = place.partition(".")
        raise ValueError(f"{name} of its best design no. {int(number) + 1}: {problem}") from error


_MEASURE: Final = frozenset({"preference", "constraints", "scenario_weights", "scenario_aggregate"})
"""Fields of a spec by which outcomes are judged."""

_OUTCOMES_HOLD: Final = _MEASURE | {"optimizer", "variables"}
"""Fields that do not affect outcomes."""

_REFERENCES_DEPEND_ON: Final = frozenset({"constraints", "scenarios", "robot"})
"""Fields of a request on which the values of references depend."""


class Parent(NamedTuple):
    """The parent of a fork, and its iterations before the fork."""

    job: Job
    columns: EvaluationColumns  # evaluations of these iterations
    positions: Callable[[], tuple[Floats, ...]]  # reads the (n, d) positions of each of them
    digest: str | None = None  # of the last of them; None if it is not chained

    def by_iteration(self, column: Floats) -> tuple[Floats, ...]:
        ends = np.flatnonzero(np.diff(self.columns.iteration)) + 1
        return tuple(np.split(column, ends))

    def feedback(self, spec: AnySpec, fitness: Floats) -> tuple[Floats, ...]:
        """Return the search feedback of each iteration, for a fitness (r,)."""
        feedback = spec.search_feedback(self.columns.objectives, self.columns.failed, fitness)
        return self.by_iteration(feedback)


def budgets_of(job: Job) -> tuple[int, ...]:
    """Return the budgets under which a job's iterations may have been asked for."""
    earlier = () if job.lineage is None else job.lineage.budgets
    present = job.spec.iterations
    return tuple(dict.fromkeys((*earlier, job.submitted_iterations or present, present)))


def check_begun(job: Job, iterations: int) -> None:
    """Check that a job has committed a number of iterations."""
    committed = job.progress.iterations
    if iterations > committed:
        raise InvalidRequest(
            f"must be at most {committed}, the iterations that job {job.id} has committed"
            if committed
            else f"job {job.id} has committed no iteration yet",
            field="from_iteration",
        )


def forked(
    parent: Parent,
    request: ForkRequest,
    provenance: Callable[[AnySpec], JobProvenance],
    look_up: Callable[[AnySpec], AnySpec] = lambda spec: spec,
    *,
    longest: float = math.inf,
) -> tuple[AnySpec, Fork]:
    """Return spec and origin of a fork; `longest` limits the time to restore the search [s]."""
    before = parent.job.spec
    spec = forked_spec(before, request)
    if _REFERENCES_DEPEND_ON.intersection(changed_fields(before, spec)):
        spec = look_up(spec)
    changed = changed_fields(before, spec)
    lineage = Lineage(
        parent=parent.job.id,
        from_iteration=request.from_iteration,
        carried="search",
        changed=changed,
        digest=parent.digest,
    )
    fitness, judge = parent.columns.fitness, before
    if _MEASURE.intersection(changed) and _OUTCOMES_HOLD.issuperset(changed):
        fitness, judge = spec.judge(parent.columns.objectives, parent.columns.failed).fitness, spec
    reason = _reason_for_new_search(before, changed)
    if not reason:
        try:
            until = time.monotonic() + longest
            state = _search_state(parent, spec, fitness if changed else None, until)
        except TimeoutError as error:
            raise Conflict(
                f"restoring the search of job {parent.job.id} exceeds the limit of {longest:g} s"
                f" ({error}); fork at an earlier iteration, or directly on the database with"
                " `gaitswarm fork`. With another optimizer the fork starts from the best designs"
            ) from error
        except ValueError as error:
            if not changed:
                raise Conflict(
                    f"job {parent.job.id} cannot be forked with its search: {error}; code or"
                    " libraries of the search have changed, or its budget was changed more than"
                    " once. With another optimizer the fork starts from the best designs"
                ) from error
            reason = str(error)
        else:
            if spec.budget <= len(fitness):
                raise InvalidRequest(
                    f"the {len(fitness)} evaluations taken over exhaust the budget of"
                    f" {spec.budget}; use more iterations, counted from the parent's first",
                    field="iterations",
                )
            taken = TakenHistory(
                state,
                parent.by_iteration(fitness) if changed else None,
                tuple(
                    record
                    for record in parent.job.provenance
                    if record.from_iteration < request.from_iteration
                ),
                request.accept_changes,
            )
            _check_unchanged(parent, taken, provenance(spec))
            update = {"evaluations": len(fitness), "budgets": budgets_of(parent.job)}
            return spec, Fork(lineage.model_copy(update=update), taken)
    return _from_best_designs(parent, spec, judge, fitness, request, reason), Fork(
        lineage.model_copy(update={"carried": "designs", "reason": reason})
    )


def _reason_for_new_search(parent: AnySpec, changed: Sequence[str]) -> str:
    """Return why no method's search can be taken over; "" if it may be."""
    others = [name for name in changed if name not in _OUTCOMES_HOLD]
    if others:
        return f"results of the parent's designs do not hold for a different {' and '.join(others)}"
    if "variables" in changed:
        return "the parent searched within other bounds"
    if "optimizer" in changed:
        return "another search method or other settings cannot continue the parent's search"
    if _MEASURE.intersection(changed) and parent.precision == "single":
        return "the best design by another measure was not reevaluated in double precision"
    return ""


def _search_state(
    parent: Parent, spec: AnySpec, rejudged: Floats | None, until: float
) -> dict[str, Any]:
    """Return the optimizer's dump after the last ask taken over, by `rejudged` (r,) if given."""
    positions = parent.positions()
    retrace = partial(retraced, spec, budgets_of(parent.job), positions, until=until)
    feedback = parent.feedback(parent.job.spec, parent.columns.fitness)
    if rejudged is None:
        return stored_state(retrace(feedback))
    rejudged_feedback = parent.feedback(spec, rejudged)
    try:
        # Any method that would have asked for the same positions can continue.
        return stored_state(retrace(rejudged_feedback))
    except ValueError:
        search = retrace(feedback)
    if isinstance(search, Rejudging):
        search.rejudge(list(zip(positions[:-1], rejudged_feedback[:-1], strict=True)))
        return stored_state(search)
    raise ValueError(
        f"{spec.optimizer.name} would have asked for other designs by this preference, and cannot"
        " learn from the parent's"
    )


def _check_unchanged(parent: Parent, taken: TakenHistory, now: JobProvenance) -> None:
    changes = changes_since(taken.provenance, now)
    if changes and not taken.accepts_changes:
        raise ProvenanceChanged(
            f"job {parent.job.id} cannot be forked here: the provenance of its results has changed:"
            f" {'; '.join(changes)}. Fork it in the original environment, or accept the change:"
            " --accept-changes, accept_changes=True in Python, or"
            ' {"accept_changes": true} over HTTP'
        )


def _from_best_designs(
    parent: Parent,
    spec: AnySpec,
    judge: AnySpec,
    fitness: Floats,
    request: ForkRequest,
    reason: str,
) -> AnySpec:
    if not spec.searches:
        raise InvalidRequest(
            f"{reason}, and a job of kind {spec.kind} samples its designs, so it cannot start from"
            " the best of another job; submit a new job instead"
        )
    variables = spec.design_space().variables
    searched = tuple(variable.name for variable in variables)
    count = min(request.start_count, spec.budget)
    space, columns = parent.job.spec.design_space(), parent.columns
    order = _ordered(judge, columns, fitness)
    for variable in variables if request.bounds else ():
        values = columns.designs[:, space.names.index(variable.name)]
        order = np.where((values < variable.low) | (values > variable.high), np.inf, order)
    designs = tuple(best_designs(space, columns.designs, order, searched, count))
    if not designs:
        raise Conflict(
            f"every design of job {parent.job.id} in these iterations has failed or is outside"
            " the bounds; there is none to start from"
        )
    try:
        return checked_spec(spec, {"start": designs})
    except InvalidRequest as error:
        raise InvalidRequest(f"the parent's best designs: {error}") from error
