"""Other libraries' optimizers, to be compared with; no job can be tuned by them.

Each runs in its library, with the library's defaults but for what its settings name, in coordinates
in which every variable spans [0, 1] unless it says otherwise. A failed evaluation is told as 1e30,
because not all of them know infinity. A method that ends before its budget starts anew from
elsewhere. None draws on random numbers that a process shares, as runs share a process.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.services.optimizer.tournament.race import Evaluate

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution

Floats = NDArray[np.float64]

_FAILED: Final = 1e30


class PymooPsoSettings(SearchSettings):
    """Settings of pymoo's particle swarm, which adapts its weights."""

    name: Literal["pymoo-pso"] = "pymoo-pso"
    particles: int = Field(default=25, ge=2, le=10_000, description="Size of the swarm.")


class ScipyDeSettings(SearchSettings):
    """Settings of scipy's differential evolution."""

    name: Literal["scipy-de"] = "scipy-de"
    particles: int = Field(default=25, ge=5, le=10_000, description="Size of the population.")
    recombination: float = Field(default=0.7, ge=0.0, le=1.0, description="Crossover probability.")
    strategy: Literal["best1bin", "rand1bin", "currenttobest1bin", "best2bin"] = Field(
        default="best1bin", description="How a trial vector is made."
    )


class CmaSettings(SearchSettings):
    """Settings of the library cma, by the author of CMA-ES, with its integer handling."""

    name: Literal["cma"] = "cma"
    particles: int = Field(
        default=12, ge=4, le=10_000, description="Offspring at first, doubled at each restart."
    )
    sigma: float = Field(
        default=0.3, gt=0.0, le=1.0, description="First step, as a share of each variable's range."
    )


class OptunaTpeSettings(SearchSettings):
    """Settings of Optuna's tree-structured Parzen estimator."""

    name: Literal["optuna-tpe"] = "optuna-tpe"
    multivariate: bool = Field(default=False, description="Whether variables are seen jointly.")


class OptunaCmaEsSettings(SearchSettings):
    """Settings of Optuna's CMA-ES sampler."""

    name: Literal["optuna-cma-es"] = "optuna-cma-es"
    particles: int = Field(default=12, ge=4, le=10_000, description="Offspring of a generation.")


RivalSettings = (
    PymooPsoSettings | ScipyDeSettings | CmaSettings | OptunaTpeSettings | OptunaCmaEsSettings
)


def pymoo_pso(settings: PymooPsoSettings, space: Space, seed: int, evaluate: Evaluate) -> None:
    """Search by pymoo's PSO."""
    pso = import_module("pymoo.algorithms.soo.nonconvex.pso")
    core, evaluator = (import_module(f"pymoo.core.{name}") for name in ("problem", "evaluator"))
    termination = import_module("pymoo.core.termination").NoTermination
    judged = import_module("pymoo.problems.static").StaticProblem
    d = space.dimension
    problem = core.Problem(n_var=d, n_obj=1, xl=np.zeros(d), xu=np.ones(d))
    swarm = pso.PSO(pop_size=settings.particles)
    swarm.setup(problem, termination=termination(), seed=seed)
    while True:
        asked = swarm.ask()
        fitness = _told(evaluate(space.from_unit(asked.get("X"))))
        evaluator.Evaluator().eval(judged(problem, F=fitness[:, None]), asked)
        swarm.tell(infills=asked)


def scipy_de(settings: ScipyDeSettings, space: Space, seed: int, evaluate: Evaluate) -> None:
    """Search by scipy's differential evolution, a generation at a time, integers as integers.

    Variables are in their own units. Its tolerance is 0, so that it spends its budget.
    """
    optimize, qmc = (import_module(f"scipy.{name}") for name in ("optimize", "stats.qmc"))

    def worth(columns: Floats) -> Floats:
        return _told(evaluate(np.clip(space.positions(columns.T), space.low, space.high)))

    discrete = space.integer | space.categorical
    generator = np.random.default_rng(seed)
    while True:
        unit = qmc.LatinHypercube(space.dimension, rng=generator).random(settings.particles)
        with warnings.catch_warnings():
            # Of a population of failures it has no mean.
            warnings.simplefilter("ignore", RuntimeWarning)
            optimize.differential_evolution(
                worth,
                list(zip(space.low, space.high, strict=True)),
                strategy=settings.strategy,
                recombination=settings.recombination,
                init=space.low + unit * space.span,
                integrality=discrete,
                maxiter=1_000_000_000,
                tol=0.0,
                polish=False,
                updating="deferred",
                vectorized=True,
                rng=generator,
            )


