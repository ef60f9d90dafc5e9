"""Bayesian optimization by a Gaussian process in a trust region, then CMA-ES."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Final, Literal

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.search.cma_es import CmaEs, CmaEsSettings
from gaitswarm.services.optimizer.search.differential_evolution import latin_hypercube
from gaitswarm.services.optimizer.search.optimizer import Proposals, SearchSettings, Start
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers, normal_quantiles
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.memory import require_room_for_scipy

_LONGEST: Final = 1.6
_FIRST: Final = 0.8
_SHORTEST: Final = 0.5**7
"""Sides of a trust region, as shares of the box (Eriksson et al. 2019)."""

_SUCCESSES: Final = 3
"""Improving batches in a row after which the sides double."""

_SIGMA: Final = 0.1
"""First standard deviation of CMA-ES, as a share of each variable's range."""

_CANDIDATES: Final = 1_024
"""Points of the region among which the expected improvement is compared."""

_WIDTHS: Final = (0.2, 0.1, 0.05, 0.02, 0.01)
"""Standard deviations of steps from the best candidates, as shares of the region."""

_STEPS: Final = 256
"""Candidates of each width."""

_PARENTS: Final = 10
"""Best candidates from which the next ones are drawn."""


class BayesianSettings(SearchSettings):
    """Settings of Bayesian optimization."""

    name: Literal["bayesian"] = "bayesian"
    sample: int = Field(default=10, ge=2, le=10_000)
    """Initial designs, a Latin hypercube."""
    batch: int = Field(default=1, ge=1, le=1_000, description="Designs chosen by one model.")
    handover: int = Field(default=50, ge=2, le=500)
    """Evaluations after which CMA-ES continues from the best design."""


