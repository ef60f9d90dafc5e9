"""Single against double precision: random designs simulated in both, and ranked by both."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Final, Literal

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.stats import rankdata

from gaitswarm import (
    OBJECTIVES,
    SCENARIOS,
    InvalidRequest,
    JobSpec,
    RobotVariant,
    Scenario,
    SimulationResult,
    Status,
    simulate,
)
from gaitswarm_research import options

Floats = NDArray[np.float64]

LAWS: Final = ("linear_zone", "karnopp", "stick", "dead_zone")
"""Laws of friction between soles and ground."""

BACKLASH: Final = (2.5, 1.0, 1.0)
"""Of coxa, femur and tibia, end to end [deg]."""

LONG: Final = 60.0
"""Length of a long walk, to the next whole cycle [s]."""

MILLIGRAM: Final = 1e-6
"""A load [kg] that changes the robot's mass by as much as single precision can tell."""

_RATIOS: Final = tuple(objective.name for objective in OBJECTIVES[:5])
"""Objectives whose deviation is relative; f6, a difference of millimetres, is left out."""

_TOP: Final = 10


@dataclass(frozen=True, slots=True)
class Variant:
    """Robot and scenarios that a number of random designs are simulated with."""

    name: str
    robot: RobotVariant
    scenarios: tuple[Scenario, ...]
    designs: int


@dataclass(frozen=True, slots=True)
class Spread:
    """A quantile of relative deviations [1].

    Attributes:
        objectives: Of single from double precision by objective, over the simulations that end in
            both.
        fitness: Of single from double precision, over the designs that end in all scenarios.
        sensitivity: Of the fitness in double precision when the robot carries `MILLIGRAM` more.
    """

    objectives: dict[str, float]
    fitness: float
    sensitivity: float


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of single with double precision on the same designs.

    Attributes:
        walked: Designs that end in every scenario in both.
        statuses: Simulations whose status differs.
        median: Median of the deviations.
        most: 99 % quantile of the deviations.
        largest: Largest deviation.
        correlation: Spearman's, of the fitness in both; None where it is undefined.
        same_of_ten: How many of the ten best are the same.
        loss: Excess of the fitness of single's best design over the least, both in double [1].
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


def variants(robot: str, *, designs: int, with_backlash: int, long: int) -> tuple[Variant, ...]:
    """List what the study compares."""
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
    """Simulate random designs of the main Fuzzy-PI in both precisions."""
    space = JobSpec().design_space()
    share = np.random.default_rng(seed).random((variant.designs, len(space.box.low)))
    rows = space.simulated(space.designs(space.box.low + share * (space.box.high - space.box.low)))
    designs = dict(zip(space.names, rows.T, strict=True))
    heavier = tuple(s.model_copy(update={"load": s.load + MILLIGRAM}) for s in variant.scenarios)

    def simulated(
        scenarios: tuple[Scenario, ...], precision: Literal["single", "double"]
    ) -> SimulationResult:
        return simulate(
            designs, scenarios=scenarios, robot=variant.robot, precision=precision, cpus=cpus
        )

    double, single = (simulated(variant.scenarios, digits) for digits in ("double", "single"))
    return agreement_of(variant.name, double, single, simulated(heavier, "double"))


def agreement_of(
    name: str, double: SimulationResult, single: SimulationResult, heavier: SimulationResult
) -> Agreement:
    """Compare two results of the same designs."""
    both = (double.statuses == Status.OK) & (single.statuses == Status.OK)
    ratio = single.objectives[both] / double.objectives[both]
    deviations = np.abs(ratio[:, : len(_RATIOS)] - 1.0)
    fitness, other = double.fitness, single.fitness
    walked = np.isfinite(fitness) & np.isfinite(other)
    if not walked.any():
        raise InvalidRequest(
            f"none of {len(fitness)} random designs walks to the end ({name}); raise the number",
            field="designs",
        )
    of_fitness = _deviations(other, fitness)
    of_load = _deviations(heavier.fitness, fitness)
    best, best_in_single = _best(fitness), _best(other)
    return Agreement(
        name=name,
        designs=len(fitness),
        walked=int(walked.sum()),
        statuses=int((double.statuses != single.statuses).sum()),
        median=_spread(deviations, of_fitness, of_load, 0.5),
        most=_spread(deviations, of_fitness, of_load, 0.99),
        largest=_spread(deviations, of_fitness, of_load, 1.0),
        correlation=_rank_correlation(other[walked], fitness[walked]),
        same_of_ten=len(set(best.tolist()) & set(best_in_single.tolist())),
        loss=float(fitness[best_in_single[0]] / fitness[best[0]] - 1.0),
    )


