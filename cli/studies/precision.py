"""Single against double precision: random designs walk in both, and are ranked by both."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.ranking import rank_correlation
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, Status
from gaitswarm.sim.robot import RobotVariant
from gaitswarm.sim.robot.description import ContactLaw
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.simulation import simulate
from gaitswarm.simulation_result import SimulationResult

if TYPE_CHECKING:
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.sim.robot.variant import RobotName

Floats = NDArray[np.float64]

LAWS: Final = get_args(ContactLaw)

BACKLASH: Final = (2.5, 1.0, 1.0)
"""Of coxa, femur and tibia, end to end [deg]."""

LONG: Final = 60.0
"""Length of a long walk, to the next whole cycle [s]."""

MILLIGRAM: Final = 1e-6
"""A load [kg] that changes the robot's mass by as much as single precision can tell."""

_RATIOS: Final = OBJECTIVE_NAMES[:5]
"""Objectives whose deviation is relative; f6, a difference of millimetres, is left out."""

_TOP: Final = 10


@dataclass(frozen=True, slots=True)
class Variant:
    """What random designs are put to.

    Attributes:
        name: for people.
        robot: that walks.
        scenarios: that it walks through.
        designs: how many there are.
    """

    name: str
    robot: RobotVariant
    scenarios: tuple[Scenario, ...]
    designs: int


@dataclass(frozen=True, slots=True)
class Spread:
    """Relative deviations: a quantile of each.

    Attributes:
        objectives: of single from double precision by objective, over all walks that both end [1].
        fitness: of single from double precision, over the designs that walk in all scenarios [1].
        sensitivity: of fitness in double precision, if the robot carries `MILLIGRAM` more [1].
    """

    objectives: dict[str, float]
    fitness: float
    sensitivity: float


@dataclass(frozen=True, slots=True)
class Agreement:
    """How far single precision agrees with double on the same designs.

    Attributes:
        name: of the variant.
        designs: how many there are.
        walked: of these, how many walk to the end of every scenario in both.
        statuses: walks that end in another way.
        median: of the deviations.
        most: what 99 % of them do not exceed.
        largest: of the deviations.
        correlation: Spearman's, of the fitness in both; None where it is undefined.
        same_of_ten: how many of the ten best are the same.
        loss: by how much the fitness of the design that single holds to be the best is above the
            least, both in double [1].
    """

    name: str
    designs: int
    walked: int
    statuses: int
    median: Spread
    most: Spread
    largest: Spread
    correlation: float | None
    same_of_ten: int
    loss: float


def variants(
    robot: RobotName, *, designs: int, with_backlash: int, long: int
) -> tuple[Variant, ...]:
    """What the study compares."""
    tight = [RobotVariant(name=robot, contact_law=law) for law in LAWS]
    loose = [RobotVariant(name=robot, contact_law=law, backlash=BACKLASH) for law in LAWS]
    lasting = tuple(
        s.model_copy(update={"cycles": float(np.ceil(LONG / s.cycle_time))}) for s in SCENARIOS
    )
    planned = [
        *(Variant(law, r, SCENARIOS, designs) for law, r in zip(LAWS, tight, strict=True)),
        *(
            Variant(f"{law}, backlash", r, SCENARIOS, with_backlash)
            for law, r in zip(LAWS, loose, strict=True)
        ),
        *(
            Variant(f"{law}, {LONG:g} s", r, lasting, long)
            for law, r in zip(LAWS, tight, strict=True)
        ),
    ]
    return tuple(variant for variant in planned if variant.designs)


def compare(variant: Variant, *, seed: int, cpus: int | None) -> Agreement:
    """Let random designs of the main Fuzzy-PI walk in both precisions."""
    space = JobSpec().design_space()
    share = np.random.default_rng(seed).random((variant.designs, len(space.low)))
    rows = space.simulated(space.designs(space.low + share * (space.high - space.low)))
    designs = dict(zip(space.names, rows.T, strict=True))
    heavier = tuple(s.model_copy(update={"load": s.load + MILLIGRAM}) for s in variant.scenarios)

    def walked(scenarios: tuple[Scenario, ...], precision: Precision) -> SimulationResult:
        return simulate(
            designs, scenarios=scenarios, robot=variant.robot, precision=precision, cpus=cpus
        )

    double, single = walked(variant.scenarios, "double"), walked(variant.scenarios, "single")
    return agreement(variant.name, double, single, walked(heavier, "double"))