def cma_es(settings: CmaSettings, space: Space, seed: int, evaluate: Evaluate) -> None:
    """Search by the library cma, restarted with twice the offspring (IPOP) from a random point.

    Integers are in their own units, of which it keeps a least step.
    """
    cma = import_module("cma")
    discrete = space.integer | space.categorical
    low = np.where(discrete, space.low, 0.0)
    high = np.where(discrete, space.high, 1.0)
    generator = np.random.default_rng(seed)
    offspring = settings.particles
    while True:
        options = {
            "bounds": [low.tolist(), high.tolist()],
            "CMA_stds": (high - low).tolist(),
            "integer_variables": np.flatnonzero(discrete).tolist(),
            "popsize": offspring,
            "randn": lambda *shape: generator.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
            "verb_log": 0,
        }
        with warnings.catch_warnings():
            # About options that do as they are told.
            warnings.simplefilter("ignore")
            strategy = cma.CMAEvolutionStrategy(
                low + generator.random(space.dimension) * (high - low), settings.sigma, options
            )
            while not strategy.stop():
                asked = strategy.ask()
                points = np.array(asked)
                positions = np.where(discrete, points, space.low + points * space.span)
                clipped = np.clip(positions, space.low, space.high)
                whole = np.where(discrete, np.rint(clipped), clipped)
                strategy.tell(asked, _told(evaluate(space.positions(whole))).tolist())
        offspring *= 2


def optuna_tpe(settings: OptunaTpeSettings, space: Space, seed: int, evaluate: Evaluate) -> None:
    """Search by Optuna's TPE sampler, by ask and tell of batches, with its constant liar.

    Variables are in their own units.
    """
    options = {"multivariate": settings.multivariate, "constant_liar": True}
    _study("TPESampler", options, settings.particles, space, seed, evaluate)


def optuna_cma_es(
    settings: OptunaCmaEsSettings, space: Space, seed: int, evaluate: Evaluate
) -> None:
    """Search by Optuna's CMA-ES sampler, by ask and tell of whole generations.

    Variables are in their own units; categorical ones are drawn independently, as the sampler does.
    """
    options = {"popsize": settings.particles, "warn_independent_sampling": False}
    _study("CmaEsSampler", options, settings.particles, space, seed, evaluate)


@dataclass(frozen=True, slots=True)
class Rival:
    """A method of another library.

    Attributes:
        settings: Model of its settings.
        libraries: Distributions that it computes with.
        search: Runs it.
    """

    settings: type[RivalSettings]
    libraries: tuple[str, ...]
    search: Callable[[Any, Space, int, Evaluate], None]


RIVALS: Final = {
    "cma": Rival(CmaSettings, ("cma",), cma_es),
    "optuna-cma-es": Rival(OptunaCmaEsSettings, ("cmaes", "optuna"), optuna_cma_es),
    "optuna-tpe": Rival(OptunaTpeSettings, ("optuna", "scipy"), optuna_tpe),
    "pymoo-pso": Rival(PymooPsoSettings, ("pymoo",), pymoo_pso),
    "scipy-de": Rival(ScipyDeSettings, ("scipy",), scipy_de),
}
"""All of them, by name."""


def _told(fitness: Floats) -> Floats:
    return np.where(np.isfinite(fitness), fitness, _FAILED)


def _study(
    sampler: str,
    options: Mapping[str, Any],
    batch: int,
    space: Space,
    seed: int,
    evaluate: Evaluate,
) -> None:
    """Let one of Optuna's samplers search, a batch at a time."""
    optuna = import_module("optuna")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    distributions = {f"x{j}": _distribution(axis) for j, axis in enumerate(space.axes)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        chosen = getattr(optuna.samplers, sampler)(seed=seed, **options)
        study = optuna.create_study(sampler=chosen)
        while True:
            trials = [study.ask(distributions) for _ in range(batch)]
            designs = np.array([[t.params[name] for name in distributions] for t in trials], float)
            fitness = _told(evaluate(space.positions(designs)))
            for trial, value in zip(trials, fitness.tolist(), strict=True):
                study.tell(trial, value)


def _distribution(axis: Axis) -> BaseDistribution:
    from optuna import distributions  # noqa: PLC0415 - optional, and slow

    if axis.kind == "continuous":
        return distributions.FloatDistribution(axis.low, axis.high)
    if axis.kind == "integer":
        return distributions.IntDistribution(int(axis.low), int(axis.high))
    return distributions.CategoricalDistribution(tuple(range(int(axis.high) + 1)))
