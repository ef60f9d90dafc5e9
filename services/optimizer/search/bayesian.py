"""Bayesian optimization by a Gaussian process in a trust region, in batches."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.replayed import Proposals, Start
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.memory import require_room_for_scipy

if TYPE_CHECKING:
    from collections.abc import Generator
from contextlib import AbstractContextManager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sklearn.gaussian_process import GaussianProcessRegressor
    from threadpoolctl import ThreadpoolController

Floats = NDArray[np.float64]

_CANDIDATES: Final = 1_000
"""Number of points among which a batch is chosen."""

_LONGEST: Final = 1.6
_SHORTEST: Final = 0.5**7
"""Longest and shortest side of a trust region, as shares of the box (Eriksson et al. 2019)."""

_SUCCESSES: Final = 3
"""Improving batches in a row after which the side of the trust region doubles."""

_IMPROVEMENT: Final = 1e-3
"""Relative improvement that makes a batch a success."""

_CHANGED: Final = 20.0
"""Largest average number of variables in which a candidate differs from the best design."""


class BayesianSettings(SearchSettings):
    """Settings of Bayesian optimization."""

    name: Literal["bayesian"] = "bayesian"
    sample: int | None = Field(
        default=None,
        ge=2,
        le=10_000,
        description="Initial designs of a Sobol sequence. Default: 2 d, for d variables.",
    )
    batch: int = Field(default=5, ge=1, le=1_000, description="Designs chosen by one model.")
    region: float = Field(
        default=0.8,
        gt=_SHORTEST,
        le=_LONGEST,
        description="Side of the trust region at first, as a share of each variable's range.",
    )
    data: int = Field(
        default=200,
        ge=10,
        le=2_000,
        description="Designs nearest to the best one that a model is fitted to, at most.",
    )


def bayesian(
    settings: BayesianSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by expected improvement of a model of the fitness: TuRBO-1 with batches.

    A Gaussian process with a Matern 5/2 kernel and one length per variable (scikit-learn).
    Candidates lie in a trust region around the best design, which grows with success and shrinks
    with failure (Eriksson et al. 2019, arXiv 1910.01739). A batch takes the largest expected
    improvements one by one, each as if the previous had their expected fitness (Kriging believer,
    Ginsbourger et al. 2010). The model sees designs: integers rounded, choices as 0 and 1. When the
    region has become too small, the method restarts with another sample and keeps nothing. Bits may
    differ between processors because LAPACK's do; it uses one thread.
    """
    known = (np.empty((0, space.dimension)), np.empty(0))
    if start is not None:
        known = (space.designs(start.positions), start.fitness)
    while True:
        sample = _sobol(space, settings.sample or 2 * space.dimension, random)
        fitness = yield sample
        known = (np.vstack([known[0], space.designs(sample)]), np.append(known[1], fitness))
        yield from _region(settings, space, random, *known)
        known = (np.empty((0, space.dimension)), np.empty(0))


def _region(
    settings: BayesianSettings,
    space: Space,
    random: RandomNumbers,
    designs: Floats,
    fitness: Floats,
) -> Generator[Floats, Floats, None]:
    """Search in one trust region until it is too small."""
    length, successes, failures = settings.region, 0, 0
    patience = math.ceil(max(4.0, space.dimension) / settings.batch)
    model = GaussianProcess(space)
    while length > _SHORTEST:
        best = int(np.argmin(fitness))
        near = model.nearest(designs, designs[best], settings.data)
        model.fit(designs[near], _bounded(fitness[near]))
        candidates = _candidates(space, random, designs[best], length * model.sides())
        chosen = model.batch(candidates, settings.batch)
        feedback = yield space.positions(chosen)
        improved = _is_better(float(feedback.min()), float(fitness[best]))
        successes, failures = (successes + 1, 0) if improved else (0, failures + 1)
        if successes == _SUCCESSES:
            length, successes = min(2.0 * length, _LONGEST), 0
        elif failures == patience:
            length, failures = 0.5 * length, 0
        designs, fitness = np.vstack([designs, chosen]), np.append(fitness, feedback)


def _is_better(value: float, best: float) -> bool:
    """Return whether a batch is a success; the first that does not fail is one."""
    return value < (best - _IMPROVEMENT * abs(best) if math.isfinite(best) else best)


def _bounded(fitness: Floats) -> Floats:
    """Standardize fitness for the model, bounding bad and failed values above."""
    finite = fitness[np.isfinite(fitness)]
    if not len(finite):
        return np.zeros(len(fitness))
    middle = float(np.median(finite))
    values = np.minimum(fitness, middle + 2.0 * (middle - float(finite.min())))
    scaled: Floats = (values - values.mean()) / (values.std() or 1.0)
    return scaled


def _sobol(space: Space, count: int, random: RandomNumbers) -> Floats:
    """Return positions of a scrambled Sobol sequence."""
    require_room_for_scipy()
    from scipy.stats.qmc import Sobol  # noqa: PLC0415 - slow to import

    power = max(1, math.ceil(math.log2(count)))
    generator = Sobol(space.dimension, scramble=True, rng=random.seed())
    return space.evenly(generator.random_base2(power)[:count])


def _candidates(space: Space, random: RandomNumbers, best: Floats, sides: Floats) -> Floats:
    """Draw designs in a trust region that differ from the best in some variables."""
    n, d = _CANDIDATES, space.dimension
    # An integer may always move by one, a choice to any other.
    half = np.maximum(0.5 * sides, np.where(space.integer, 1.0 / space.span, 0.0))
    half = np.where(space.categorical, 1.0, half)
    middle = space.to_unit(space.positions(best[np.newaxis]))[0]
    low, high = np.maximum(middle - half, 0.0), np.minimum(middle + half, 1.0)
    points = low + random.uniform(n, d) * (high - low)
    changed = random.uniform(n, d) < min(1.0, _CHANGED / d)
    changed[np.arange(n), (random.uniform(n) * d).astype(np.intp)] = True
    return space.designs(space.from_unit(np.where(changed, points, middle)))


