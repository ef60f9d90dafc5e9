"""Evaluation of certificates: statistics over worlds, and comparison of engines"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Final, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.statistics import spearman
from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.certificate import (
    LEVEL,
    CertificateSpec,
    conditional_value_at_risk,
)
from gaitswarm.services.optimizer.jobs.preference import HEIGHT_LOSS, Judgement, Preference
from gaitswarm.services.optimizer.views import (
    DesignValues,
    Finite,
    IterationIndex,
    JobName,
    Particle,
    StatusName,
    View,
)
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.memory import require_room_for_scipy
from gaitswarm.sim.mujoco.engines import ENGINES
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotSource

T = TypeVar("T")

QUANTILES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)

MOST_WORST: Final = 1000
"""Limit on the number of worst worlds listed."""

_SEED: Final = "world_seed"
"""A perturbation without order."""

_NORMAL: Final = 1.959963984540054
"""0.975 quantile of the standard normal distribution."""


class ProportionView(View):
    """A count over worlds with its confidence interval."""

    count: int = Field(description="Worlds in which it happened.", examples=[3])
    share: float = Field(description="Of all worlds [1].", examples=[0.003])
    low: float
    """Lower end of the exact interval of 95 % (Clopper and Pearson 1934) [1]."""
    high: float = Field(description="Upper end [1].", examples=[0.0087])


class SpreadView(View):
    """Distribution of a quantity over worlds; lower is better, and a failure is worse than any."""

    quantiles: list[Finite] = Field(examples=[[19.8, 20.4, 21.0, 21.9, 24.2]])
    """At the certificate's `quantiles`; null where a quantile is a failure."""
    worst: Finite = Field(description="The greatest without failures; null if all failed.")
    cvar: Finite = Field(examples=[26.3])
    """Conditional value at risk: mean of the worst 5 % of worlds. A failure counts as `worst`, so
    that with failures this is a lower bound; null if all failed."""
    tail_failed: float = Field(description="Share of these 5 % that failed [1].", examples=[0.06])
    nominal: Finite = Field(description="In the nominal world; null after a failure.")


Objectives = Field(
    description="By name, in the units of the job's `objectives`; height_loss by its size."
)
Utility = Field(description="By the job's preference (eq. 3.8, 4.1) [1].")


class CertifiedScenarioView(View):
    """One scenario over all worlds."""

    held_out: bool
    """Whether it is one of the spec's `held_out`, which the design was not tuned in; without them a
    preset for which no design of the thesis was optimized."""
    statuses: dict[StatusName, int] = Field(examples=[{"ok": 997, "fell": 3}])
    """Simulations by status; missing ones are 0."""
    fell: ProportionView = Field(description="How often the robot fell.")
    failed: ProportionView
    """Failures of any kind: fell, diverged, stalled or out of reach."""
    utility: Annotated[SpreadView, Utility]
    objectives: Annotated[dict[str, SpreadView], Objectives]


class WorldView(View):
    """Results of the design in one world."""

    world: int = Field(description="Number of the world, from 0.", examples=[417])
    iteration: IterationIndex
    particle: Particle
    fitness: Finite = Field(examples=[31.7])
    """Geometric mean over the scenarios (eq. 4.2) [1]; null if one failed."""
    failures: dict[str, StatusName] = Field(examples=[{"slope-fast": "fell"}])
    """Failed scenarios with their statuses."""
    scenario: str = Field(examples=["slope-fast"])
    """The worst scenario: one that failed, or else the one whose utility is the greatest multiple
    of that in the nominal world."""
    values: dict[str, float | str]
    """Value of every perturbation that is drawn or fixed, by name."""
    replay: str = Field(
        description="The command that simulates the design in this world again.",
        examples=["gaitswarm certify k2q7zr5dm9xw --replay 417 --scenarios slope-fast"],
    )


class InfluenceView(View):
    """Correlation of a perturbation with the outcome."""

    name: str = Field(description="Name of the perturbation.", examples=["friction"])
    correlation: float = Field(examples=[-0.62])
    """Spearman's, of its value with the fitness, failed worlds sharing the last rank [1]. Positive:
    greater values go with worse outcomes."""
    low: float = Field(description="Lower end of its interval of 95 % [1].", examples=[-0.66])
    high: float = Field(description="Upper end [1].", examples=[-0.58])


class ComparedView(View):
    """One quantity in the nominal world, by our engine and by another one."""

    ours: Finite = Field(description="By our engine; null after a failure.", examples=[7.805])
    theirs: Finite = Field(description="By the other engine; null after a failure.")
    difference: Finite = Field(examples=[-0.0003])
    """Excess of the other engine's, as a share of ours [1]; null if either is, or if ours is 0."""


class ComparedScenarioView(View):
    """One scenario in the nominal world, by our engine and by another one."""

    ours: StatusName = Field(description="Status by our engine.", examples=["ok"])
    theirs: StatusName = Field(description="Status by the other engine.", examples=["ok"])
    utility: Annotated[ComparedView, Utility]
    objectives: Annotated[dict[str, ComparedView], Objectives]


