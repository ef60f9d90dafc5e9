"""Optimizers of other libraries, for comparison.

Each runs with its library's defaults except for what is set here, in coordinates in which every
variable spans [0, 1] unless stated otherwise. A failed evaluation counts as 1e30, because not every
library accepts infinity. A method that ends before its budget restarts elsewhere. None uses random
numbers that a process shares.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, Space

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution

Floats = NDArray[np.float64]

_FAILED: Final = 1e30
_VIOLATED: Final = 10.0
"""Constraint of a failed evaluation, for methods that fit a model to constraints."""


class Evaluate(Protocol):
    """Evaluates (n, d) positions: (n,) fitness, +inf for a failure; raises at the budget's end."""

    @property
    def excess(self) -> Floats | None:
        """(n, c) constraints of the positions evaluated last, kept if <= 0; None without any."""

    def __call__(self, positions: Floats, /) -> Floats: ...


Rival = Callable[[Space, int, Evaluate, Floats], None]
"""Searches a box, by a seed, from (k, d) start positions; methods without a start evaluate them
first.
"""


def pymoo_pso(space: Space, seed: int, evaluate: Evaluate, start: Floats) -> None:
    """Search by pymoo's particle swarm of 25, which adapts its weights."""
    pso = import_module("pymoo.algorithms.soo.nonconvex.pso")
    core, evaluator = (import_module(f"pymoo.core.{name}") for name in ("problem", "evaluator"))
    termination = import_module("pymoo.core.termination").NoTermination
    judged = import_module("pymoo.problems.static").StaticProblem
    d = space.dimension
    problem = core.Problem(n_var=d, n_obj=1, xl=np.zeros(d), xu=np.ones(d))
    swarm = pso.PSO(pop_size=25)
    swarm.setup(problem, termination=termination(), seed=seed)
    if len(start):
        evaluate(start)
    while True:
        asked = swarm.ask()
        fitness = _told(evaluate(space.from_unit(asked.get("X"))))
        evaluator.Evaluator().eval(judged(problem, F=fitness[:, None]), asked)
        swarm.tell(infills=asked)


def scipy_de(space: Space, seed: int, evaluate: Evaluate, start: Floats) -> None:
    """Search by scipy's differential evolution with a population of 25, in the variables' units.

    Its tolerance is 0, so that it spends its budget.
    """
    optimize, qmc = (import_module(f"scipy.{name}") for name in ("optimize", "stats.qmc"))

    def worth(columns: Floats) -> Floats:
        return _told(evaluate(np.clip(space.positions(columns.T), space.low, space.high)))

    discrete = space.integer | space.categorical
    generator = np.random.default_rng(seed)
    if len(start):
        evaluate(start)
    while True:
        unit = qmc.LatinHypercube(space.dimension, rng=generator).random(25)
        with warnings.catch_warnings():
            # The mean of a population of failures is undefined.
            warnings.simplefilter("ignore", RuntimeWarning)
            optimize.differential_evolution(
                worth,
                list(zip(space.low, space.high, strict=True)),
                init=space.low + unit * space.span,
                integrality=discrete,
                maxiter=1_000_000_000,
                tol=0.0,
                polish=False,
                updating="deferred",
                vectorized=True,
                rng=generator,
            )


def cma_es(space: Space, seed: int, evaluate: Evaluate, start: Floats) -> None:
    """Search by the library cma with sigma 0.3, restarted with twice the offspring (IPOP).

    It begins at the best of the start, or in the middle of the box. Integers are in their own units
    and keep a smallest step.
    """
    cma = import_module("cma")
    discrete = space.integer | space.categorical
    low = np.where(discrete, space.low, 0.0)
    high = np.where(discrete, space.high, 1.0)
    generator = np.random.default_rng(seed)
    mean, offspring = (low + high) / 2.0, 4 + int(3.0 * np.log(space.dimension))
    if len(start):
        best = start[np.argmin(evaluate(start))]
        mean = np.where(discrete, best, space.to_unit(best[np.newaxis])[0])
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
            warnings.simplefilter("ignore")
            strategy = cma.CMAEvolutionStrategy(mean, 0.3, options)
            while not strategy.stop():
                asked = strategy.ask()
                points = np.array(asked)
                positions = np.where(discrete, points, space.low + points * space.span)
                clipped = np.clip(positions, space.low, space.high)
                whole = np.where(discrete, np.rint(clipped), clipped)
                strategy.tell(asked, _told(evaluate(space.positions(whole))).tolist())
        mean = low + generator.random(space.dimension) * (high - low)
        offspring *= 2