def agreement(
    name: str, double: SimulationResult, single: SimulationResult, heavier: SimulationResult
) -> Agreement:
    """How far two results of the same designs agree."""
    both = (double.statuses == Status.OK) & (single.statuses == Status.OK)
    ratio = single.objectives[both] / double.objectives[both]
    deviations = np.abs(ratio[:, : len(_RATIOS)] - 1.0)
    fitness, found = double.fitness, single.fitness
    walked = np.isfinite(fitness) & np.isfinite(found)
    if not walked.any():
        raise InvalidRequest(
            f"none of {len(fitness)} random designs walks to the end ({name}); ask for more",
            field="designs",
        )
    of_fitness = _deviations(found, fitness)
    of_load = _deviations(heavier.fitness, fitness)
    best, best_found = _best(fitness), _best(found)
    return Agreement(
        name=name,
        designs=len(fitness),
        walked=int(walked.sum()),
        statuses=int((double.statuses != single.statuses).sum()),
        median=_spread(deviations, of_fitness, of_load, 0.5),
        most=_spread(deviations, of_fitness, of_load, 0.99),
        largest=_spread(deviations, of_fitness, of_load, 1.0),
        correlation=rank_correlation(found, fitness),
        same_of_ten=len(set(best.tolist()) & set(best_found.tolist())),
        loss=float(fitness[best_found[0]] / fitness[best[0]] - 1.0),
    )


def _deviations(values: Floats, reference: Floats) -> Floats:
    """Relative, where both are finite."""
    both = np.isfinite(values) & np.isfinite(reference)
    return np.abs(values[both] / reference[both] - 1.0)


def _best(fitness: Floats) -> NDArray[np.intp]:
    """The least finite fitness first."""
    ordered = np.argsort(fitness, kind="stable")
    return ordered[np.isfinite(fitness[ordered])][:_TOP]


def _spread(deviations: Floats, of_fitness: Floats, of_load: Floats, quantile: float) -> Spread:
    by_objective = np.quantile(deviations, quantile, axis=0).tolist()
    return Spread(
        dict(zip(_RATIOS, by_objective, strict=True)),
        float(np.quantile(of_fitness, quantile)),
        float(np.quantile(of_load, quantile)),
    )


def study_document(found: Iterable[Agreement]) -> list[dict[str, Any]]:
    """The study as JSON has it."""
    return [asdict(agreed) for agreed in found]


def study_tables(found: Sequence[Agreement]) -> tuple[Table, Table]:
    """Deviations, and what they do to statuses and ranking."""
    from gaitswarm.cli.tables.fitted import Table

    deviations, ranking = (
        Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1, 0, 0)) for _ in range(2)
    )
    for head in ("deviation %", "", *(f"f{n}" for n in range(1, 6)), "fitness", "1 mg"):
        deviations.add_column(head, justify="right" if head[:1] in "f1" else "left", no_wrap=True)
    for head in ("ranking", "designs", "other end", "rank corr.", "same of ten", "loss %"):
        ranking.add_column(head, justify="left" if head == "ranking" else "right", no_wrap=True)
    for agreed in found:
        rows = ((agreed.name, "median"), ("", "99 %"), ("", "largest"))
        spreads = (agreed.median, agreed.most, agreed.largest)
        for (name, of), spread in zip(rows, spreads, strict=True):
            values = [*spread.objectives.values(), spread.fitness, spread.sensitivity]
            deviations.add_row(name, of, *(f"{100.0 * value:.2g}" for value in values))
        ranking.add_row(
            agreed.name,
            str(agreed.designs),
            str(agreed.statuses),
            "–" if agreed.correlation is None else f"{agreed.correlation:.6f}",
            str(agreed.same_of_ten),
            f"{100.0 * agreed.loss:.2g}",
        )
    return deviations, ranking
