"""Reference designs, and verdicts on the best design of a job: gains, losses, limits, bounds"""

from __future__ import annotations

import logging
import math
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypeVar

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.analysis.bounds import (
    NEAR,
    ClosestView,
    End,
    LimitView,
    WidenedView,
    bound_at,
    limit_views,
    with_wider_bounds,
)
from gaitswarm.services.optimizer.errors import GaitswarmError, InvalidRequest, StoreUnavailable
from gaitswarm.services.optimizer.jobs.constraints import (
    PUBLISHED,
    Constraint,
    ReferenceChoice,
    reference_choice,
)
from gaitswarm.services.optimizer.jobs.estimate import duration
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.job import (
    GIVEN,
    Job,
    Reference,
    ReferenceKind,
    ReferenceView,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import (
    JobSpec,
    adapted_to_job,
    nearest_design,
    reference_design,
)
from gaitswarm.services.optimizer.jobs.preference import by_design
from gaitswarm.services.optimizer.jobs.provenance import changes_since, job_provenance
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import Finite, JobName, View
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.case import run_together
from gaitswarm.sim.catalogue import GAIT_VARIABLES, design_numbers
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, RESULTS, Outcome, Status

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store


S = TypeVar("S", bound=Spec)

NONE: Final = Reference(None, None)
"""For a job with a plug-in's case."""

_JUDGED_BY: Final = {
    *("robot", "controller", "scenarios", "preference", "variables", "fixed", "worlds"),
    *("scenario_weights", "scenario_aggregate", "case"),
}
"""Fields of a spec on which a reference depends."""

_log = logging.getLogger(__name__)


def walked_reference(spec: JobSpec) -> Reference:
    """Simulate the published or start design of a job in the job's cases."""
    reference = reference_design(spec)
    return NONE if reference is None else _walked(spec, spec.controller, *reference)


def _walked(
    spec: JobSpec,
    controller: ControllerName,
    name: str,
    kind: ReferenceKind,
    design: Mapping[str, float],
) -> Reference:
    judged_by = spec.model_dump_json(include=_JUDGED_BY)
    objectives, failed = by_design(_simulated(judged_by, controller, tuple(design.items())))
    fitness = float(JobSpec.model_validate_json(judged_by).judge(objectives, failed).fitness[0])
    results = objectives[0].astype("<f8").tobytes()
    return Reference(name, fitness if math.isfinite(fitness) else None, kind, results)


@lru_cache(maxsize=64)
def _simulated(
    judged_by: str, controller: ControllerName, design: tuple[tuple[str, float], ...]
) -> tuple[Outcome, ...]:
    """Simulate a design of any controller in the cases of a job, in double precision."""
    spec = JobSpec.model_validate_json(judged_by)
    cases = spec.cases_of(controller, tuple(name for name, _ in design))
    return run_together(cases, [np.array([[value for _, value in design]])] * len(cases))


def with_references(
    spec: S,
    job_of: Callable[[str], Job],
    best_of: Callable[[str], Evaluation | None],
    *,
    starts: bool,
    longest: float = math.inf,
) -> S:
    """Return a spec whose constraints have the values of their references, simulated in double.

    longest: limit on the simulated time of all references [s]. starts: whether a job without start
    designs starts from the references.
    """
    if not isinstance(spec, JobSpec) or not spec.constraints:
        return spec
    relative = {str(c.relative_to): k for k, c in enumerate(spec.constraints) if c.relative_to}
    seconds = len(relative) * duration(spec, spec.cases({})) if longest < math.inf else 0.0
    if relative and seconds > longest:
        raise InvalidRequest(
            f"the simulations of the references last {seconds:g} s in total, more than the"
            f" {longest:g} s allowed; choose fewer references, scenarios, cycles or worlds",
            field=f"constraints.{max(relative.values())}.relative_to",
        )
    constraints, start = [], list[dict[str, float | str]]()
    for index, constraint in enumerate(spec.constraints):
        values = None
        try:
            if constraint.relative_to is not None:
                controller, design = _referred(spec, constraint.relative_to, job_of, best_of)
                values = _values(spec, constraint, controller, design)
                nearest = nearest_design(spec, design) if controller == spec.controller else None
                start += [nearest] if starts and nearest and nearest not in start else []
        except (GaitswarmError, SimulationError, ValueError) as error:
            message = str(error).removeprefix("relative_to: ")
            field = f"constraints.{index}.relative_to"
            raise InvalidRequest(message, field=field) from error
        constraints.append(constraint.model_copy(update={"reference": values}))
    changes = {
        "constraints": tuple(constraints),
        "start": spec.start or tuple(start[: spec.budget]),
    }
    resolved = spec.model_copy(update=changes)
    try:
        resolved.limits()
    except ValueError as error:
        field, _, message = str(error).partition(": ")
        raise InvalidRequest(message, field=field) from error
    return resolved


def _values(
    spec: JobSpec,
    constraint: Constraint,
    controller: ControllerName,
    design: Mapping[str, float],
) -> dict[str, dict[str, float]]:
    """Simulate a reference and return its values by case and quantity."""
    judged_by = spec.model_dump_json(include=_JUDGED_BY)
    outcomes = _simulated(judged_by, controller, tuple(design.items()))
    values: dict[str, dict[str, float]] = {}
    for case, column in spec.constraint_cases.limited(constraint):
        name, status = spec.case_names[case], Status(outcomes[case].statuses[0])
        if status is not Status.OK:
            raise ValueError(f"it fails in {name}: {status.phrase}")
        value = float(outcomes[case].objectives[0, column])
        values.setdefault(name, {})[spec.columns[column].name] = value
    return values


def _referred(
    spec: JobSpec,
    reference: ReferenceChoice,
    job_of: Callable[[str], Job],
    best_of: Callable[[str], Evaluation | None],
) -> tuple[ControllerName, Mapping[str, float]]:
    """Return the controller and the design of a reference."""
    law = CONTROLLERS[spec.controller]
    if not isinstance(reference, str):
        return spec.controller, _complete_design(spec, reference)
    if reference.startswith(PUBLISHED):
        name = reference.removeprefix(PUBLISHED)
        if name not in law.published:
            raise ValueError(
                f"no published design {name!r} of {spec.controller};"
                f" {instead_of(name, law.published)}"
            )
        return spec.controller, adapted_to_job(law.published[name], spec)
    other, best = job_of(reference).spec, best_of(reference)
    if not isinstance(other, JobSpec):
        raise InvalidRequest(f"job {reference} is of kind {other.kind}, which tunes no controller")
    if best is None:
        raise ValueError(f"job {reference} has no feasible design yet")
    space = other.design_space()
    (values,) = space.simulated(best.design[np.newaxis]).tolist()
    return other.controller, dict(zip(space.names, values, strict=True))


def _complete_design(spec: JobSpec, design: Mapping[str, float | str]) -> dict[str, float]:
    """Check a design; conventions and gait that it omits are those of the job."""
    law = CONTROLLERS[spec.controller]
    known = [v.name for v in (*law.variables, *law.conventions, *GAIT_VARIABLES)]
    for name in design:
        if name not in known:
            raise ValueError(f"unknown variable {name!r}; {instead_of(name, known)}")
    missing = [v.name for v in law.variables if v.name not in design]
    if missing:
        raise ValueError(f"the design has no {', '.join(missing)}")
    return adapted_to_job({}, spec) | design_numbers(spec.controller, design)


def with_other_reference(
    job: Job,
    spec: JobSpec,
    against: str,
    job_of: Callable[[str], Job],
    best_of: Callable[[str], Evaluation | None],
) -> tuple[Job, str | None]:
    """Return a job with another reference, which is not stored, and why there is no gain."""
    if spec.case is not None:
        raise InvalidRequest("a plug-in evaluates the designs of the job", field="against")
    try:
        choice, name = reference_choice(against), GIVEN
        kind: ReferenceKind = "design"
        if isinstance(choice, str):
            name = choice.removeprefix(PUBLISHED)
            kind = "job" if name == choice else "published"
        controller, design = _referred(spec, choice, job_of, best_of)
        reference = _walked(spec, controller, name, kind, design)
    except (GaitswarmError, SimulationError, ValueError) as error:
        raise InvalidRequest(str(error), field="against") from error
    job = replace(job, reference=reference)
    return job, None if job.gain is not None else _why_none(job)


def with_reference(store: Store, job: Job) -> tuple[Job, str | None]:
    """Determine and store a job's reference, unless known; return why there is no gain."""
    if job.reference is None:
        if not job.readable or not isinstance(job.spec, JobSpec):
            return job, "the job is not a tuning job"
        if job.progress.best_fitness is None:
            return job, "no design is feasible yet"
        try:
            if changes_since(job.provenance, job_provenance(job.spec)):
                return job, "the job was computed by other code or libraries"
            reference = walked_reference(job.spec)
        except (SimulationError, OSError) as error:
            return job, f"the reference design cannot be simulated here: {error}"
        store.note_reference(job.id, reference)
        job = replace(job, reference=reference)
    return job, None if job.gain is not None else _why_none(job)


def _why_none(job: Job) -> str:
    reference = job.reference or NONE
    if reference.name is None:
        return "a plug-in evaluates its designs, and none is a reference"
    if reference.fitness is None:
        return f"{reference.title} fails in one of the scenarios"
    return "no design is feasible yet"


def note_reference(store: Store, job: Job) -> Job:
    """As `with_reference` after a job's end or pause, with errors logged."""
    if job.reference is not None:
        return job
    try:
        job, _ = with_reference(store, job)
    except StoreUnavailable as error:
        # Determined on the next request for the gain.
        _log.warning("job %s: its reference was not determined: %s", job.id, error)
    except Exception:  # noqa: BLE001
        # The job's results are stored and do not depend on it.
        _log.exception("job %s: its reference was not determined", job.id)
    return job


Judgement = Literal["better", "same", "worse"]

SAME: Final = 0.005
"""Relative difference up to which two values are the same [1]."""


class Quantity(NamedTuple):
    """A quantity in users' units, with the words for its change."""

    name: str
    unit: str
    column: str  # result that measures it
    better: str  # word after a percentage
    worse: str
    reciprocal: bool = False  # of the objective


QUANTITIES: Final = (
    Quantity("speed", "m/s", "reciprocal_speed", "faster", "slower", reciprocal=True),
    Quantity("energy", "J/m", "energy", "less energy per metre", "more energy per metre"),
    Quantity("acceleration", "m/s2", "acceleration", "less acceleration", "more acceleration"),
    Quantity(
        "angular_acceleration",
        "rad/s2",
        "angular_acceleration",
        "less angular acceleration",
        "more angular acceleration",
    ),
    Quantity("torque", "N m", "torque", "less torque", "more torque"),
    Quantity("peak_current", "A", "peak_current", "less peak current", "more peak current"),
)
"""Quantities that are compared. The loss of height, a difference near zero, has no ratio.

Those that are objectives count as figures.
"""

_COLUMNS: Final = tuple(result.name for result in RESULTS)


class FigureView(View):
    """A quantity of the best design in one scenario."""

    value: float = Field(examples=[0.0463])
    """Of the best design, in the quantity's unit; the geometric mean over worlds."""
    reference: float = Field(description="Of the reference.", examples=[0.0417])
    change: float = Field(description="`value` / `reference` - 1 [1].", examples=[0.11])
    judgement: Judgement
    """Whether that is better, worse, or by at most 0.5 % the same."""


class QuantityView(View):
    """A quantity of the best design in all scenarios in which the reference walks."""

    name: str = Field(description="Name of the quantity.", examples=["speed"])
    unit: str = Field(description="Its unit.", examples=["m/s"])
    change: float = Field(examples=[0.11])
    """Relative change of the geometric mean over scenarios, weighted as by the job [1]."""
    judgement: Judgement = Field(description="As of a figure.")
    scenarios: dict[str, FigureView] = Field(description="Figures by scenario.")


class BoundView(View):
    """A variable whose best value lies at a bound of the search."""

    name: str = Field(description="Name of the variable.", examples=["FI1R"])
    unit: str = Field(description="Its unit.", examples=["counts"])
    value: float = Field(description="Value in the best design.", examples=[5990.0])
    at: End = Field(description="Bound at which it lies, within a hundredth of the range.")
    bound: float = Field(description="That bound.", examples=[6000.0])
    widened: WidenedView | None
    """Wider bounds, which can be simulated together with those of the other variables; null if
    there are none."""


class VerdictView(View):
    """A job's best design compared with its reference, in words and numbers."""

    id: JobName
    reference: ReferenceView | None
    """The published or the start design, or the one requested."""
    best_fitness: Finite = Field(description="Least fitness of the job so far [1].")
    gain: Finite = Field(examples=[0.39])
    """Relative improvement over the reference [1]; null if undefined."""
    reason: str | None = Field(description="Why there is no gain, in words; null if there is one.")
    sentences: list[str] = Field(
        description="Verdict in words.",
        examples=[["Compared with published A, 20 % better by fitness: 11 % faster."]],
    )
    quantities: list[QuantityView] = Field(description="Compared quantities; empty without any.")
    figures: dict[Judgement, int] = Field(examples=[{"better": 22, "same": 1, "worse": 7}])
    """Number of figures (objectives in scenarios) by judgement."""
    bounds: list[BoundView] = Field(description="Variables at a bound of the search.")
    limits: list[LimitView]
    """Limits of constraints that the best design reaches, to within a hundredth."""
    widen: str | None = Field(
        description="Command that starts another search from the best designs within wider bounds;"
        " null if no wider bounds can be simulated.",
        examples=["gaitswarm fork k2q7zr5dm9xw --from 25 --bounds FI1R=1500:8250"],
    )
    relax: str | None = Field(
        default=None,
        description="While no design is feasible, command that continues under constraints so far"
        " relaxed that the closest design keeps them; null if no command can state them.",
        examples=["gaitswarm fork k2q7zr5dm9xw --from 25 --iterations 50 --constraint speed>=0.04"],
    )


def verdict(
    job: Job, best: Evaluation | None, reason: str | None, closest: ClosestView | None
) -> VerdictView:
    """Judge the best design of a job, if there is one; `reason`: why there is no gain."""
    reference, spec = job.reference, job.stored_spec
    quantities: list[QuantityView] = []
    sentences = [] if closest is None else [f"{closest.explanation}."]
    limits: list[LimitView] = []
    bounds: list[BoundView] = []
    widen = relax = None
    fork = ["gaitswarm", "fork", job.id, "--from", str(job.progress.iterations)]
    if closest is not None and isinstance(spec, JobSpec):
        texts = relaxed(spec.constraints, closest.violated)
        budget = ["--iterations", str(2 * spec.iterations)]
        relax = texts and shlex.join([*fork, *budget, *_repeated("--constraint", texts)])
    if best is not None and isinstance(spec, JobSpec):
        results = (best.reevaluation or best).objectives
        if reference is not None:
            quantities = compared(spec, results, reference)
            sentences += comparison_in_words(quantities, reference, job.gain)
        limits = limits_reached(spec, results)
        sentences += limits_in_words(limits)
        bounds = bounds_reached(spec, best.design)
        sentences += bounds_in_words(bounds, len(spec.design_space().variables))
        ends = [
            f"{bound.name}={bound.widened.low:.6g}:{bound.widened.high:.6g}"
            for bound in bounds
            if bound.widened
        ]
        if ends:
            widen = shlex.join([*fork, *_repeated("--bounds", ends)])
    counts = counted(quantities)
    return VerdictView(
        id=job.id,
        reference=ReferenceView.from_reference(reference),
        best_fitness=job.progress.best_fitness,
        gain=job.gain,
        reason=reason,
        sentences=sentences,
        quantities=quantities,
        figures={judgement: counts[judgement] for judgement in ("better", "same", "worse")},
        limits=limits,
        bounds=bounds,
        widen=widen,
        relax=relax,
    )


def _repeated(option: str, values: Iterable[str]) -> Iterator[str]:
    return chain.from_iterable((option, value) for value in values)


def compared(spec: JobSpec, objectives: Floats, reference: Reference) -> list[QuantityView]:
    """Compare raw objectives (K, m) with those of the reference, in scenarios where both walk."""
    if not reference.results:
        return []
    names = [scenario.name for scenario in spec.resolved_scenarios()]
    other = reference.objectives(len(objectives))
    # Made-up or older results may have fewer measurements.
    width = min(objectives.shape[1], other.shape[1])
    both = np.stack([objectives[:, :width], other[:, :width]])
    walked = np.isfinite(both[:, :, : len(OBJECTIVE_NAMES)]).all(axis=(0, 2))
    worlds = len(objectives) // len(names)
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithms = np.log(both)
    views = []
    for quantity in QUANTITIES:
        index = _COLUMNS.index(quantity.column)
        if index >= width:
            continue
        column = logarithms[:, :, index]
        usable = (walked & np.isfinite(column).all(axis=0)).reshape(-1, worlds)
        by_scenario = column.reshape(2, -1, worlds)
        means = {
            name: by_scenario[:, k, usable[k]].mean(axis=1).tolist()
            for k, name in enumerate(names)
            if usable[k].any()
        }
        if not means:
            continue
        sign = -1.0 if quantity.reciprocal else 1.0
        figures = {
            name: FigureView(
                value=np.exp(sign * best),
                reference=np.exp(sign * other),
                change=np.expm1(sign * (best - other)),
                judgement=_judged(best - other),
            )
            for name, (best, other) in means.items()
        }
        weights = [spec.scenario_weights.get(name, 1.0) for name in means]
        mean = float(np.average([best - other for best, other in means.values()], weights=weights))
        views.append(
            QuantityView(
                name=quantity.name,
                unit=quantity.unit,
                change=np.expm1(sign * mean),
                judgement=_judged(mean),
                scenarios=figures,
            )
        )
    return views


def _judged(logarithm: float) -> Judgement:
    """logarithm: of the ratio of two minimized values."""
    ratio = float(np.exp(logarithm))
    if abs(ratio - 1.0) <= SAME:
        return "same"
    return "better" if ratio < 1.0 else "worse"


def comparison_in_words(
    views: Sequence[QuantityView], reference: Reference, gain: float | None
) -> Iterator[str]:
    """Yield sentences on the changes overall, on scenarios that got worse, and on the figures."""
    if not views:
        return
    words = {quantity.name: quantity for quantity in QUANTITIES}
    changes: dict[Judgement, list[str]] = {"better": [], "same": [], "worse": []}
    for view in views:
        change, quantity = percentage(view.change), words[view.name]
        texts = {
            "better": f"{change} {quantity.better}",
            "same": f"the same {view.name.replace('_', ' ')}",
            "worse": f"{change} {quantity.worse}",
        }
        changes[view.judgement].append(texts[view.judgement])
    against = f"Compared with {reference.title}"
    if gain is not None:
        fitness = _judged(np.log1p(-gain))
        same = fitness == "same"
        against += f", {'of the same' if same else f'{percentage(gain)} {fitness} by'} fitness"
    gained = listed(changes["better"] + changes["same"])
    paid = listed(changes["worse"])
    yield f"{against}: {', but '.join(filter(None, (gained, paid)))}."
    for view in views:
        yield from _losses(view, words[view.name])
    counts = counted(views)
    if counts["better"] == counts.total():
        yield f"Better in all {counts.total()} figures."
        return
    words_of: dict[Judgement, str] = {"better": "better", "same": "the same", "worse": "worse"}
    parts = [f"{text} in {counts[name]}" for name, text in words_of.items() if counts[name]]
    yield f"{listed(parts).capitalize()} of {counts.total()} figures."


def counted(views: Sequence[QuantityView]) -> Counter[Judgement]:
    """Count figures by judgement: objectives in scenarios."""
    objectives = [quantity.name for quantity in QUANTITIES if quantity.column in OBJECTIVE_NAMES]
    figures = (view.scenarios.values() for view in views if view.name in objectives)
    return Counter(figure.judgement for figure in chain.from_iterable(figures))


def _losses(view: QuantityView, quantity: Quantity) -> Iterator[str]:
    """Yield a sentence on the scenarios in which a quantity is worse than the reference's."""
    losses = {name: f for name, f in view.scenarios.items() if f.judgement == "worse"}
    if not losses:
        return
    most = max(losses, key=lambda name: abs(np.log1p(losses[name].change)))
    where = f"in {len(losses)} of {len(view.scenarios)} scenarios, most "
    if len(losses) == len(view.scenarios):
        where = "in every scenario, most " if len(losses) > 1 else ""
    elif len(losses) == 1:
        where = ""
    yield (
        f"{quantity.worse.capitalize()} {where}in {most}: {losses[most].value:.3g} instead of"
        f" {losses[most].reference:.3g} {view.unit}."
    )


def limits_reached(spec: JobSpec, results: Floats) -> list[LimitView]:
    """Return the limits of constraints that results (K, m) reach, the closest first."""
    limits = sorted(limit_views(spec, results), key=_distance)
    return [limit for limit in limits if _distance(limit) <= NEAR]


def _distance(limit: LimitView) -> float:
    return abs(limit.value - limit.limit) / (abs(limit.limit) or 1.0)


def limits_in_words(limits: Sequence[LimitView]) -> Iterator[str]:
    """Yield a sentence on the constraints that are reached, each with its closest limit."""
    if not limits:
        return
    by_constraint: dict[str, list[LimitView]] = {}
    for limit in limits:
        by_constraint.setdefault(limit.constraint, []).append(limit)
    texts = []
    for constraint, (first, *others) in by_constraint.items():
        more = f", and {len(others)} more" if others else ""
        place = f"{first.quantity.replace('_', ' ')} in {first.case}: {first.value:.3g}"
        texts.append(f"{constraint} ({place} {first.unit}{more})")
    yield f"At the limit of a constraint: {listed(texts)}."


def relaxed(constraints: Sequence[Constraint], violated: Sequence[LimitView]) -> list[str] | None:
    """Return constraints as texts, violated ones relaxed until they are not; None if that fails."""
    texts = []
    for constraint in constraints:
        changes = {}
        for side, relation, slack in (("min", ">=", 0.999), ("max", "<=", 1.001)):
            ratios = [
                limit.value / limit.limit if limit.value * limit.limit > 0.0 else math.nan
                for limit in violated
                if (limit.constraint, limit.relation) == (str(constraint), relation)
            ]
            if ratios:
                ratio = min(ratios) if side == "min" else max(ratios)
                changes[side] = float(f"{getattr(constraint, side) * ratio * slack:.4g}")
        if isinstance(constraint.relative_to, dict) or not np.isfinite([*changes.values()]).all():
            return None
        texts += constraint.model_copy(update=changes).texts()
    return texts


def bounds_reached(spec: JobSpec, design: Floats) -> list[BoundView]:
    reached: list[BoundView] = []
    wider: Spec = spec
    for variable, value in zip(spec.design_space().variables, design.tolist(), strict=False):
        at = bound_at(variable, value)
        if at is not None:
            wider, widened = with_wider_bounds(wider, variable, at)
            fields = {"name": variable.name, "unit": variable.unit, "value": value}
            bound = getattr(variable, at)
            reached.append(BoundView(**fields, at=at, bound=bound, widened=widened))
    return reached


def bounds_in_words(bounds: Sequence[BoundView], variables: int) -> Iterator[str]:
    if bounds:
        values = [
            f"{bound.name} at {bound.bound:g}{'' if bound.unit == '1' else f' {bound.unit}'}"
            for bound in bounds
        ]
        number = f"{len(bounds)} of {variables} variables"
        yield f"At a bound of the search: {number}, {listed(values)}."


def percentage(change: float) -> str:
    """Format the size of a relative change with two digits, such as 0.62 % or 240 %."""
    percent = 100.0 * abs(change)
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.0f} %"


def listed(texts: Sequence[str]) -> str:
    """Return texts as an enumeration: `a, b and c`."""
    return " and ".join(filter(None, (", ".join(texts[:-1]), *texts[-1:])))