_STEPS: Final = 30
"""Largest number of steps of a fit; the next fit continues from there."""


class GaussianProcess:
    """A model of fitness that sees integers rounded and choices as 0 and 1 (scikit-learn)."""

    def __init__(self, space: Space) -> None:
        """Create a model without data."""
        from sklearn.gaussian_process.kernels import (  # noqa: PLC0415 - optional, slow to import
            ConstantKernel,
            Matern,
            WhiteKernel,
        )

        self._space = space
        lengths = np.full(self._features(space.designs(space.low[np.newaxis])).shape[1], 0.5)
        self._kernel = ConstantKernel(1.0, (0.05, 20.0)) * Matern(
            lengths, (0.01, 20.0), nu=2.5
        ) + WhiteKernel(1e-3, (1e-6, 0.1))
        self._model: GaussianProcessRegressor | None = None
        self._least = 0.0

    def nearest(self, designs: Floats, centre: Floats, most: int) -> NDArray[np.intp]:
        """Return the indices of the designs nearest to a centre."""
        offset = self._features(designs) - self._features(centre[np.newaxis])
        return np.sort(np.argsort(np.square(offset).sum(axis=1), kind="stable")[:most])

    def fit(self, designs: Floats, values: Floats) -> None:
        """Fit by maximum likelihood, starting from the last fit."""
        require_room_for_scipy()
        from scipy.optimize import minimize  # noqa: PLC0415 - slow to import
        from sklearn.gaussian_process import GaussianProcessRegressor  # noqa: PLC0415

        features = self._features(designs)

        def loss(theta: Floats) -> tuple[float, Floats]:
            likelihood, slope = model.log_marginal_likelihood(
                theta, eval_gradient=True, clone_kernel=False
            )
            return -likelihood, -slope

        with _one_thread():
            model = GaussianProcessRegressor(self._kernel, optimizer=None).fit(features, values)
            bounds = self._kernel.bounds
            found = minimize(
                loss,
                self._kernel.theta,
                jac=True,
                method="L-BFGS-B",
                bounds=bounds,
                options={"maxiter": _STEPS},
            )
            theta = np.clip(found.x, bounds[:, 0], bounds[:, 1])
            self._kernel = self._kernel.clone_with_theta(theta)
            model = GaussianProcessRegressor(self._kernel, optimizer=None).fit(features, values)
        self._model, self._least = model, float(values.min())

    def sides(self) -> Floats:
        """Return relative sides of a region, long where the fitness changes little."""
        lengths = self._kernel.k1.k2.length_scale
        first = np.cumsum(self._widths()) - self._widths()
        sides: Floats = np.atleast_1d(lengths)[first]
        scaled: Floats = sides / np.exp(np.log(sides).mean())
        return scaled

    def batch(self, candidates: Floats, count: int) -> Floats:
        """Choose designs by expected improvement, each given the previous ones."""
        require_room_for_scipy()
        from scipy.special import ndtr  # noqa: PLC0415 - slow to import

        assert self._model is not None, "a model is fitted before it is asked"  # noqa: S101
        candidates = np.unique(candidates, axis=0)
        with _one_thread():
            features = self._features(candidates)
            mean, covariance = self._model.predict(features, return_cov=True)
        least, chosen = self._least, list[int]()
        variance, known = np.diag(covariance).copy(), list[Floats]()
        for _ in range(min(count, len(candidates))):
            deviation = np.sqrt(np.maximum(variance, 1e-12))
            z = (least - mean) / deviation
            density = np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi)
            improvement = deviation * (z * ndtr(z) + density)
            improvement[chosen] = -1.0
            pick = int(np.argmax(improvement))
            chosen.append(pick)
            # Condition the covariance on the chosen design.
            row = covariance[pick]
            for earlier in known:
                row = row - earlier[pick] * earlier
            row = row / np.sqrt(max(row[pick], 1e-12))
            variance -= row * row
            known.append(row)
            least = min(least, float(mean[pick]))
        return candidates[chosen + [chosen[-1]] * (count - len(chosen))]

    def _widths(self) -> NDArray[np.intp]:
        """Return (d,) numbers of features by variable."""
        choices = self._space.categorical
        return np.where(choices, self._space.span + 1.0, 1.0).astype(np.intp)

    def _features(self, designs: Floats) -> Floats:
        """Return (n, k) unit coordinates, choices one-hot encoded."""
        unit = self._space.to_unit(designs)
        columns = []
        for j, width in enumerate(self._widths().tolist()):
            if self._space.categorical[j]:
                columns.append((designs[:, j, np.newaxis] == np.arange(width)).astype(np.float64))
            else:
                columns.append(unit[:, j, np.newaxis])
        return np.hstack(columns)


def _one_thread() -> AbstractContextManager[object]:
    """Limit linear algebra to one thread, because the order of sums depends on threads."""
    limiter: AbstractContextManager[object] = _linear_algebra().limit(limits=1)
    return limiter


@cache
def _linear_algebra() -> ThreadpoolController:
    """Return the controller of scikit-learn's libraries, created once per process."""
    import sklearn.gaussian_process  # noqa: F401, PLC0415 - so that they are loaded
    from threadpoolctl import ThreadpoolController  # noqa: PLC0415

    return ThreadpoolController()