class ComparedEngineView(View):
    """Results of another engine in the nominal world."""

    description: str = Field(description="Properties of the engine.", examples=[ENGINES["mujoco"]])
    fitness: ComparedView = Field(description="Over all scenarios (eq. 4.2) [1].")
    scenarios: dict[str, ComparedScenarioView]
    """By name of the scenario, in the job's order."""


class CertificateView(View):
    """Results of a design over all worlds; no guarantee for other worlds."""

    job: JobName
    robot: RobotSource = Field(description="Simulated robot.")
    controller: str = Field(description="Controller that drives it.", examples=["fuzzy-pi"])
    design: DesignValues
    preference: Preference = Field(description="By which utilities and fitness were computed.")
    seed: int = Field(description="Of the worlds.", examples=[1])
    worlds: int = Field(description="Worlds simulated so far.", examples=[1000])
    worlds_planned: int = Field(description="Worlds of the whole job.", examples=[1000])
    level: float = LEVEL
    """Of intervals and of the conditional value at risk [1]."""
    quantiles: list[float] = Field(examples=[list(QUANTILES)])
    """Quantiles of the distributions [1]."""
    fitness: SpreadView
    """Over all scenarios, the geometric mean of utilities (eq. 4.2) [1]."""
    fell: ProportionView = Field(description="Worlds with a fall in at least one scenario.")
    failed: ProportionView = Field(description="Worlds with a failure in at least one scenario.")
    scenarios: dict[str, CertifiedScenarioView]
    """By name of the scenario, in the job's order."""
    worst: list[WorldView]
    """The worst worlds, those with most failed scenarios first."""
    influences: list[InfluenceView]
    """Correlations of perturbations with the outcome, the strongest first."""
    engines: dict[str, ComparedEngineView] = Field(default_factory=dict)
    """Results of the job's `engines` in the nominal world, by name."""


def certificate(
    job_id: str,
    spec: CertificateSpec,
    columns: EvaluationColumns,
    *,
    worlds: int | None = None,
    most: int = 5,
) -> CertificateView:
    """Evaluate a certificate's simulations in the first `worlds` worlds; list the `most` worst."""
    first = spec.nominal_rows
    walked = columns.rows(slice(None if worlds is None else first + worlds))
    taken = walked.rows(np.delete(np.arange(len(walked)), slice(1, first)))
    if len(taken) < 2:
        raise Conflict("no drawn world has been simulated yet; try again after the first iteration")
    judged = spec.judge(taken.objectives, taken.failed)
    utilities, values = judged.utilities, _sizes(taken.objectives)
    drawn = taken.rows(slice(1, None))
    fell = np.asarray(drawn.statuses == Status.FELL)
    return CertificateView(
        job=job_id,
        robot=spec.robot,
        controller=spec.controller,
        design=dict(spec.design),
        preference=spec.resolved_preference(),
        seed=spec.seed,
        worlds=len(drawn),
        worlds_planned=spec.worlds,
        quantiles=list(QUANTILES),
        fitness=_spread(judged.fitness),
        fell=proportion(np.asarray(fell.any(axis=1))),
        failed=proportion(np.asarray(drawn.failed.any(axis=1))),
        scenarios={
            name: CertifiedScenarioView(
                held_out=name in spec.held_out_names,
                statuses={
                    Status(code).label: int(np.count_nonzero(drawn.statuses[:, k] == code))
                    for code in np.unique(drawn.statuses[:, k]).tolist()
                },
                fell=proportion(fell[:, k]),
                failed=proportion(drawn.failed[:, k]),
                utility=_spread(utilities[:, k]),
                objectives=_by_objective(spec, _spread, values[:, k]),
            )
            for k, name in enumerate(spec.case_names)
        },
        worst=_worst(job_id, spec, taken, judged, most),
        influences=_influences(spec, drawn.designs, judged.fitness[1:]),
        engines=_engines(spec, columns.rows(slice(first))),
    )


def _sizes(objectives: Floats) -> Floats:
    """(r, K, m) objectives, with the absolute value of the height loss."""
    values = objectives.copy()
    values[:, :, HEIGHT_LOSS] = np.abs(values[:, :, HEIGHT_LOSS])
    return values


def _by_objective(
    spec: CertificateSpec, view: Callable[[Floats], T], values: Floats
) -> dict[str, T]:
    """Return views of the columns of values (n, m)."""
    return {o.name: view(column) for o, column in zip(spec.objectives, values.T, strict=False)}