def bayesian(
    settings: BayesianSettings,
    space: Space,
    budget: int,
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by expected improvement of a Gaussian process, in the trust region of TuRBO-1.

    The region is about the best design, longer in variables that matter less; it grows with
    success, shrinks with failure (Eriksson et al. 2019), and is as large as at first when it has
    become too small. A design of a batch is chosen as if the fitness of the previous ones were as
    expected (Kriging believer, Ginsbourger et al. 2010). CMA-ES continues with small steps.
    """
    designs = space.designs(latin_hypercube(space, settings.sample, random))
    fitness = yield space.positions(designs)
    if start is not None:
        designs = np.vstack([space.designs(start.positions), designs])
        fitness = np.append(start.fitness, fitness)
    model = GaussianProcess(space)
    length, successes, failures = _FIRST, 0, 0
    patience = math.ceil(max(4.0, space.dimension) / settings.batch)
    while len(fitness) < settings.handover:
        model.fit(designs, normal_scores(fitness))
        sides = length * model.lengths()
        batch = []
        for _ in range(settings.batch):
            batch.append(_most_promising(model, space, sides, random))
            expected, _ = model.predict(batch[-1][np.newaxis])
            model.learn(np.vstack([model.designs, batch[-1]]), np.append(model.values, expected))
        feedback = yield space.positions(np.array(batch))
        improved = feedback.min() < fitness.min()
        successes, failures = (successes + 1, 0) if improved else (0, failures + 1)
        if successes == _SUCCESSES:
            length, successes = min(2.0 * length, _LONGEST), 0
        elif failures == patience:
            length, failures = 0.5 * length, 0
        length = _FIRST if length < _SHORTEST else length
        designs, fitness = np.vstack([designs, batch]), np.append(fitness, feedback)
    integers: Literal["centred", "widened"] = "centred" if space.mostly_integer else "widened"
    cma_es = CmaEsSettings(sigma=_SIGMA, integers=integers)
    search = CmaEs(cma_es, space, budget, random.seed())
    best = np.argmin(fitness)
    search.start_from(space.positions(designs[[best]]))
    search.ask()
    search.tell(fitness[[best]])
    while True:
        search.tell((yield search.ask()))


def _most_promising(
    model: GaussianProcess, space: Space, sides: Floats, random: RandomNumbers
) -> Floats:
    """Return the new design with the largest expected improvement found in a region."""
    least = float(model.values.min())
    best = model.designs[[np.argmin(model.values)]]
    region = _region(space, best[0], sides)
    points = region.designs(latin_hypercube(region, _CANDIDATES, random))
    merit = log_improvement(*model.predict(points), least)
    for width in _WIDTHS:
        top = points[np.argsort(-merit, kind="stable")[:_PARENTS]]
        steps = _steps(region, np.vstack([best, top]), width, random)
        points = np.vstack([points, steps])
        merit = np.append(merit, log_improvement(*model.predict(steps), least))
    known = (points[:, np.newaxis] == model.designs).all(axis=2).any(axis=1)
    if known.all() and (sides < 2.0).any():
        return _most_promising(model, space, np.full(space.dimension, 2.0), random)
    chosen: Floats = points[np.argmax(np.where(known, -np.inf, merit))]
    return chosen


def _region(space: Space, centre: Floats, sides: Floats) -> Space:
    """Return the part of a box about a design; choices are free, integers move by one at least."""
    axes = []
    for axis, middle, side in zip(space.axes, centre.tolist(), sides.tolist(), strict=True):
        half = 0.5 * side * (axis.high - axis.low)
        half = max(1.0, round(half)) if axis.kind == "integer" else half
        low, high = max(axis.low, middle - half), min(axis.high, middle + half)
        axes.append(axis if axis.kind == "categorical" else axis._replace(low=low, high=high))
    return Space(axes)


def _steps(space: Space, parents: Floats, width: float, random: RandomNumbers) -> Floats:
    """Draw designs that differ from one of the parents in some variables."""
    n, d = _STEPS, space.dimension
    origin = parents[(random.uniform(n) * len(parents)).astype(np.intp)]
    step = width * space.span * random.normal(n, d)
    step = np.where(space.integer, np.copysign(np.maximum(np.abs(step), 1.0), step), step)
    moved = np.clip(origin + step, space.low, space.high)
    moved = np.where(space.categorical, space.designs(space.evenly(random.uniform(n, d))), moved)
    changed = random.uniform(n, d) < random.uniform(n, 1)
    return space.designs(space.positions(np.where(changed, moved, origin)))


def normal_scores(fitness: Floats) -> Floats:
    """Return the quantiles of a normal distribution at the ranks: the model sees no magnitudes."""
    _, value, counts = np.unique(fitness, return_inverse=True, return_counts=True)
    scores: Floats = normal_quantiles((np.cumsum(counts) - 0.5 * counts) / len(fitness))[value]
    return scores


_SQRT_5: Final = math.sqrt(5.0)

_LEAST_NOISE: Final = 1e-6
"""Least variance of the noise; values have variance 1."""


class GaussianProcess:
    """A Gaussian process with a Matern 5/2 kernel and a length per variable.

    Its parameters maximize the posterior density with the priors of Optuna's GPSampler. Integers
    are rounded, and any two choices are a range apart. No linear algebra library is used, so that
    the bits do not depend on the number of threads.
    """

    def __init__(self, space: Space) -> None:
        self._space: Final = space
        # Logarithms of inverse squared lengths, and of the variances of signal and noise.
        self._parameters = np.append(np.zeros(space.dimension + 1), math.log(1e-2))

    def fit(self, designs: Floats, values: Floats) -> None:
        """Fit the parameters, starting from the previous ones, and learn the values."""
        require_room_for_scipy()
        from scipy.optimize import minimize  # noqa: PLC0415 - slow to import

        squares = list(self._squares(designs, designs))

        def loss(parameters: Floats) -> tuple[float, Floats]:
            *weights, signal, noise = np.exp(parameters).tolist()
            noise += _LEAST_NOISE
            shape, slope = _matern(weights, squares)
            inverse, log_determinant = inverted(signal * shape + noise * np.eye(len(values)))
            solved = (inverse * values).sum(axis=1)
            gain = 0.5 * (solved[:, np.newaxis] * solved - inverse)
            density = -0.5 * ((values * solved).sum() + log_determinant)
            density += math.log(signal) - signal + 0.1 * math.log(noise) - 30.0 * noise
            density -= 0.1 * math.fsum(1.0 / weight + weight for weight in weights)
            gradient = [
                weight * (signal * (gain * slope * square).sum() - 0.1) + 0.1 / weight
                for weight, square in zip(weights, squares, strict=True)
            ]
            gradient.append(signal * (gain * shape).sum() + 1.0 - signal)
            gradient.append((noise - _LEAST_NOISE) * (np.trace(gain) + 0.1 / noise - 30.0))
            return -density, -np.array(gradient)

        self._parameters = minimize(
            loss,
            self._parameters,
            jac=True,
            method="TNC",  # without BLAS, whose threads take longer than the steps
            bounds=[(-7.0, 7.0)] * (len(self._parameters) - 1) + [(-18.0, 0.0)],
            options={"maxfun": 60},
        ).x
        self.learn(designs, values)

    def learn(self, designs: Floats, values: Floats) -> None:
        """Condition on values without another fit."""
        *weights, signal, noise = np.exp(self._parameters).tolist()
        self.designs, self.values, self._weights, self._signal = designs, values, weights, signal
        shape, _ = _matern(weights, self._squares(designs, designs))
        covariance = signal * shape + (noise + _LEAST_NOISE) * np.eye(len(values))
        self._inverse, _ = inverted(covariance)

    def lengths(self) -> Floats:
        """Return (d,) lengths of the kernel, whose geometric mean is 1."""
        logarithms = -0.5 * self._parameters[: self._space.dimension]
        lengths: Floats = np.exp(logarithms - logarithms.mean())
        return lengths

    def predict(self, designs: Floats) -> tuple[Floats, Floats]:
        """Return (n,) means and standard deviations."""
        shape, _ = _matern(self._weights, self._squares(designs, self.designs))
        weights = np.einsum("ij,jk->ik", self._signal * shape, self._inverse)
        variance = self._signal * (1.0 - (weights * shape).sum(axis=1))
        return (weights * self.values).sum(axis=1), np.sqrt(np.maximum(variance, 1e-12))

    def _squares(self, designs: Floats, others: Floats) -> Iterator[Floats]:
        """Yield (n, m) squared differences in units of the range, variable by variable."""
        for j, span in enumerate(self._space.span.tolist()):
            difference = (designs[:, j, np.newaxis] - others[:, j]) / span
            yield np.where(difference, 1.0, 0.0) if self._space.categorical[j] else difference**2


def _matern(weights: list[float], squares: Iterable[Floats]) -> tuple[Floats, Floats]:
    """Return the kernel and its derivative by the weighted sum of squares."""
    total = sum(weight * square for weight, square in zip(weights, squares, strict=True))
    distance = _SQRT_5 * np.sqrt(total)
    decay = np.exp(-distance)
    return (1.0 + distance + distance**2 / 3.0) * decay, -5.0 / 6.0 * (1.0 + distance) * decay


def inverted(matrix: Floats) -> tuple[Floats, float]:
    """Invert a positive definite matrix, with log determinant (sweep, Goodnight 1979)."""
    swept, log_determinant = matrix.copy(), 0.0
    for i in range(len(swept)):
        pivot = float(swept[i, i])
        log_determinant += math.log(pivot)
        row, column = swept[i] / pivot, swept[:, i].copy()
        swept -= column[:, np.newaxis] * row
        swept[i], swept[:, i] = row, -column / pivot
        swept[i, i] = 1.0 / pivot
    return swept, log_determinant


def log_improvement(mean: Floats, deviation: Floats, least: float) -> Floats:
    """Return the logarithm of the expected improvement (Ament et al. 2023)."""
    require_room_for_scipy()
    from scipy.special import erfcx  # noqa: PLC0415 - slow to import

    z = np.minimum((least - mean) / deviation, 30.0)  # beyond, erfcx overflows
    # z Phi(z) + phi(z) = phi(z) (1 + z Phi(z) / phi(z)), and phi(z) underflows.
    ratio = 1.0 + z * math.sqrt(0.5 * math.pi) * erfcx(-z * math.sqrt(0.5))
    value: Floats = np.log(deviation * np.maximum(ratio, 1e-16)) - 0.5 * z * z
    return value
