"""How a job is forked: what of its parent's history and search the fork takes over.

what is different        outcomes hold   search                        the fork begins with
nothing but the budget   yes             goes on where it was          the parent's iterations
the preference           yes             the same, its memory judged   the parent's iterations,
                                         anew, if its method can       judged anew
anything else            no, but for     a new one                     the best designs, if
                         the optimizer                                 it searches for any

Where the search cannot be taken over under another preference, the fork begins with the best
designs, too, as judged by that preference.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, zip_longest
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import (
    Conflict,
    GaitswarmError,
    InvalidRequest,
    ProvenanceChanged,
)
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
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
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, changes_since
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.jobs.start import EarlierJobs
from gaitswarm.services.optimizer.search.optimizer import Optimizer, Rejudging

Floats = NDArray[np.float64]


def retraced(
    spec: Spec,
    budgets: Sequence[int],
    asked: Sequence[Floats],
    told: Sequence[Floats],
    *,
    until: float = math.inf,
) -> Optimizer:
    """Take a search along a path, up to its last ask, which is not answered.

    Args:
        asked: (n, d) positions of every iteration, at least one.
        until: When `time.monotonic` is past this, it is given up [s].
    """
    searches = [spec.model_copy(update={"iterations": n}).create_search() for n in budgets]
    search = searches.pop(0)
    for index, positions in enumerate(asked):
        if index:
            search.tell(told[index - 1])
        if time.monotonic() > until:
            raise TimeoutError(f"it came to iteration {index} of {len(asked)}")
        # Of some methods as long as all that they were told.
        state = search.dump() if searches else {}
        while not _asks_for(search, positions):
            if not searches:
                raise ValueError(f"its search would ask for other designs in iteration {index}")
            search = searches.pop(0)
            search.load(state)
    return search


def _asks_for(search: Optimizer, positions: Floats) -> bool:
    found = search.ask(len(positions))
    return found.shape == positions.shape and found.tobytes() == positions.tobytes()


Design = dict[str, float | str]


def started(
    spec: Spec,
    job_of: Callable[[str], Job],
    columns_of: Callable[[Job], EvaluationColumns],
) -> Spec:
    """Look up the designs that a job starts from, if it names earlier jobs."""
    if not isinstance(spec.start, EarlierJobs):
        return spec
    searched = tuple(variable.name for variable in spec.design_space().variables)
    ranked = []
    for index, job_id in enumerate(spec.start.jobs):
        try:
            job = job_of(job_id)
            space, count = job.spec.design_space(), spec.start.count
            found = list(best_designs(space, columns_of(job), searched, count))
            if not found:
                raise InvalidRequest(f"job {job_id} has no design that has not failed")
            _check(spec, found)
        except (GaitswarmError, ValueError) as error:
            raise InvalidRequest(str(error), field=f"start.jobs.{index}") from error
        ranked.append(found)
    designs = [design for design in chain(*zip_longest(*ranked)) if design is not None]
    different = list({tuple(design.items()): design for design in designs}.values())
    start = tuple(different[: spec.start.count])
    if len(start) > spec.budget:
        raise InvalidRequest(
            f"{len(start)} designs are more than the budget of {spec.budget}; lower it, or give"
            " more iterations",
            field="start.count",
        )
    return spec.model_copy(update={"start": start})


def best_designs(
    space: DesignSpace, columns: EvaluationColumns, searched: tuple[str, ...], count: int
) -> Iterator[Design]:
    """Choose the best different designs of a job."""
    seen = set[tuple[float | str, ...]]()
    for row in np.argsort(columns.fitness, kind="stable").tolist():
        if len(seen) == count or not np.isfinite(columns.fitness[row]):
            return
        shown = space.shown(columns.designs[row].tolist())
        design = {name: shown[name] for name in searched if name in shown}
        if tuple(design.values()) not in seen:
            seen.add(tuple(design.values()))
            yield design


def _check(spec: Spec, designs: list[Design]) -> None:
    try:
        spec.design_space().positions(designs)
    except ValueError as error:
        place, _, problem = str(error).partition(": ")
        number, _, name = place.partition(".")
        raise ValueError(f"{name} of its best design no. {int(number) + 1}: {problem}") from error


_HOLD: Final = frozenset({"preference", "optimizer"})
"""Fields of a spec without which outcomes stay what they are."""


@dataclass(frozen=True, slots=True)
class Parent:
    """A job that is forked, with those of its iterations that the fork begins with.

    Attributes:
        job: As it was read.
        columns: Evaluations of these iterations.
        asked: Reads the (n, d) positions of each of them.
        digest: Of the last of them; None if it is not chained.
    """

    job: Job
    columns: EvaluationColumns
    asked: Callable[[], tuple[Floats, ...]]
    digest: str | None = None

    def by_iteration(self, column: Floats) -> tuple[Floats, ...]:
        """Cut a column.

        Args:
            column: (r, ...) of every evaluation.

        Returns:
            (n, ...) of each iteration.
        """
        ends = np.flatnonzero(np.diff(self.columns.iteration)) + 1
        return tuple(np.split(column, ends))

    def told(self, spec: AnySpec, fitness: Floats) -> tuple[Floats, ...]:
        """What the search of a job with this history is told.

        Args:
            fitness: (r,) of every evaluation, by its measure.
        """
        told = spec.search_feedback(self.columns.objectives, self.columns.failed, fitness)
        return self.by_iteration(told)


def budgets_of(job: Job) -> tuple[int, ...]:
    """Budgets under which the iterations of a job may have been asked for."""
    earlier = () if job.lineage is None else job.lineage.budgets
    present = job.spec.iterations
    return tuple(dict.fromkeys((*earlier, job.submitted_iterations or present, present)))


def check_begun(job: Job, iterations: int) -> None:
    """Check that a job has committed so many iterations."""
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
    *,
    longest: float = math.inf,
) -> tuple[AnySpec, Fork]:
    """Decide how a job is forked.

    Args:
        longest: Time that bringing its search to where it was may take [s].
    """
    before = parent.job.spec
    spec = forked_spec(before, request)
    changed = changed_fields(before, spec)
    lineage = Lineage(
        parent=parent.job.id,
        from_iteration=request.from_iteration,
        carried="search",
        changed=changed,
        digest=parent.digest,
    )
    fitness = parent.columns.fitness
    if "preference" in changed and _HOLD.issuperset(changed):
        fitness = spec.judge(parent.columns.objectives, parent.columns.failed).fitness
    reason = _why_not(before, changed)
    if not reason:
        try:
            until = time.monotonic() + longest
            state = _search_state(parent, spec, fitness if changed else None, until)
        except TimeoutError as error:
            raise Conflict(
                f"to bring the search of job {parent.job.id} to where it was takes longer than the"
                f" {longest:g} s that it may take here ({error}); fork it earlier, or where its"
                " database is, with `gaitswarm fork`. With another optimizer the fork starts from"
                " the best designs"
            ) from error
        except ValueError as error:
            if not changed:
                raise Conflict(
                    f"job {parent.job.id} cannot be forked so: {error}; code or libraries of the"
                    " search have changed, or its budget was changed more than once. With another"
                    " optimizer the fork starts from the best designs"
                ) from error
            reason = str(error)
        else:
            _check_budget(spec, len(fitness))
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
    return _started(parent, spec, fitness, request, reason), Fork(
        lineage.model_copy(update={"carried": "designs", "reason": reason})
    )


def _why_not(parent: AnySpec, changed: Sequence[str]) -> str:
    """Why the search cannot be taken over, whatever its method; "" if it may be."""
    others = [name for name in changed if name not in _HOLD]
    if others:
        return f"what designs came to does not hold for another {' and '.join(others)}"
    if "optimizer" in changed:
        return "another search method, or other settings of it, knows nothing of the parent's"
    if "preference" in changed and parent.precision == "single":
        return "which of the designs is the best by another preference is not known in double"
    return ""


def _search_state(
    parent: Parent, spec: AnySpec, anew: Floats | None, until: float
) -> dict[str, Any]:
    """The optimizer's dump after the last ask that is taken over.

    anew: (r,) fitness by another preference; None: by the parent's. until: as of `retraced`. Raises
    ValueError, TimeoutError.
    """
    asked, told = parent.asked(), parent.told(parent.job.spec, parent.columns.fitness)
    budgets = budgets_of(parent.job)
    if anew is None:
        return _dumped(retraced(spec, budgets, asked, told, until=until))
    told_anew = parent.told(spec, anew)
    try:
        # Whatever the method is, if it would have asked for the same, it is where it would be.
        return _dumped(retraced(spec, budgets, asked, told_anew, until=until))
    except ValueError:
        search = retraced(spec, budgets, asked, told, until=until)
    name = spec.optimizer.name
    if isinstance(search, Rejudging):
        search.rejudge(list(zip(asked[:-1], told_anew[:-1], strict=True)))
        return _dumped(search)
    raise ValueError(
        f"{name} would have asked for other designs by this preference, and cannot take in those"
        " that were asked for"
    )


def _dumped(search: Optimizer) -> dict[str, Any]:
    """What the store will give back."""
    stored: dict[str, Any] = json.loads(json.dumps(search.dump(), allow_nan=False))
    return stored


def _check_budget(spec: AnySpec, evaluations: int) -> None:
    if spec.budget <= evaluations:
        raise InvalidRequest(
            f"the fork begins with {evaluations} evaluations, all of its budget of {spec.budget};"
            " give more iterations, counted from the parent's first",
            field="iterations",
        )


def _check_unchanged(parent: Parent, taken: TakenHistory, now: JobProvenance) -> None:
    changes = changes_since(taken.provenance, now)
    if changes and not taken.accepts_changes:
        raise ProvenanceChanged(
            f"job {parent.job.id} cannot be forked here: what its numbers depend on is not what it"
            f" was: {'; '.join(changes)}. Fork it where that is as before, or accept the change:"
            " --accept-changes, accept_changes=True in Python, or"
            ' {"accept_changes": true} over HTTP'
        )


def _started(
    parent: Parent, spec: AnySpec, fitness: Floats, request: ForkRequest, reason: str
) -> AnySpec:
    """The spec that starts from the parent's best designs. Raises InvalidRequest, Conflict."""
    if not spec.searches:
        raise InvalidRequest(
            f"{reason}, and a job of the kind {spec.kind} draws its designs, so that the best of"
            " another one are no start; submit a new job in place of a fork"
        )
    columns = replace(parent.columns, fitness=fitness)
    searched = tuple(variable.name for variable in spec.design_space().variables)
    count = min(request.start_count, spec.budget)
    designs = tuple(best_designs(parent.job.spec.design_space(), columns, searched, count))
    if not designs:
        raise Conflict(
            f"job {parent.job.id} has no design in these iterations that has not failed, so there"
            " is nothing that a fork could start from"
        )
    try:
        return checked_spec(spec, {"start": designs})
    except InvalidRequest as error:
        raise InvalidRequest(f"of the parent's best designs: {error}") from error