def _engines(spec: CertificateSpec, nominal: EvaluationColumns) -> dict[str, ComparedEngineView]:
    """Compare other engines with ours; nominal: a row for each, ours first."""
    judged = spec.judge(nominal.objectives, nominal.failed)
    utilities, values = judged.utilities, _sizes(nominal.objectives)
    statuses = [[Status(code).label for code in row] for row in nominal.statuses.tolist()]
    return {
        name: ComparedEngineView(
            description=ENGINES[name],
            fitness=_compared(judged.fitness[[0, row]]),
            scenarios={
                case: ComparedScenarioView(
                    ours=statuses[0][k],
                    theirs=statuses[row][k],
                    utility=_compared(utilities[[0, row], k]),
                    objectives=_by_objective(spec, _compared, values[[0, row], k]),
                )
                for k, case in enumerate(spec.case_names)
            },
        )
        for row, name in enumerate(spec.engines, start=1)
    }


def _compared(pair: Floats) -> ComparedView:
    """pair (2,): NaN or +inf for a failed simulation."""
    ours, theirs = np.where(np.isfinite(pair), pair, np.nan).tolist()
    difference = (theirs - ours) / ours if ours else math.nan
    return ComparedView(ours=ours, theirs=theirs, difference=difference)


def proportion(happened: NDArray[np.bool_]) -> ProportionView:
    """Return the proportion of worlds in which an event (n,) occurred, n >= 1."""
    # Its import takes a quarter of a second.
    require_room_for_scipy()
    from scipy.special import betaincinv  # noqa: PLC0415

    n, k = len(happened), int(np.count_nonzero(happened))
    tail = 0.5 * (1.0 - LEVEL)
    low = float(betaincinv(k, n - k + 1, tail)) if k > 0 else 0.0
    high = float(betaincinv(k + 1, n - k, 1.0 - tail)) if k < n else 1.0
    return ProportionView(count=k, share=k / n, low=low, high=high)


def _spread(values: Floats) -> SpreadView:
    """values (1 + n,), the nominal world first; NaN or +inf for a failed simulation."""
    nominal, drawn = float(values[0]), values[1:]
    failed = ~np.isfinite(drawn)
    quantiles = np.quantile(np.where(failed, np.inf, drawn), QUANTILES, method="inverted_cdf")
    worst = cvar = math.nan
    if not failed.all():
        worst = float(drawn[~failed].max())
        cvar = conditional_value_at_risk(np.where(failed, worst, drawn))
    tail = (1.0 - LEVEL) * len(drawn)
    return SpreadView(
        quantiles=quantiles.tolist(),
        worst=worst,
        cvar=cvar,
        tail_failed=min(1.0, int(failed.sum()) / max(tail, 1.0)),
        nominal=nominal,
    )


def _worst(
    job_id: str, spec: CertificateSpec, taken: EvaluationColumns, judged: Judgement, most: int
) -> list[WorldView]:
    failed, logarithms = taken.failed, judged.log_utilities
    # The last key sorts first; ties keep their order.
    order = np.lexsort((-judged.fitness[1:], -failed[1:].sum(axis=1)))[:most]
    space, names = spec.design_space(), spec.case_names
    drawn = spec.world_space().names
    nominal = np.where(np.isfinite(logarithms[0]), logarithms[0], 0.0)
    results = []
    for row in (order + 1).tolist():
        statuses = zip(names, taken.statuses[row].tolist(), strict=True)
        failures = {name: Status(code).label for name, code in statuses if code != Status.OK}
        scenario = next(iter(failures), names[int(np.argmax(logarithms[row] - nominal))])
        shown = space.shown(taken.designs[row].tolist())
        results.append(
            WorldView(
                world=row - 1,
                iteration=int(taken.iteration[row]),
                particle=int(taken.particle[row]),
                fitness=float(judged.fitness[row]),
                failures=failures,
                scenario=scenario,
                values={name: shown[name] for name in shown if name in drawn},
                replay=f"gaitswarm certify {job_id} --replay {row - 1} --scenarios {scenario}",
            )
        )
    return results


def _influences(spec: CertificateSpec, worlds: Floats, fitness: Floats) -> list[InfluenceView]:
    """worlds: (n, v) drawn values."""
    results = []
    for variable, values in zip(spec.world_space().variables, worlds.T, strict=False):
        correlation = spearman(values, fitness)
        if variable.name != _SEED and not math.isnan(correlation):
            low, high = _interval(correlation, len(worlds))
            results.append(
                InfluenceView(name=variable.name, correlation=correlation, low=low, high=high)
            )
    return sorted(results, key=lambda influence: -abs(influence.correlation))


def _interval(correlation: float, n: int) -> tuple[float, float]:
    """Interval of Spearman's correlation by Fisher's z, its variance of Bonett and Wright (2000)"""
    if n <= 3 or abs(correlation) >= 1.0:
        return (-1.0, 1.0) if n <= 3 else (correlation, correlation)
    z = math.atanh(correlation)
    half = _NORMAL * math.sqrt((1.0 + 0.5 * correlation * correlation) / (n - 3))
    return math.tanh(z - half), math.tanh(z + half)
