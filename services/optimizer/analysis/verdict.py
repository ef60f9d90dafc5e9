"""Verdict on a job's best design, in words: gains and losses against its reference, and bounds"""

from __future__ import annotations

import math
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Final, Literal, NamedTuple

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
from gaitswarm.services.optimizer.jobs.constraints import (
    Constraint,
)
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.job import (
    Job,
    Reference,
    ReferenceView,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import (
    JobSpec,
)
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import Finite, JobName, View
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, RESULTS

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
