"""Mixed-variable genetic algorithm of the library pymoo."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.plugins import Proposals, RandomNumbers, SearchSettings, Space, from_generator

if TYPE_CHECKING:
    from pymoo.core.mixed import MixedVariableGA
    from pymoo.core.problem import Problem

Floats = NDArray[np.float64]


class GaSettings(SearchSettings):
    """Settings of the genetic algorithm."""

    name: Literal["ga"] = "ga"
    population: int = Field(
        default=25,
        ge=2,
        le=10_000,
        description="Members of the population; the best so far survive.",
    )
    offspring: int = Field(
        default=25, ge=1, le=10_000, description="New designs of each generation."
    )
    selection: Literal["random", "tournament"] = Field(
        default="tournament", description="Selection of parents; tournaments are of two."
    )
    crossover_probability: float = Field(
        default=0.9, ge=0.0, le=1.0, description="Probability of two parents to be crossed."
    )
    crossover_eta: float = Field(
        default=15.0,
        gt=0.0,
        le=1_000.0,
        description="Index of simulated binary crossover: the greater, the closer to the parents.",
    )
    mutation_probability: float = Field(
        default=0.9, ge=0.0, le=1.0, description="Probability of a child to be mutated."
    )
    mutation_eta: float = Field(
        default=20.0,
        gt=0.0,
        le=1_000.0,
        description="Index of polynomial mutation: the greater, the smaller its steps.",
    )


def genetic_algorithm(
    settings: GaSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
) -> Proposals:
    """Search by MixedVariableGA of pymoo (Blank and Deb 2020).

    Real and integer variables use simulated binary crossover and polynomial mutation, choices
    uniform crossover and random mutation. The best of members and offspring survive. No child has
    the design of a member. If no new child can be bred, the method restarts with another population
    and keeps nothing.
    """
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.termination import NoTermination
    from pymoo.problems.static import StaticProblem

    while True:
        problem, algorithm = _problem(space), _algorithm(settings)
        algorithm.setup(problem, termination=NoTermination(), seed=random.seed(), verbose=False)
        for bred in _generations(algorithm):
            designs = np.array([[x[j] for j in range(space.dimension)] for x in bred.get("X")])
            fitness = yield space.positions(designs.astype(np.float64))
            Evaluator().eval(StaticProblem(problem, F=fitness[:, np.newaxis]), bred)
            algorithm.tell(infills=bred)


def _generations(algorithm: MixedVariableGA) -> Iterator[Any]:
    """Yield offspring until nothing new can be bred."""
    while True:
        bred = algorithm.ask()
        if bred is None or not len(bred):
            return
        yield bred


def _problem(space: Space) -> Problem:
    """Convert the box to variables of pymoo, by index."""
    from pymoo.core.problem import Problem
    from pymoo.core.variable import Choice, Integer, Real

    variables: dict[int, Any] = {}
    for j, axis in enumerate(space.axes):
        if axis.kind == "categorical":
            variables[j] = Choice(options=[float(k) for k in range(round(axis.high) + 1)])
        elif axis.kind == "integer":
            variables[j] = Integer(bounds=(round(axis.low), round(axis.high)))
        else:
            variables[j] = Real(bounds=(axis.low, axis.high))
    return Problem(vars=variables, n_obj=1)


def _algorithm(settings: GaSettings) -> MixedVariableGA:
    from pymoo.algorithms.soo.nonconvex.ga import comp_by_cv_and_fitness
    from pymoo.core.mixed import (
        MixedVariableDuplicateElimination,
        MixedVariableGA,
        MixedVariableMating,
    )
    from pymoo.core.variable import Choice, Integer, Real
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.operators.crossover.ux import UX
    from pymoo.operators.mutation.pm import PM
    from pymoo.operators.mutation.rm import ChoiceRandomMutation
    from pymoo.operators.repair.rounding import RoundingRepair
    from pymoo.operators.selection.rnd import RandomSelection
    from pymoo.operators.selection.tournament import TournamentSelection

    cross = {"prob": settings.crossover_probability, "eta": settings.crossover_eta}
    mutate = {"prob": settings.mutation_probability, "eta": settings.mutation_eta}
    whole: dict[str, Any] = {"vtype": float, "repair": RoundingRepair()}
    is_tournament = settings.selection == "tournament"
    mating = MixedVariableMating(
        selection=(
            TournamentSelection(func_comp=comp_by_cv_and_fitness)
            if is_tournament
            else RandomSelection()
        ),
        crossover={
            Real: SBX(**cross),
            Integer: SBX(**cross, **whole),
            Choice: UX(prob=settings.crossover_probability),
        },
        mutation={
            Real: PM(**mutate),
            Integer: PM(**mutate, **whole),
            Choice: ChoiceRandomMutation(prob=settings.mutation_probability),
        },
        eliminate_duplicates=MixedVariableDuplicateElimination(),
    )
    return MixedVariableGA(
        pop_size=settings.population,
        n_offsprings=settings.offspring,
        mating=mating,
        eliminate_duplicates=MixedVariableDuplicateElimination(),
    )


METHOD = from_generator(
    GaSettings,
    "Genetic algorithm for mixed variables (pymoo; Blank and Deb 2020)",
    genetic_algorithm,
    libraries=("pymoo",),
)
