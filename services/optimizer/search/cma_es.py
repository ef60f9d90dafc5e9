"""CMA-ES with diagonal acceleration and a margin for integers and choices, with restarts."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, NonNegativeInt, PositiveFloat

from gaitswarm.services.optimizer.search.generational import (
    Generational,
    GenerationState,
    Worth,
    of_worth,
)
from gaitswarm.services.optimizer.search.generational import worth as as_json
from gaitswarm.services.optimizer.search.optimizer import SearchSettings, matrix
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.memory import require_room_for_scipy

Floats = NDArray[np.float64]

_SAMPLE: Final = 5
_RESTART: Final = 6
"""Purposes of random streams: never renumbered, or stored jobs would change their future."""

_LARGEST_POPULATION: Final = 10_000

_FLAT: Final = 1e-4
"""Relative gain in fitness below which generations count as stagnating."""


class CmaEsSettings(SearchSettings):
    """Settings of CMA-ES."""

    name: Literal["cma-es"] = "cma-es"
    population: int | None = Field(
        default=None,
        ge=4,
        le=_LARGEST_POPULATION,
        description="Designs of a generation. Default: 4 + 3 ln d, for d variables.",
    )
    sigma: float = Field(
        default=0.25,
        gt=0.0,
        le=1.0,
        description="Standard deviation at the start, as a share of each variable's range.",
    )
    growth: float = Field(
        default=2.0,
        ge=1.0,
        le=10.0,
        description="Factor of the population at each restart: 2 is IPOP, 1 keeps it.",
    )


class _CmaEsState(GenerationState):
    """The dumped state.

    Attributes:
        restarts: Number of distributions before the current one.
        bests: Least fitness of the latest generations.
    """

    restarts: NonNegativeInt
    bests: Worth
    distribution: DistributionState


class CmaEs(Generational[CmaEsSettings, _CmaEsState]):
    """A normal distribution that adapts to the better half of its samples.

    dd-CMA-ES (Akimoto and Hansen 2020): the scales of the variables are learned separately from
    their correlations, and faster. Only the order of fitness values counts; failures come last.

    The first distribution is centred in the box, or at the best of the start positions, which are
    evaluated first. A distribution that has converged or stagnates is replaced by one at a random
    place with a larger population (IPOP, Auger and Hansen 2005).
    """

    state_model = _CmaEsState

    def __init__(self, settings: CmaEsSettings, space: Space, budget: int, seed: int) -> None:
        """Create a search before its first ask."""
        super().__init__(settings, space, budget, seed)
        self._restarts = 0
        self._bests: list[float] = []
        self._distribution = self._about(np.full(space.dimension, 0.5))

    @property
    def population(self) -> int:
        """Size of the generations until the next restart."""
        first = self.settings.population or 4 + math.floor(3.0 * math.log(self.space.dimension))
        return min(_LARGEST_POPULATION, math.ceil(first * self.settings.growth**self._restarts))

    @property
    def first_size(self) -> int:
        """Largest number of start positions that are learned from."""
        return self.population

    def propose(self) -> Floats:
        """Sample the distribution, after the start positions."""
        if not self.generations and len(self._start):
            return np.empty((0, self.space.dimension))
        return self._distribution.sample(self._random())

    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Adapt to the order of the samples, or begin at the best start position."""
        if not self.generations and len(self._start):
            best = positions[np.argmin(fitness)]
            self._distribution = self._about(self.space.to_unit(best[np.newaxis])[0])
            return
        self._distribution.learn(self._random(), np.argsort(fitness, kind="stable"))
        patience = 10 + math.ceil(30 * self.space.dimension / self.population)
        self._bests = [*self._bests, float(fitness.min())][-patience:]
        if self._distribution.has_converged() or (
            len(self._bests) == patience and self._stagnates()
        ):
            self._restarts += 1
            random = RandomNumbers(self.seed, _RESTART, iteration=self._restarts)
            self._distribution = self._about(random.uniform(self.space.dimension))
            self._bests = []

    def memory(self) -> dict[str, Any]:
        """Return the distribution, restarts and recent bests."""
        return {
            "restarts": self._restarts,
            "bests": as_json(self._bests),
            "distribution": self._distribution.dump(),
        }

    def recall(self, state: _CmaEsState) -> None:
        """Restore the distribution, restarts and recent bests."""
        before, self._restarts = self._restarts, state.restarts
        try:
            distribution = self._about(np.full(self.space.dimension, 0.5))
            distribution.load(state.distribution)
        except ValueError:
            self._restarts = before
            raise
        self._distribution, self._bests = distribution, of_worth(state.bests).tolist()

    def _about(self, mean: Floats) -> NormalDistribution:
        """Create a distribution around a unit position."""
        return NormalDistribution(self.space, self.population, mean, self.settings.sigma)

    def _random(self) -> RandomNumbers:
        """Return the random numbers of this generation."""
        return RandomNumbers(self.seed, _SAMPLE, iteration=self.generations)

    def _stagnates(self) -> bool:
        """Return whether the latest third of the recent generations is no better than the first.

        Compares best and median, as in Hansen's tutorial (2016, B.3) but over fewer generations.
        The thirds need not be equal, because a stepped surface makes them differ.
        """
        third = len(self._bests) // 3
        before, after = self._bests[:third], self._bests[-third:]
        return not any(_gains(of(before), of(after)) for of in (min, statistics.median_high))


