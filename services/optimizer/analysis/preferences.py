"""Preferences: rankings by another one, those under which a design wins, and candidates

For given biases the logarithm of fitness is linear in the exponents (eq. 4.1, 4.2), so the
exponents under which a design has the greatest lead solve a linear program.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.analysis.distribution import iteration_starts
from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView, evaluation_views
from gaitswarm.services.optimizer.analysis.front import Rows, TradeOffDesignView, design_fields
from gaitswarm.services.optimizer.analysis.statistics import spearman
from gaitswarm.services.optimizer.analysis.utilities import (
    NAMED,
    PreferenceOwner,
    fitness_by,
    infeasible_rows,
    objective_vectors,
)
from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.constraints import Constraints
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns, evaluations_of
from gaitswarm.services.optimizer.jobs.kinds.preferences import (
    CRITERIA,
    FIGURES,
    PreferencesSpec,
    preference_of,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import (
    ScenarioAggregate,
    ScenarioWeights,
)
from gaitswarm.services.optimizer.jobs.labels import OWN, preference_name
from gaitswarm.services.optimizer.jobs.preference import Preference, PreferenceChoice
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.views import (
    DesignValues,
    Finite,
    IterationIndex,
    JobName,
    Particle,
    Request,
    View,
)
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.memory import require_room_for_scipy


class RankingRequest(Request):
    """Preference and constraints by which to rank the designs of a job."""

    preference: PreferenceChoice | None = Field(default=None, examples=["B"])
    """How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or your own; null:
    as by the job."""
    constraints: Constraints | None = Field(default=None, examples=[["speed>=0.05"]])
    """Limits that a design must keep, as in a spec; null: those of the job, an empty list: none."""
    scenario_weights: ScenarioWeights | None = None
    """As in a spec; null: those of the job."""
    scenario_aggregate: ScenarioAggregate | None = None
    """As in a spec; null: that of the job."""
    top: int = Field(default=20, ge=1, le=1000, description="How many of the best to list.")


class RankedDesignView(EvaluationView):
    """A design and its ranks; among equals the earliest comes first."""

    fitness: float = Field(description="Under the requested preference [1].", examples=[20.8])
    rank: int = Field(description="Rank under the requested preference, from 1.")
    rank_before: int | None
    """Rank under the job's own preference, from 1; null if it has none."""
    fitness_before: Finite = Field(description="By the job's own preference [1].")


class BestSoFarView(View):
    """Best fitness so far under the requested preference."""

    index: IterationIndex
    fitness: Finite = Field(description="Least fitness of this and all earlier iterations [1].")


class RankingView(View):
    """A job's designs ranked by another preference, without simulation."""

    preference: PreferenceChoice = Field(description="The requested preference.")
    evaluations: int = Field(description="Designs that were ranked.")
    infeasible: int
    """Designs that did not fail and violate the requested constraints."""
    fitness_of_present_best: Finite = Field(examples=[23.1])
    """By the requested preference, of the job's own best design [1]."""
    correlation: Finite = Field(examples=[0.83])
    """Spearman's rank correlation of both rankings, over the designs in both [1]; null where it is
    undefined."""
    top: list[RankedDesignView] = Field(description="The best designs, best first.")
    best_so_far: list[BestSoFarView] = Field(description="One entry an iteration, in order.")


def rank(columns: EvaluationColumns, spec: JobSpec, *, top: int) -> RankingView:
    """Rank all designs by their stored results."""
    preference, before = spec.resolved_preference(), columns.fitness
    fitness = fitness_by(columns, preference, aggregation=spec.aggregation)
    walked = np.isfinite(fitness)
    fitness[infeasible_rows(columns, spec)] = np.inf
    present = _best_first(before)
    ranks = np.zeros(len(columns), dtype=np.int64)
    ranks[present] = np.arange(1, len(present) + 1)
    rows = _best_first(fitness)[:top]
    views = evaluation_views(evaluations_of(replace(columns, fitness=fitness).rows(rows)), spec)
    starts = iteration_starts(columns)
    least = np.minimum.reduceat(fitness, starts) if len(starts) else fitness
    best_so_far = np.minimum.accumulate(least).tolist()
    both = np.isfinite(fitness) & np.isfinite(before)
    correlation = spearman(fitness[both], before[both]) if both.any() else None
    # One validation for all: a call for each iteration would dominate.
    return RankingView.model_validate(
        {
            "preference": spec.preference,
            "evaluations": len(columns),
            "infeasible": int(np.count_nonzero(walked & np.isinf(fitness))),
            "fitness_of_present_best": float(fitness[present[0]]) if len(present) else None,
            "correlation": correlation,
            "top": [
                {
                    **dict(view),
                    "rank": place,
                    "rank_before": int(ranks[row]) or None,
                    "fitness_before": before[row],
                }
                for place, (row, view) in enumerate(zip(rows.tolist(), views, strict=True), start=1)
            ],
            "best_so_far": [
                {"index": index, "fitness": value} for index, value in enumerate(best_so_far)
            ],
        }
    )