def catcmawm(space: Space, seed: int, evaluate: Evaluate, start: Floats) -> None:
    """Search by CatCMAwM of the library cmaes, restarted with twice the population (IPOP).

    Integers of two values are choices, as its documentation recommends. Its first mean is the best
    of the start, its first variances as without one.
    """
    method = import_module("cmaes").CatCMAwM
    choices = space.categorical | (space.integer & (space.span < 2.0))
    integers = space.integer & ~choices
    real = ~(integers | choices)
    counts = [round(span) + 1 for span in space.span.tolist()]
    spaces = {
        "x_space": [[0.0, 1.0]] * int(real.sum()) or None,
        "z_space": [list(range(counts[j])) for j in np.flatnonzero(integers)] or None,
        "c_space": [counts[j] for j in np.flatnonzero(choices)] or None,
    }
    population, generator = None, np.random.default_rng(seed)
    normal = np.append(np.flatnonzero(real), np.flatnonzero(integers))
    begin: dict[str, Floats] = {}
    if len(start) and len(normal):
        best = start[np.argmin(evaluate(start))]
        scale = np.where(real, space.span, 1.0)
        deviation = np.where(real, 1.0 / 12.0, space.span / 10.0)[normal]
        begin = {"mean": ((best - space.low) / scale)[normal], "cov": np.diag(deviation**2)}
    while True:
        chosen = int(generator.integers(2**31))
        strategy = method(**spaces, **begin, population_size=population, seed=chosen)
        begin = {}
        while choices.all() or not strategy.should_stop():
            asked = [strategy.ask() for _ in range(strategy.population_size)]
            unit = np.empty((len(asked), space.dimension))
            for row, solution in zip(unit, asked, strict=True):
                row[real] = solution.x
                row[integers] = solution.z
                row[choices] = () if solution.c is None else solution.c.argmax(axis=1)
            positions = space.low + np.where(real, unit * space.span, unit)
            fitness = _told(evaluate(space.positions(positions))).tolist()
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore", RuntimeWarning)
                strategy.tell(list(zip(asked, fitness, strict=True)))
        population = 2 * strategy.population_size


def optuna_tpe(space: Space, seed: int, evaluate: Evaluate, start: Floats) -> None:
    """Search by Optuna's default, the multivariate TPE sampler, one design at a time."""
    _study("TPESampler", {}, 1, space, seed, evaluate, start)


def optuna_gp(space: Space, seed: int, evaluate: Evaluate, start: Floats) -> None:
    """Search by Optuna's Gaussian process sampler, one design at a time."""
    _study("GPSampler", {}, 1, space, seed, evaluate, start)


def optuna_cma_es(space: Space, seed: int, evaluate: Evaluate, start: Floats) -> None:
    """Search by Optuna's CMA-ES sampler, in generations of 12.

    Categorical variables are drawn independently, as the sampler does.
    """
    options = {"popsize": 12, "warn_independent_sampling": False}
    _study("CmaEsSampler", options, 12, space, seed, evaluate, start)


RIVALS: Final[Mapping[str, tuple[Rival, str]]] = {
    "catcmawm": (catcmawm, "cmaes"),
    "cma": (cma_es, "cma"),
    "optuna-cma-es": (optuna_cma_es, "cmaes optuna"),
    "optuna-gp": (optuna_gp, "optuna scipy torch"),
    "optuna-tpe": (optuna_tpe, "optuna scipy"),
    "pymoo-pso": (pymoo_pso, "pymoo"),
    "scipy-de": (scipy_de, "scipy"),
}
"""Functions by name, with the distributions they need."""


def _told(fitness: Floats) -> Floats:
    return np.where(np.isfinite(fitness), fitness, _FAILED)


def _study(
    sampler: str,
    options: Mapping[str, Any],
    batch: int,
    space: Space,
    seed: int,
    evaluate: Evaluate,
    start: Floats,
) -> None:
    """Search by a sampler of Optuna, in the variables' own units.

    A failed evaluation counts as the worst of the others, to which a Gaussian process is fitted.
    """
    optuna = import_module("optuna")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    distributions = {f"x{j}": _distribution(axis) for j, axis in enumerate(space.axes)}
    worst = -math.inf
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        chosen = getattr(optuna.samplers, sampler)(seed=seed, **options)
        study = optuna.create_study(sampler=chosen)
        for design in space.designs(start).tolist():
            study.enqueue_trial(dict(zip(distributions, design, strict=True)))
        while True:
            trials = [study.ask(distributions) for _ in range(batch)]
            designs = np.array([[t.params[name] for name in distributions] for t in trials], float)
            fitness = evaluate(space.positions(designs))
            succeeded = np.isfinite(fitness)
            worst = max(worst, fitness.max(initial=worst, where=succeeded))
            values = np.where(succeeded, fitness, worst if math.isfinite(worst) else _FAILED)
            excess = np.empty((batch, 0)) if evaluate.excess is None else evaluate.excess
            rows = np.where(np.isfinite(excess), excess, _VIOLATED).tolist()
            for trial, value, row in zip(trials, values.tolist(), rows, strict=True):
                for k, number in enumerate(row):
                    trial.set_constraint(f"c{k}", number)
                study.tell(trial, value)


def _distribution(axis: Axis) -> BaseDistribution:
    from optuna import distributions

    if axis.kind == "continuous":
        return distributions.FloatDistribution(axis.low, axis.high)
    if axis.kind == "integer":
        return distributions.IntDistribution(int(axis.low), int(axis.high))
    return distributions.CategoricalDistribution(tuple(range(int(axis.high) + 1)))