def _rank_correlation(one: Floats, other: Floats) -> float | None:
    """Spearman's rank correlation; None where all values of one side are equal."""
    a, b = (rankdata(values) for values in (one, other))
    a, b = a - a.mean(), b - b.mean()
    scale = math.sqrt(float((a * a).sum()) * float((b * b).sum()))
    return float((a * b).sum()) / scale if scale > 0.0 else None


def _deviations(values: Floats, reference: Floats) -> Floats:
    """Relative deviations where both are finite."""
    both = np.isfinite(values) & np.isfinite(reference)
    return np.abs(values[both] / reference[both] - 1.0)


def _best(fitness: Floats) -> NDArray[np.intp]:
    """Indices of the best designs, the least finite fitness first."""
    ordered = np.argsort(fitness, kind="stable")
    return ordered[np.isfinite(fitness[ordered])][:_TOP]


def _spread(deviations: Floats, of_fitness: Floats, of_load: Floats, quantile: float) -> Spread:
    by_objective = np.quantile(deviations, quantile, axis=0).tolist()
    return Spread(
        dict(zip(_RATIOS, by_objective, strict=True)),
        float(np.quantile(of_fitness, quantile)),
        float(np.quantile(of_load, quantile)),
    )


def study_tables(agreements: Sequence[Agreement]) -> tuple[Table, Table]:
    """Tables of the deviations, and of what they do to statuses and ranking."""
    deviations, ranking = (
        Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1, 0, 0)) for _ in range(2)
    )
    for head in ("deviation %", "", *(f"f{n}" for n in range(1, 6)), "fitness", "1 mg"):
        deviations.add_column(head, justify="right" if head[:1] in "f1" else "left", no_wrap=True)
    for head in ("ranking", "designs", "other end", "rank corr.", "same of ten", "loss %"):
        ranking.add_column(head, justify="left" if head == "ranking" else "right", no_wrap=True)
    for agreement in agreements:
        rows = ((agreement.name, "median"), ("", "99 %"), ("", "largest"))
        spreads = (agreement.median, agreement.most, agreement.largest)
        for (name, of), spread in zip(rows, spreads, strict=True):
            values = [*spread.objectives.values(), spread.fitness, spread.sensitivity]
            deviations.add_row(name, of, *(f"{100.0 * value:.2g}" for value in values))
        ranking.add_row(
            agreement.name,
            str(agreement.designs),
            str(agreement.statuses),
            "–" if agreement.correlation is None else f"{agreement.correlation:.6f}",
            str(agreement.same_of_ten),
            f"{100.0 * agreement.loss:.2g}",
        )
    return deviations, ranking


def precision(
    designs: Annotated[
        int, typer.Option(min=2, help="Random designs for each law of friction.")
    ] = 1000,
    backlash_designs: Annotated[
        int, typer.Option(min=0, help="Random designs with backlash, at 40 kHz; 0 for none.")
    ] = 100,
    long_designs: Annotated[
        int, typer.Option(min=0, help="Random designs over 60 s; 0 for none.")
    ] = 100,
    robot: Annotated[
        str | None, typer.Option(help="Name of a shipped robot. Default: the default robot.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the designs.")] = 1,
    cpus: options.Cpus = None,
    as_json: options.Json = False,
) -> None:
    """Simulate random designs in single and in double precision, and compare.

    In the six scenarios, with every law of friction, with backlash, and over 60 s; fitness is that
    of preference A.
    """
    planned = variants(
        robot or RobotVariant().name,
        designs=designs,
        with_backlash=backlash_designs,
        long=long_designs,
    )
    agreements = []
    for variant in planned:
        options.stderr.print(f"{variant.name}: {variant.designs} designs")
        agreements.append(compare(variant, seed=seed, cpus=cpus))
    if as_json:
        typer.echo(json.dumps([asdict(agreement) for agreement in agreements], indent=2))
        return
    for table in study_tables(agreements):
        Console().print(table)
    options.stderr.print(
        "deviation: of single from double precision\n"
        "1 mg: of the fitness in double precision when the robot carries a milligram more\n"
        "loss: excess of the fitness of single's best design over the least, both in double"
    )