def _best_first(fitness: Floats) -> Rows:
    """Rows of finite fitness, best first; ties by age."""
    order = np.argsort(fitness, kind="stable")
    return order[np.isfinite(fitness[order])]


_DRAWN: Final = 512
"""Sampled exponents for a design that cannot win."""

_DRAW: Final = 0xE4B0

_AT_ONCE: Final = 4_000_000
"""Fitness values held in memory at a time."""

_RIVALS: Final = 32
"""Designs added to a linear program at a time."""

_ROUNDS: Final = 200
"""Limit on the number of linear programs; each has more rivals than the previous one."""

_DECIMALS: Final = 4
"""Of exponents, if rounding does not worsen the rank."""

_LP: Final = 1e-10
"""Tolerance of linear programs; the smallest that HiGHS supports."""

_TOLERANCE: Final = 1e-9
"""Tolerance of a lead relative to the linear program's, in the logarithm of fitness."""


class PreferenceFitView(View):
    """Rank of a design under a preference, among all designs of the job."""

    preference: Preference = Field(description="Its exponents sum to about 1.")
    biases_of: list[PreferenceOwner] = Field(description="Whose biases these are.")
    rank: int = Field(description="Of the design, from 1; equal designs share it.")
    fitness: float = Field(description="Of the design under it [1].", examples=[4.81])
    margin: Finite
    """Share by which the rival's fitness is worse, negative if it is better [1], for exponents that
    sum to 1; null without a rival."""
    rival: TradeOffDesignView | None = Field(description="The best of all other designs under it.")


class PreferenceForView(View):
    """Preferences under which a design wins its job, without simulation."""

    chosen: TradeOffDesignView = Field(description="The design.")
    on_front: bool = Field(description="Whether no other design of the job dominates it.")
    wins: bool = Field(description="Whether no design is better under the best of the fits.")
    certain: bool
    """Whether it wins, or it is proven that no exponents with these biases let it win; not proven
    for a job that judges in worlds or by the worst scenario."""
    fits: list[PreferenceFitView]
    """One for each set of biases, the job's own and those of A, B and C, the best first: the
    exponents of the widest margin, or else of the best rank."""


