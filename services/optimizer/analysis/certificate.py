"""Evaluation of certificates: statistics over worlds, and comparison of engines"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.statistics import spearman
from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.preference import HEIGHT_LOSS
from gaitswarm.sim.memory import require_room_for_scipy
from gaitswarm.sim.mujoco.engines import EngineName
from gaitswarm.sim.outcome import Status

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Compared:
    """One quantity by two engines; NaN after a failed simulation."""

    ours: float
    theirs: float

    @property
    def difference(self) -> float:
        """Relative difference of the other engine [1]; NaN if ours is 0."""
        return (self.theirs - self.ours) / self.ours if self.ours else float("nan")


@dataclass(frozen=True, slots=True)
class ComparedCase:
    """One scenario by two engines.

    Attributes:
        objectives: f1 to f6 of table 4.1; f6 by its absolute value.
    """

    name: str
    ours: Status
    theirs: Status
    utility: Compared
    objectives: tuple[Compared, ...]


@dataclass(frozen=True, slots=True)
class ComparedEngine:
    """Another engine, in the nominal world of all scenarios."""

    name: EngineName
    fitness: Compared
    cases: tuple[ComparedCase, ...]


def compared_engines(
    spec: CertificateSpec, nominal: EvaluationColumns
) -> tuple[ComparedEngine, ...]:
    judged = spec.judge(nominal.objectives, nominal.failed)
    utilities = judged.utilities
    values = nominal.objectives.copy()
    values[:, :, HEIGHT_LOSS] = np.abs(values[:, :, HEIGHT_LOSS])
    return tuple(
        ComparedEngine(
            name,
            _compared(judged.fitness[[0, row]]),
            tuple(
                ComparedCase(
                    case,
                    Status(int(nominal.statuses[0, k])),
                    Status(int(nominal.statuses[row, k])),
                    _compared(utilities[[0, row], k]),
                    tuple(map(_compared, values[[0, row], k].T)),
                )
                for k, case in enumerate(spec.case_names)
            ),
        )
        for row, name in enumerate(spec.engines, start=1)
    )


def _compared(pair: Floats) -> Compared:
    """pair (2,): NaN or +inf for a failed simulation."""
    ours, theirs = np.where(np.isfinite(pair), pair, np.nan).tolist()
    return Compared(ours, theirs)


QUANTILES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)

LEVEL: Final = 0.95
"""Level of the conditional value at risk and of all intervals."""

MOST_WORST: Final = 1000
"""Limit on the number of worst worlds listed."""

_SEED: Final = "world_seed"
"""A perturbation without order."""

_NORMAL: Final = 1.959963984540054
"""0.975 quantile of the standard normal distribution."""


@dataclass(frozen=True, slots=True)
class Proportion:
    """A binomial proportion over worlds.

    Attributes:
        count: worlds in which the event occurred.
        low: lower end of the exact 95 % interval (Clopper and Pearson 1934).
    """

    count: int
    worlds: int
    low: float
    high: float

    @property
    def share(self) -> float:
        return self.count / self.worlds


@dataclass(frozen=True, slots=True)
class Spread:
    """Distribution of a minimized quantity over worlds; failures are worse than any value.

    Attributes:
        quantiles: at `QUANTILES`, over all worlds; +inf where a quantile is a failure.
        worst: greatest value of successful simulations, NaN if all failed.
        cvar: mean of the worst 5 % of worlds, the conditional value at risk at 0.95. A failure
            counts as `worst`: with failures in the tail this is a lower bound.
        tail_failed: failed share of that tail.
        nominal: in the nominal world, NaN after a failure.
    """

    quantiles: tuple[float, ...]
    worst: float
    cvar: float
    tail_failed: float
    nominal: float


@dataclass(frozen=True, slots=True)
class CaseResult:
    """One scenario over all worlds.

    Attributes:
        objectives: f1 to f6 of table 4.1; f6 by its absolute value.
    """

    name: str
    statuses: dict[Status, int]
    fell: Proportion
    failed: Proportion
    utility: Spread
    objectives: tuple[Spread, ...]


@dataclass(frozen=True, slots=True)
class WorldOutcome:
    """A design's results in one world.

    Attributes:
        index: of the world, from 0.
        fitness: geometric mean over the scenarios, +inf if one failed.
        failures: failed scenarios with their statuses.
        scenario: worst scenario: a failed one, else the one whose utility is the greatest multiple
            of that in the nominal world.
        values: drawn and fixed perturbations, by name.
    """

    index: int
    iteration: int
    particle: int
    fitness: float
    failures: tuple[tuple[str, Status], ...]
    scenario: str
    values: dict[str, float | str]


@dataclass(frozen=True, slots=True)
class Influence:
    """Rank correlation of a perturbation with the fitness.

    Attributes:
        correlation: Spearman's; worlds with a failed scenario share the last rank. Positive:
            greater values go with worse results.
        low: lower end of the 95 % interval (Bonett and Wright 2000).
    """

    name: str
    correlation: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Certificate:
    """Results of a design in many worlds.

    Attributes:
        fitness: over all scenarios.
        fell: worlds in which the robot fell in at least one scenario.
        failed: worlds in which at least one scenario failed.
        worst: those with the most failed scenarios first.
    """

    worlds: int
    cases: tuple[CaseResult, ...]
    fitness: Spread
    fell: Proportion
    failed: Proportion
    worst: tuple[WorldOutcome, ...]
    influences: tuple[Influence, ...]
    engines: tuple[ComparedEngine, ...] = ()


def certificate(
    spec: CertificateSpec, columns: EvaluationColumns, *, worlds: int | None = None, most: int = 5
) -> Certificate:
    """Evaluate a certificate's simulations."""
    first = spec.nominal_rows
    nominal = columns.rows(slice(first))
    walked = columns.rows(slice(None if worlds is None else first + worlds))
    taken = walked.rows(np.delete(np.arange(len(walked)), slice(1, first)))
    if len(taken) < 2:
        raise Conflict("no drawn world has been simulated yet; try again after the first iteration")
    values = taken.objectives.copy()
    values[:, :, HEIGHT_LOSS] = np.abs(values[:, :, HEIGHT_LOSS])
    judged = spec.judge(taken.objectives, taken.failed)
    utilities = judged.utilities
    drawn = taken.rows(slice(1, None))
    fell = np.asarray(drawn.statuses == Status.FELL)
    return Certificate(
        worlds=len(drawn),
        cases=tuple(
            _case(name, drawn.statuses[:, k], utilities[:, k], values[:, k])
            for k, name in enumerate(spec.case_names)
        ),
        fitness=_spread(judged.fitness),
        fell=proportion(np.asarray(fell.any(axis=1))),
        failed=proportion(np.asarray(drawn.failed.any(axis=1))),
        worst=_worst(spec, taken, judged.log_utilities, judged.fitness, most),
        influences=_influences(spec, drawn.designs, judged.fitness[1:]),
        engines=compared_engines(spec, nominal),
    )