def _gains(before: float, after: float) -> bool:
    """Return whether the gain exceeds the threshold."""
    if not math.isfinite(after):
        return False
    return not math.isfinite(before) or before - after > _FLAT * abs(after)


_REACH: Final = 2.0
"""Standard deviations by which the mean may lie beyond a bound."""

_WIDEST: Final = 1.0
"""Largest standard deviation of a variable, as a share of its range."""

_OTHERS: Final = 0.5
"""Average number of samples of a generation with another integer or choice than most."""

_CONVERGED: Final = 1e-9
"""Standard deviation, as a share of the range, at which a distribution has converged."""

_WORST_CONDITION: Final = 1e7
"""Largest condition of the root of a correlation matrix."""

_NEARLY_DIAGONAL: Final = 2.0
"""Root of the condition up to which scales learn at full speed (beta_thresh)."""


class DistributionState(BaseModel):
    """The dumped state of `NormalDistribution`, in unit coordinates.

    Attributes:
        mean: (d,).
        sigma: Overall standard deviation.
        scale: (d,) factors of `sigma`.
        correlation: (d, d).
        sigma_path: (d,) evolution path of `sigma`.
        correlation_path: (d,) that of the correlations.
        scale_path: (d,) that of the scales.
        weights: Share of the steady state that each of the three paths has reached.
        chances: Probabilities of the choices, by categorical variable.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    mean: list[FiniteFloat]
    sigma: PositiveFloat
    scale: list[PositiveFloat]
    correlation: list[list[FiniteFloat]]
    sigma_path: list[FiniteFloat]
    correlation_path: list[FiniteFloat]
    scale_path: list[FiniteFloat]
    weights: list[FiniteFloat]
    chances: list[list[PositiveFloat]]


@dataclass(frozen=True, slots=True)
class _Rates:
    """Learning rates of a part of the covariance.

    Attributes:
        path: c_c of the evolution path.
        rank_one: c_1.
        rank_mu: c_mu.
        weights: (n,) weights of the ordered samples, negative in the worse half (active CMA).
    """

    path: float
    rank_one: float
    rank_mu: float
    weights: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Root:
    """Root of a correlation matrix.

    Attributes:
        matrix: (d, d), symmetric; its square is the correlation matrix.
    """

    matrix: Floats
    inverse: Floats
    condition: float


class NormalDistribution:
    """Distribution m + sigma D y, y ~ N(0, C), of dd-CMA-ES, with probabilities of choices.

    A sample beyond a bound is evaluated at the bound and learned from where it was. The mean stays
    near the box. The scale of an integer never becomes so small that no sample has another value
    (CMA-ES with margin, Hamano et al. 2022), nor do probabilities of choices. Sums have a fixed
    order and matrices are decomposed without a library, so that all processors give the same bits.
    """

    def __init__(self, space: Space, size: int, mean: Floats, sigma: float) -> None:
        """Create an initial distribution."""
        d = space.dimension
        self._space: Final = space
        self._size: Final = size
        self._mean, self._sigma = mean.copy(), sigma
        self._scale, self._correlation = np.ones(d), np.eye(d)
        self._decomposed: _Root | None = None
        self._sigma_path, self._correlation_path, self._scale_path = np.zeros((3, d))
        self._reached = [0.0, 0.0, 0.0]
        self._chosen: Final = np.flatnonzero(space.categorical).tolist()
        self._chances = [
            np.full(k, 1.0 / k) for k in (round(space.span[j]) + 1 for j in self._chosen)
        ]
        raw = [math.log((size + 1) / 2.0) - math.log(i + 1.0) for i in range(size)]
        better = [max(w, 0.0) for w in raw]
        worse = [min(w, 0.0) for w in raw]
        self._better: Final = np.array(better) / math.fsum(better)
        self._mu_eff: Final = 1.0 / math.fsum(self._better**2)
        self._worse: Final = np.array(worse) / -math.fsum(worse)
        self._worse_mu_eff: Final = 1.0 / math.fsum(self._worse**2)
        self._correlation_rates: Final = self._rates(d * (d + 1) / 2.0)
        self._scale_rates: Final = self._rates(float(d))

    def sample(self, random: RandomNumbers) -> Floats:
        """Sample a generation."""
        _, y = self._steps(random)
        unit = self._mean + self._sigma * self._scale * y
        designs = self._space.designs(self._space.from_unit(unit))
        if self._chosen:
            designs[:, self._chosen] = self._choices(random)
        return self._space.positions(designs)

    def learn(self, random: RandomNumbers, order: NDArray[np.intp]) -> None:
        """Update by the order of the samples."""
        root = self._root()
        z, y = self._steps(random)
        choices = self._choices(random)[order] if self._chosen else None
        z, y = z[order], y[order]
        shift = product(self._better[np.newaxis], y)[0]
        self._mean = self._mean + self._sigma * self._scale * shift
        h_sigma = self._adapt_sigma(product(self._better[np.newaxis], z)[0])
        path_step = h_sigma * self._scale * shift
        squares = np.ascontiguousarray(np.square(z).T).sum(axis=0)
        # Distant bad samples could remove more variance than there is, so each counts as d / |z|^2
        # (active CMA), at most four times.
        weight_factor = np.minimum(4.0, self._space.dimension / np.maximum(squares, 1e-12))
        correlation = self._learned_correlation(path_step, y, weight_factor)
        change = self._learned_scale(path_step, z, weight_factor)
        slowed = 1.0 / max(1.0, root.condition - _NEARLY_DIAGONAL + 1.0)
        factor = np.array([math.exp(c) for c in (0.5 * slowed * change).tolist()])
        spread = np.sqrt(np.maximum(np.diag(correlation), 1e-20))
        self._scale = self._scale * factor * spread
        self._correlation = correlation / (spread[:, np.newaxis] * spread)
        self._decomposed = None
        self._scale = np.minimum(self._scale, _WIDEST / self._sigma)
        reach = _REACH * self._sigma * self._scale
        self._mean = np.clip(self._mean, -reach, 1.0 + reach)
        self._keep_trying_integers()
        if choices is not None:
            self._learn_choices(choices)

    def has_converged(self) -> bool:
        """Return whether all samples are equal or the covariance cannot be decomposed."""
        real = ~(self._space.integer | self._space.categorical)
        widest = float(self._scale[real].max()) if real.any() else math.inf
        return self._sigma * widest < _CONVERGED or self._root().condition > _WORST_CONDITION

    def dump(self) -> dict[str, Any]:
        """Return the complete state, JSON-compatible."""
        return {
            "mean": self._mean.tolist(),
            "sigma": self._sigma,
            "scale": self._scale.tolist(),
            "correlation": self._correlation.tolist(),
            "sigma_path": self._sigma_path.tolist(),
            "correlation_path": self._correlation_path.tolist(),
            "scale_path": self._scale_path.tolist(),
            "weights": list(self._reached),
            "chances": [chances.tolist() for chances in self._chances],
        }

    def load(self, state: DistributionState) -> None:
        """Restore a state of the same space and size."""
        d = self._space.dimension
        rows = {
            name: matrix([getattr(state, name)], (1, d), f"distribution.{name}")[0]
            for name in ("mean", "scale", "sigma_path", "correlation_path", "scale_path")
        }
        correlation = matrix(state.correlation, (d, d), "distribution.correlation")
        if len(state.weights) != len(self._reached):
            raise ValueError(f"distribution.weights: expected {len(self._reached)} of them")
        if [len(row) for row in state.chances] != [len(row) for row in self._chances]:
            raise ValueError("distribution.chances: do not match the choices of this job")
        self._mean, self._sigma, self._scale = rows["mean"], state.sigma, rows["scale"]
        self._correlation, self._decomposed = correlation, None
        self._reached = list(state.weights)
        self._sigma_path, self._scale_path = rows["sigma_path"], rows["scale_path"]
        self._correlation_path = rows["correlation_path"]
        self._chances = [np.array(row) for row in state.chances]

    def _rates(self, parameters: float) -> _Rates:
        """Return the rates of a part with a number of parameters (table 1)."""
        d, n, mu_eff = self._space.dimension, self._size, self._mu_eff
        root = math.sqrt(d + 1.0)
        c_1 = 1.0 / (2.0 * (parameters / d + 1.0) * root * math.sqrt(root) + 0.5 * mu_eff)
        gain = mu_eff + 1.0 / mu_eff - 2.0 + 0.5 * n / (n + 5.0)
        c_mu = min(gain * c_1, 1.0 - c_1)
        negative = min(1.0 + c_1 / c_mu, 1.0 + 2.0 * self._worse_mu_eff / (mu_eff + 2.0))
        weights = self._better + negative * self._worse
        return _Rates(math.sqrt(0.5 * gain * c_1), c_1, c_mu, weights)

    def _root(self) -> _Root:
        """Return the root of the correlations, cached until they change."""
        if self._decomposed is None:
            values, vectors = eigen(self._correlation)
            roots = np.sqrt(np.maximum(values, 1e-20))
            self._decomposed = _Root(
                product(vectors * roots, vectors.T),
                product(vectors / roots, vectors.T),
                float(roots.max() / roots.min()),
            )
        return self._decomposed

    def _steps(self, random: RandomNumbers) -> tuple[Floats, Floats]:
        """Draw (size, d) z ~ N(0, I) and y ~ N(0, C); the first numbers of a generation."""
        z = random.normal(self._size, self._space.dimension)
        return z, product(z, self._root().matrix)

    def _choices(self, random: RandomNumbers) -> Floats:
        """Draw (size, c) choices of the categorical variables; the next numbers."""
        lots = random.uniform(self._size, len(self._chosen))
        columns = [
            np.minimum(np.searchsorted(np.cumsum(chances), lot, side="right"), len(chances) - 1)
            for chances, lot in zip(self._chances, lots.T, strict=True)
        ]
        return np.array(columns, dtype=np.float64).T

    def _adapt_sigma(self, step: Floats) -> float:
        """Adapt sigma (CSA) and return h_sigma: 0 while the other paths wait, else 1."""
        d, mu_eff = self._space.dimension, self._mu_eff
        rate = (mu_eff + 2.0) / (d + mu_eff + 5.0)
        damping = 1.0 + rate + 2.0 * max(0.0, math.sqrt((mu_eff - 1.0) / (d + 1.0)) - 1.0)
        self._sigma_path = (1.0 - rate) * self._sigma_path + math.sqrt(
            rate * (2.0 - rate) * mu_eff
        ) * step
        self._reached[0] = (1.0 - rate) ** 2 * self._reached[0] + rate * (2.0 - rate)
        length = math.fsum(self._sigma_path**2)
        expected = math.sqrt(d) * (1.0 - 1.0 / (4.0 * d) + 1.0 / (21.0 * d * d))
        excess = math.sqrt(length) / expected - math.sqrt(self._reached[0])
        self._sigma = min(_WIDEST, self._sigma * math.exp(rate / damping * excess))
        return 1.0 if length / self._reached[0] < (2.0 + 4.0 / (d + 1.0)) * d else 0.0

    def _learned_correlation(self, path_step: Floats, y: Floats, weight_factor: Floats) -> Floats:
        """Return the updated covariance of y, whose diagonal is no longer 1."""
        rates = self._correlation_rates
        self._correlation_path, self._reached[1] = self._path(
            rates, self._correlation_path, path_step, self._reached[1]
        )
        path = self._correlation_path / self._scale
        weights = np.where(rates.weights < 0.0, rates.weights * weight_factor, rates.weights)
        rank_one = path[:, np.newaxis] * path - self._reached[1] * self._correlation
        rank_mu = (
            product((y * weights[:, np.newaxis]).T, y) - math.fsum(weights) * self._correlation
        )
        return self._correlation + rates.rank_one * rank_one + rates.rank_mu * rank_mu

    def _learned_scale(self, path_step: Floats, z: Floats, weight_factor: Floats) -> Floats:
        """Return (d,) changes of the logarithms of the variances."""
        rates = self._scale_rates
        self._scale_path, self._reached[2] = self._path(
            rates, self._scale_path, path_step, self._reached[2]
        )
        path = product((self._scale_path / self._scale)[np.newaxis], self._root().inverse)[0]
        weights = np.where(rates.weights < 0.0, rates.weights * weight_factor, rates.weights)
        rank_mu = product(weights[np.newaxis], np.square(z))[0] - math.fsum(weights)
        change: Floats = (
            rates.rank_one * (np.square(path) - self._reached[2]) + rates.rank_mu * rank_mu
        )
        return change

    def _path(
        self, rates: _Rates, path: Floats, step: Floats, reached: float
    ) -> tuple[Floats, float]:
        """Return an updated evolution path and its share of the steady state."""
        decay, added = 1.0 - rates.path, rates.path * (2.0 - rates.path)
        stalled = not step.any()
        reached = decay * decay * reached + (0.0 if stalled else added)
        return decay * path + math.sqrt(added * self._mu_eff) * step, reached

    def _keep_trying_integers(self) -> None:
        """Widen the scales of integers so that some samples have other values."""
        require_room_for_scipy()
        from scipy.special import ndtri  # noqa: PLC0415 - slow to import, and few searches need it

        away = float(-ndtri(_OTHERS / self._size))
        for j in np.flatnonzero(self._space.integer).tolist():
            last = float(self._space.span[j])
            value = min(max(round(float(self._mean[j]) * last), 0), round(last))
            edges = [value - 0.5] * (value > 0) + [value + 0.5] * (value < last)
            nearest = min(abs(float(self._mean[j]) * last - edge) for edge in edges) / last
            least = nearest / away / self._sigma
            self._scale[j] = max(self._scale[j], least)

    def _learn_choices(self, choices: Floats) -> None:
        """Move probabilities towards the choices of better samples, above the minimum."""
        rate = min(1.0, self._scale_rates.rank_one + self._scale_rates.rank_mu)
        for column, chances in zip(choices.T, self._chances, strict=True):
            taken = [math.fsum(self._better[column == choice]) for choice in range(len(chances))]
            least = min(_OTHERS / self._size, 0.5) / (len(chances) - 1)
            moved = np.maximum(chances + rate * (np.array(taken) - chances), least)
            excess = moved - least
            total = math.fsum(excess)
            chances[:] = least + excess * ((1.0 - least * len(chances)) / total)


_SWEEPS: Final = 30
"""Upper limit; convergence is quadratic."""

_MOST_TERMS: Final = 1 << 21
"""Largest number of terms in memory at once (16 MiB), except for two rows of the result."""

_NEGLIGIBLE: Final = 1e-15
"""Share of the diagonal below which an off-diagonal element counts as zero."""


def product(left: Floats, right: Floats) -> Floats:
    """Multiply matrices, summing in the order of the inner index."""
    rows = max(2, _MOST_TERMS // max(1, right.size))
    if len(left) > rows:
        blocks = [left[first : first + rows] for first in range(0, len(left), rows)]
        return np.concatenate([product(block, right) for block in blocks])
    terms = left.T[:, :, np.newaxis] * right[:, np.newaxis, :]
    # Along the first axis, numpy adds sequentially.
    total: Floats = np.ascontiguousarray(terms).sum(axis=0)
    return total


def eigen(symmetric: Floats) -> tuple[Floats, Floats]:
    """Decompose a symmetric matrix by Jacobi rotations (Golub and Van Loan, 8.5)."""
    a, vectors = (symmetric + symmetric.T) * 0.5, np.eye(len(symmetric))
    for _ in range(_SWEEPS):
        turned = False
        for p in range(len(a) - 1):
            for q in range(p + 1, len(a)):
                off, one, other = float(a[p, q]), float(a[p, p]), float(a[q, q])
                if abs(off) <= _NEGLIGIBLE * math.sqrt(abs(one) * abs(other)):
                    continue
                turned = True
                _rotate(a, vectors, p, q)
        if not turned:
            break
    return np.diag(a).copy(), vectors


def _rotate(a: Floats, vectors: Floats, p: int, q: int) -> None:
    """Rotate in the plane of two coordinates so that their common element vanishes."""
    off = float(a[p, q])
    ratio = (float(a[q, q]) - float(a[p, p])) / (2.0 * off)
    tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    row_p, row_q = a[p].copy(), a[q].copy()
    a[p], a[q] = cosine * row_p - sine * row_q, sine * row_p + cosine * row_q
    column_p, column_q = a[:, p].copy(), a[:, q].copy()
    a[:, p], a[:, q] = cosine * column_p - sine * column_q, sine * column_p + cosine * column_q
    a[p, q] = a[q, p] = 0.0
    vector_p, vector_q = vectors[:, p].copy(), vectors[:, q].copy()
    vectors[:, p] = cosine * vector_p - sine * vector_q
    vectors[:, q] = sine * vector_p + cosine * vector_q