def preference_for(columns: EvaluationColumns, row: int, spec: JobSpec) -> PreferenceForView:
    """Find preferences that suit a design, one for each set of biases.

    For the job's own biases and those of table 4.5, the exponents maximize the design's lead. If it
    cannot win, they give its best rank among the linear program's solution, where it is least
    behind, and some samples.

    Over worlds, and for the worst scenario, the linear program is an approximation: the aggregate
    of a product is not the product of the aggregates.
    """
    plain = objective_vectors(columns, aggregation=spec.aggregation)

    def design(index: int) -> TradeOffDesignView:
        return TradeOffDesignView(**design_fields(columns, plain, spec, index))

    preferences: dict[PreferenceOwner, Preference] = {"job": spec.resolved_preference(), **NAMED}
    owners: dict[tuple[float, ...], list[PreferenceOwner]] = {}
    for name, preference in preferences.items():
        owners.setdefault(preference.bias, []).append(name)
    fits = []
    for bias, names in owners.items():
        vectors = objective_vectors(columns, bias, aggregation=spec.aggregation)
        others = np.flatnonzero((vectors != vectors[row]).any(axis=1))
        exponent = _exponents(vectors, row, others)
        candidates = []
        for exponents in (np.round(exponent, _DECIMALS).tolist(), exponent.tolist()):
            preference = Preference(bias=bias, exponent=tuple(exponents))
            fitness = fitness_by(columns, preference, aggregation=spec.aggregation)
            rank = int(np.count_nonzero(fitness[others] < fitness[row])) + 1
            candidates.append((rank, preference, fitness))
        rank, preference, fitness = min(candidates, key=lambda candidate: candidate[0])
        # The best of the rows that are not equal to the design.
        rival = int(others[fitness[others].argmin()]) if len(others) else row
        margin = None
        if rival != row and np.isfinite(fitness[rival]):
            with np.errstate(all="ignore"):
                ratio = float((fitness[rival] / fitness[row]) ** (1.0 / sum(preference.exponent)))
            margin = ratio - 1.0
        fit = PreferenceFitView(
            preference=preference,
            biases_of=names,
            rank=rank,
            fitness=float(fitness[row]),
            margin=margin,
            rival=None if margin is None else design(rival),
        )
        fits.append((rank, -(margin or 0.0), fit))
    fits.sort(key=lambda fit: fit[:2])
    better = (plain <= plain[row]).all(axis=1) & (plain < plain[row]).any(axis=1)
    wins = fits[0][0] == 1
    return PreferenceForView(
        chosen=design(row),
        on_front=not better.any(),
        wins=wins,
        certain=wins or (spec.worlds is None and spec.scenario_aggregate == "mean"),
        fits=[fit for *_, fit in fits],
    )


def _exponents(vectors: Floats, row: int, others: Rows) -> Floats:
    """(M,) exponents of the greatest lead or a good rank; (r, M) objectives with their biases."""
    rivals = vectors[others[np.isfinite(vectors[others]).all(axis=1)]]
    if not len(rivals):
        return np.full(vectors.shape[1], 1.0 / vectors.shape[1])
    candidates = np.vstack([vectors[row], rivals])
    # An objective of 0, which has no logarithm, counts as the least positive one.
    least = np.where(candidates > 0.0, candidates, np.inf).min(axis=0)
    logarithms = np.log(np.maximum(candidates, np.where(np.isfinite(least), least, 1.0)))
    lead = logarithms[1:] - logarithms[0]
    exponent, margin = _widest_lead(lead)
    return exponent if margin > 0.0 else _best_rank(lead, exponent)


def _widest_lead(lead: Floats) -> tuple[Floats, float]:
    """Return exponents that sum to 1 and maximize the least lead over (n, M) relative logs."""
    rivals = lead.argmin(axis=0)
    exponent, promised = _program(lead[rivals])
    for _ in range(_ROUNDS):
        leads = lead @ exponent
        if leads.min() >= promised - _TOLERANCE:
            break
        least = np.argpartition(leads, min(_RIVALS, len(leads)) - 1)[:_RIVALS]
        rivals = np.union1d(rivals, least)
        exponent, promised = _program(lead[rivals])
    return exponent, float((lead @ exponent).min())