def proportion(happened: NDArray[np.bool_]) -> Proportion:
    """Return the proportion of worlds in which an event (n,) occurred, n >= 1."""
    # Its import takes a quarter of a second.
    require_room_for_scipy()
    from scipy.special import betaincinv  # noqa: PLC0415

    n, k = len(happened), int(np.count_nonzero(happened))
    tail = 0.5 * (1.0 - LEVEL)
    low = float(betaincinv(k, n - k + 1, tail)) if k > 0 else 0.0
    high = float(betaincinv(k + 1, n - k, 1.0 - tail)) if k < n else 1.0
    return Proportion(k, n, low, high)


def conditional_value_at_risk(values: Floats, level: float = LEVEL) -> float:
    """Mean of the worst of (n,) values (Rockafellar and Uryasev 2002), the greatest being worst."""
    ordered = np.sort(values)[::-1].tolist()
    size = max((1.0 - level) * len(ordered), 1.0)
    whole = math.floor(size + 1e-9)
    part = size - whole
    total = math.fsum(ordered[:whole])
    if part > 1e-9:
        total += part * ordered[whole]
    return total / size


def _case(name: str, statuses: NDArray[np.uint8], utility: Floats, values: Floats) -> CaseResult:
    """utility (1 + n,) and values (1 + n, 6) start with the nominal world; statuses (n,) do not."""
    occurring, counts = np.unique(statuses, return_counts=True)
    return CaseResult(
        name=name,
        statuses={
            Status(s): int(c) for s, c in zip(occurring.tolist(), counts.tolist(), strict=True)
        },
        fell=proportion(statuses == Status.FELL),
        failed=proportion(statuses != Status.OK),
        utility=_spread(utility),
        objectives=tuple(_spread(column) for column in values.T),
    )