def _program(lead: Floats) -> tuple[Floats, float]:
    """As `_widest_lead`, for few designs."""
    require_room_for_scipy()
    from scipy.optimize import linprog  # noqa: PLC0415 - slow to import

    count, size = lead.shape
    # Variables: exponents, and the least lead, which is maximized.
    solved = linprog(
        np.append(np.zeros(size), -1.0),
        A_ub=np.column_stack([-lead, np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.append(np.ones(size), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, 1.0)] * size + [(None, None)],
        options={"primal_feasibility_tolerance": _LP, "dual_feasibility_tolerance": _LP},
    )
    solution = np.asarray(solved.x, dtype=np.float64)
    return np.clip(solution[:size], 0.0, 1.0) + 0.0, float(solution[size])


def _best_rank(lead: Floats, exponent: Floats) -> Floats:
    """The best-ranking of these exponents, each objective alone, and samples."""
    size = lead.shape[1]
    # Uniform on the simplex.
    drawn = -np.log1p(-RandomNumbers(0, _DRAW).uniform(_DRAWN, size))
    drawn /= drawn.sum(axis=1, keepdims=True)
    candidates = np.vstack([exponent, np.eye(size), drawn])
    step = max(1, _AT_ONCE // len(lead))
    better = np.concatenate(
        [
            np.count_nonzero(lead @ candidates[first : first + step].T < 0.0, axis=0)
            for first in range(0, len(candidates), step)
        ]
    )
    return np.asarray(candidates[better.argmin()])


Figures = Annotated[dict[str, float], Field(examples=[{"energy": 77.4, "speed": 0.043}])]


class CandidatePreferenceView(View):
    """A preference, and what the design that is optimal under it is worth."""

    iteration: IterationIndex
    particle: Particle
    preference: Preference = Field(description="By which the optimum was searched for.")
    named: str | None = Field(description="A, B or C of table 4.5; null for any other.")
    recommended: bool = Field(description="Whether its fitness is the least.")
    fitness: float = Field(examples=[2.43])
    """Factor by which objectives may get worse [1]: exp(0.05 sensitivity) risk unevenness / (1 -
    failures)."""
    sensitivity: float
    """Robustness index of the optimum over its own variables [1]."""
    failures: float = Field(description="Share of held-out worlds in which a scenario failed [1].")
    risk: float
    """Mean of the objectives in the worst 5 % of these, by the nominal world [1]."""
    unevenness: float
    """Deviation of the changes from the reference over the scenarios, a factor [1]."""
    figures: Figures
    """Geometric means over the scenarios, in the units of table 4.1 and m/s; `slowest` is the speed
    in the slowest scenario."""
    changes: Figures = Field(description="By which share they differ from the reference's [1].")
    design: DesignValues


class CandidatePreferencesView(View):
    """Preferences judged by their optima: robustness, and evenness over the scenarios."""

    job: JobName
    worlds: int = Field(description="Held-out worlds in which each optimum was simulated.")
    samples: int = Field(description="Designs simulated around each optimum.")
    evaluated: int = Field(description="Preferences so far, including those without an optimum.")
    reference: DesignValues
    reference_figures: Figures = Field(description="Its figures, as of the candidates.")
    candidates: list[CandidatePreferenceView]
    """Those with a feasible optimum, of least fitness first."""


def candidate_preferences(
    job_id: str, spec: PreferencesSpec, columns: EvaluationColumns
) -> CandidatePreferencesView:
    """List the candidates of a search for preferences, from stored results."""
    order = _best_first(columns.fitness)
    if not len(order):
        raise Conflict(f"job {job_id} has no preference with a feasible optimum yet")
    names = [column.name for column in spec.columns]
    rows = [dict(zip(names, row, strict=True)) for row in columns.objectives[order, 0].tolist()]
    space, tuned = spec.design_space(), spec.tuning.design_space()
    candidates = []
    for place, values in zip(order.tolist(), rows, strict=True):
        preference = preference_of(space.shown(columns.designs[place].tolist()))
        assert preference is not None, "it has an optimum"  # noqa: S101
        named = preference_name(preference)
        relative = _as_speed({f.name: values[f"relative_{f.name}"] for f in FIGURES})
        candidates.append(
            CandidatePreferenceView(
                iteration=int(columns.iteration[place]),
                particle=int(columns.particle[place]),
                preference=preference,
                named=None if named == OWN else named,
                recommended=place == order[0],
                fitness=columns.fitness[place],
                figures=_as_speed({f.name: values[f.name] for f in FIGURES}),
                changes={name: value - 1.0 for name, value in relative.items()},
                design=tuned.shown([values[name] for name in tuned.names]),
                **{criterion.name: values[criterion.name] for criterion in CRITERIA},
            )
        )
    start = spec.tuning.start_positions()[:1]
    of_reference = {f.name: rows[0][f.name] / rows[0][f"relative_{f.name}"] for f in FIGURES}
    return CandidatePreferencesView(
        job=job_id,
        worlds=spec.worlds,
        samples=spec.samples,
        evaluated=len(columns),
        reference=tuned.shown(tuned.designs(start)[0].tolist()),
        reference_figures=_as_speed(of_reference),
        candidates=candidates,
    )


def _as_speed(figures: dict[str, float]) -> dict[str, float]:
    """Replace the reciprocal of the speed."""
    speed = 1.0 / figures.pop("reciprocal_speed")
    return {**figures, "speed": speed}