def _spread(values: Floats) -> Spread:
    """values (1 + n,), the nominal world first; NaN or +inf for a failed simulation."""
    nominal, drawn = float(values[0]), values[1:]
    failed = ~np.isfinite(drawn)
    filled = np.where(failed, np.inf, drawn)
    quantiles = np.quantile(filled, QUANTILES, method="inverted_cdf").tolist()
    worst = math.nan if failed.all() else float(drawn[~failed].max())
    tail = (1.0 - LEVEL) * len(drawn)
    return Spread(
        quantiles=tuple(quantiles),
        worst=worst,
        cvar=math.nan
        if failed.all()
        else conditional_value_at_risk(np.where(failed, worst, drawn)),
        tail_failed=min(1.0, int(failed.sum()) / max(tail, 1.0)),
        nominal=nominal if math.isfinite(nominal) else math.nan,
    )


def _worst(
    spec: CertificateSpec,
    taken: EvaluationColumns,
    log_utilities: Floats,
    fitness: Floats,
    most: int,
) -> tuple[WorldOutcome, ...]:
    failed = taken.failed[1:]
    # The last key sorts first; ties keep their order.
    order = np.lexsort((-fitness[1:], -failed.sum(axis=1)))[:most]
    space, names = spec.design_space(), spec.case_names
    drawn = set(spec.world_space().names)
    nominal = np.where(np.isfinite(log_utilities[0]), log_utilities[0], 0.0)
    results = []
    for index in order.tolist():
        row = index + 1
        failures = tuple(
            (names[k], Status(int(taken.statuses[row, k]))) for k in np.flatnonzero(failed[index])
        )
        results.append(
            WorldOutcome(
                index=index,
                iteration=int(taken.iteration[row]),
                particle=int(taken.particle[row]),
                fitness=float(fitness[row]),
                failures=failures,
                scenario=failures[0][0]
                if failures
                else names[int(np.argmax(log_utilities[row] - nominal))],
                values={
                    name: value
                    for name, value in space.shown(taken.designs[row].tolist()).items()
                    if name in drawn
                },
            )
        )
    return tuple(results)


def _influences(spec: CertificateSpec, worlds: Floats, fitness: Floats) -> tuple[Influence, ...]:
    """worlds: (n, v) drawn values."""
    results = []
    for j, variable in enumerate(spec.world_space().variables):
        if variable.name == _SEED:
            continue
        correlation = spearman(worlds[:, j], fitness)
        if not math.isnan(correlation):
            results.append(
                Influence(variable.name, correlation, *_interval(correlation, len(worlds)))
            )
    return tuple(sorted(results, key=lambda influence: -abs(influence.correlation)))


def _interval(correlation: float, n: int) -> tuple[float, float]:
    """Interval of Spearman's correlation by Fisher's z, with the variance of Bonett and Wright
    (2000).
    """
    if n <= 3 or abs(correlation) >= 1.0:
        return (-1.0, 1.0) if n <= 3 else (correlation, correlation)
    z = math.atanh(correlation)
    half = _NORMAL * math.sqrt((1.0 + 0.5 * correlation * correlation) / (n - 3))
    return math.tanh(z - half), math.tanh(z + half)
