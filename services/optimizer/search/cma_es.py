"""CMA-ES with diagonal acceleration and a margin for integers and choices, with restarts."""

from __future__ import annotations

import math
import statistics
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, NonNegativeInt, PositiveFloat

from gaitswarm.services.optimizer.search import optimizer as base
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers, normal_quantiles
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.arrays import Floats

_SAMPLE: Final = 5
_RESTART: Final = 6
"""Purposes of random streams: never renumbered, or stored jobs would change their future."""

_LARGEST_POPULATION: Final = 10_000


class CmaEsSettings(base.SearchSettings):
    """Settings of CMA-ES."""

    name: Literal["cma-es"] = "cma-es"
    population: int | None = Field(default=None, ge=4, le=_LARGEST_POPULATION)
    """Designs of a generation. Default: 4 + 3 ln d, for d variables."""
    sigma: float = Field(default=0.25, gt=0.0, le=1.0)
    """Standard deviation at the start, as a share of each variable's range."""
    growth: float = Field(default=2.0, ge=1.0, le=10.0)
    """Factor of the population at each restart: 2 is IPOP, 1 keeps it."""
    integers: Literal["widened", "centred"] = "widened"
    """How integers keep changing. widened: by the smallest width of their distribution. centred:
    around the values of good designs; better where most variables are integers."""


class DistributionState(BaseModel):
    """State of a `NormalDistribution`, in unit coordinates."""

    model_config = ConfigDict(extra="forbid", strict=True, defer_build=True)

    mean: base.Numbers  # (d,)
    sigma: PositiveFloat  # overall standard deviation
    scale: base.Numbers  # (d,) factors of `sigma`
    correlation: base.Numbers  # (d, d)
    sigma_path: base.Numbers  # (d,) evolution paths
    correlation_path: base.Numbers
    scale_path: base.Numbers
    weights: list[FiniteFloat]
    """Share of the steady state that each of the three paths has reached."""
    chances: list[base.Numbers]
    """Probabilities of the choices, by categorical variable."""

    @classmethod
    def initial(cls, space: Space, mean: Floats, sigma: float) -> DistributionState:
        d = space.dimension
        choices = [round(span) + 1 for span in space.span[space.categorical].tolist()]
        return cls(
            mean=mean.copy(),
            sigma=sigma,
            scale=np.ones(d),
            correlation=np.eye(d),
            sigma_path=np.zeros(d),
            correlation_path=np.zeros(d),
            scale_path=np.zeros(d),
            weights=[0.0, 0.0, 0.0],
            chances=[np.full(k, 1.0 / k) for k in choices],
        )

    @property
    def shapes(self) -> dict[str, Any]:
        """Lengths of all lists."""
        shapes: dict[str, Any] = {k: np.shape(value) for k, value in self if k != "chances"}
        return shapes | {"chances": [len(chances) for chances in self.chances]}


class _CmaEsState(base.GenerationState):
    restarts: NonNegativeInt
    """Number of distributions before the current one."""
    bests: base.Fitness
    """Least fitness of the latest generations."""
    distribution: DistributionState


class CmaEs(base.Generational[CmaEsSettings, _CmaEsState]):
    """A normal distribution that adapts to the better half of its samples.

    dd-CMA-ES (Akimoto and Hansen 2020): the scales of the variables are learned separately from
    their correlations, and faster. Only the order of fitness values counts; failures come last.

    The first distribution is centred in the box, or at the best of the start positions, which are
    evaluated first. A distribution that has converged or stagnates is replaced by one at a random
    place with a larger population (IPOP, Auger and Hansen 2005).
    """

    state_model = _CmaEsState
    _distribution: NormalDistribution | None = None

    def begin(self) -> None:
        self.state.restarts = 0
        self.state.bests = np.empty(0)
        self._about(np.full(self.space.dimension, 0.5))

    @property
    def population(self) -> int:
        """Size of the generations until the next restart."""
        first = self.settings.population or 4 + math.floor(3.0 * math.log(self.space.dimension))
        grown = math.ceil(first * self.settings.growth**self.state.restarts)
        return min(_LARGEST_POPULATION, grown)

    @property
    def first_size(self) -> int:
        return self.population

    @property
    def distribution(self) -> NormalDistribution:
        state, centres = self.state.distribution, self.settings.integers == "centred"
        if self._distribution is None or self._distribution.state is not state:
            distribution = NormalDistribution(self.space, self.population, state, centres=centres)
            self._distribution = distribution
        return self._distribution

    def propose(self) -> Floats:
        """Sample the distribution, after the start positions."""
        if not self.state.generations and len(self._start):
            return np.empty((0, self.space.dimension))
        return self.distribution.sample(self._random())

    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Adapt to the order of the samples, or begin at the best start position."""
        state, dimension = self.state, self.space.dimension
        if not state.generations and len(self._start):
            best = positions[np.argmin(fitness)]
            self._about(self.space.to_unit(best[np.newaxis])[0])
            return
        self.distribution.learn(self._random(), np.argsort(fitness, kind="stable"))
        patience = 10 + math.ceil(30 * dimension / self.population)
        state.bests = np.append(state.bests, fitness.min())[-patience:]
        stagnates = len(state.bests) == patience and _stagnates(state.bests.tolist())
        if self.distribution.has_converged() or stagnates:
            state.restarts += 1
            random = RandomNumbers(self.seed, _RESTART, iteration=state.restarts)
            self._about(random.uniform(dimension))
            state.bests = np.empty(0)

    def _check(self, state: _CmaEsState) -> None:
        super()._check(state)
        for name, shape in self.state.distribution.shapes.items():
            if state.distribution.shapes[name] != shape:
                raise ValueError(f"distribution.{name}: of another shape than in this job")

    def _about(self, mean: Floats) -> None:
        """Begin with a distribution around a unit position."""
        initial = DistributionState.initial(self.space, mean, self.settings.sigma)
        self.state.distribution = initial

    def _random(self) -> RandomNumbers:
        """Return the random numbers of this generation."""
        return RandomNumbers(self.seed, _SAMPLE, iteration=self.state.generations)


def _stagnates(bests: list[float]) -> bool:
    """Return whether the latest third of the generations is no better (2016, B.3)."""
    third = len(bests) // 3
    before, after = bests[:third], bests[-third:]
    return not any(of(after) < of(before) for of in (min, statistics.median_high))


_REACH: Final = 2.0
"""Standard deviations by which the mean may lie beyond a bound."""

_WIDEST: Final = 1.0
"""Largest standard deviation of a variable, as a share of its range."""

_OTHERS: Final = 0.5
"""Average number of samples of a generation with another integer or choice than most."""

_MUTATED: Final = 0.27
"""Least share of samples with another integer than the mean's, where integers are centred."""

_NARROW: Final = 0.3
"""Standard deviation of an integer, in its own unit, below which sigma is adapted without it."""

_CONVERGED: Final = 1e-9
"""Standard deviation, as a share of the range, at which a distribution has converged."""

_WORST_CONDITION: Final = 1e7
"""Largest condition of the root of a correlation matrix."""

_NEARLY_DIAGONAL: Final = 2.0
"""Root of the condition up to which scales learn at full speed (beta_thresh)."""


class _Rates(NamedTuple):
    """Learning rates of a part of the covariance."""

    path: float  # c_c of the evolution path
    rank_one: float  # c_1
    rank_mu: float  # c_mu
    weights: Floats
    """(n,) weights of the ordered samples, negative in the worse half (active CMA)."""


class _Root(NamedTuple):
    """Root of a correlation matrix: (d, d), symmetric; its square is the correlation matrix."""

    matrix: Floats
    inverse: Floats
    condition: float


class NormalDistribution:
    """Distribution m + sigma D y, y ~ N(0, C), of dd-CMA-ES, with probabilities of choices.

    A sample beyond a bound is evaluated at the bound and learned from where it was. The mean stays
    near the box. The scale of an integer never becomes so small that no sample has another value
    (CMA-ES with margin, Hamano et al. 2022), nor do probabilities of choices. Centred integers
    follow CatCMA with margin (Hamano et al. 2025). Sums have a fixed order and matrices are
    decomposed without a library, so that all processors give the same bits.
    """

    def __init__(
        self, space: Space, size: int, state: DistributionState, *, centres: bool = False
    ) -> None:
        d = space.dimension
        self._space: Final = space
        self._size: Final = size
        self.state: Final = state
        self._decomposed: _Root | None = None
        self._chosen: Final = np.flatnonzero(space.categorical).tolist()
        self._centres: Final = centres and bool(space.integer.any())
        self._integers: Final = np.flatnonzero(space.integer)
        raw = [math.log((size + 1) / 2.0) - math.log(i + 1.0) for i in range(size)]
        better = [max(w, 0.0) for w in raw]
        worse = [min(w, 0.0) for w in raw]
        self._better: Final = np.array(better) / math.fsum(better)
        self._better_count: Final = int(np.count_nonzero(self._better))
        self._mu_eff: Final = 1.0 / math.fsum(self._better**2)
        self._worse: Final = np.array(worse) / -math.fsum(worse)
        self._worse_mu_eff: Final = 1.0 / math.fsum(self._worse**2)
        self._correlation_rates: Final = self._rates(d * (d + 1) / 2.0)
        self._scale_rates: Final = self._rates(float(d))

    def sample(self, random: RandomNumbers) -> Floats:
        _, y = self._steps(random)
        unit = self.state.mean + self.state.sigma * self.state.scale * y
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
        distances, mutated = self._borders()[1], np.zeros(len(self._integers), dtype=np.bool_)
        if self._centres:
            y, mutated = self._centred(y)
        shift = product(self._better[np.newaxis], y)[0]
        self.state.mean = self.state.mean + self.state.sigma * self.state.scale * shift
        h_sigma = self._adapt_sigma(product(self._better[np.newaxis], z)[0], self._is_free())
        path_step = h_sigma * self.state.scale * shift
        squares = np.ascontiguousarray(np.square(z).T).sum(axis=0)
        # Distant bad samples could remove more variance than there is, so each counts as d / |z|^2
        # (active CMA), at most four times.
        weight_factor = np.minimum(4.0, self._space.dimension / np.maximum(squares, 1e-12))
        correlation = self._learned_correlation(path_step, y, weight_factor)
        change = self._learned_scale(path_step, z, weight_factor)
        slowed = 1.0 / max(1.0, root.condition - _NEARLY_DIAGONAL + 1.0)
        factor = np.array([math.exp(c) for c in (0.5 * slowed * change).tolist()])
        spread = np.sqrt(np.maximum(np.diag(correlation), 1e-20))
        self.state.scale = self.state.scale * factor * spread
        self.state.correlation = correlation / (spread[:, np.newaxis] * spread)
        self._decomposed = None
        self.state.scale = np.minimum(self.state.scale, _WIDEST / self.state.sigma)
        reach = _REACH * self.state.sigma * self.state.scale
        self.state.mean = np.clip(self.state.mean, -reach, 1.0 + reach)
        if self._centres:
            self._keep_near_borders(distances, mutated)
        else:
            self._widen_integers()
        if choices is not None:
            self._learn_choices(choices)

    def has_converged(self) -> bool:
        """Return whether all samples are equal or the covariance cannot be decomposed."""
        real = ~(self._space.integer | self._space.categorical)
        widest = float(self.state.scale[real].max()) if real.any() else math.inf
        return self.state.sigma * widest < _CONVERGED or self._root().condition > _WORST_CONDITION

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
            values, vectors = eigen(self.state.correlation)
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
            for chances, lot in zip(self.state.chances, lots.T, strict=True)
        ]
        return np.array(columns, dtype=np.float64).T

    def _is_free(self) -> NDArray[np.bool_]:
        """Return (d,) whether steps in a variable say something about sigma."""
        deviation = self.state.sigma * self.state.scale * self._space.span
        is_free = ~self._space.categorical & (~self._space.integer | (deviation > _NARROW))
        return is_free if self._centres and is_free.any() else np.ones_like(is_free)

    def _adapt_sigma(self, step: Floats, is_free: NDArray[np.bool_]) -> float:
        """Adapt sigma (CSA) and return h_sigma: 0 while the other paths wait, else 1."""
        d, mu_eff = int(np.count_nonzero(is_free)), self._mu_eff
        rate = (mu_eff + 2.0) / (d + mu_eff + 5.0)
        damping = 1.0 + rate + 2.0 * max(0.0, math.sqrt((mu_eff - 1.0) / (d + 1.0)) - 1.0)
        gain = math.sqrt(rate * (2.0 - rate) * mu_eff)
        free_step = np.where(is_free, step, 0.0)
        self.state.sigma_path = (1.0 - rate) * self.state.sigma_path + gain * free_step
        self.state.weights[0] = (1.0 - rate) ** 2 * self.state.weights[0] + rate * (2.0 - rate)
        length = math.fsum(self.state.sigma_path**2)
        expected = math.sqrt(d) * (1.0 - 1.0 / (4.0 * d) + 1.0 / (21.0 * d * d))
        excess = math.sqrt(length) / expected - math.sqrt(self.state.weights[0])
        self.state.sigma = min(_WIDEST, self.state.sigma * math.exp(rate / damping * excess))
        return 1.0 if length / self.state.weights[0] < (2.0 + 4.0 / (d + 1.0)) * d else 0.0

    def _learned_correlation(self, path_step: Floats, y: Floats, weight_factor: Floats) -> Floats:
        """Return the updated covariance of y, whose diagonal is no longer 1."""
        rates, state = self._correlation_rates, self.state
        state.correlation_path, state.weights[1] = self._path(
            rates, state.correlation_path, path_step, state.weights[1]
        )
        path = state.correlation_path / state.scale
        weights = np.where(rates.weights < 0.0, rates.weights * weight_factor, rates.weights)
        rank_one = path[:, np.newaxis] * path - state.weights[1] * state.correlation
        rank_mu = (
            product((y * weights[:, np.newaxis]).T, y) - math.fsum(weights) * state.correlation
        )
        return state.correlation + rates.rank_one * rank_one + rates.rank_mu * rank_mu

    def _learned_scale(self, path_step: Floats, z: Floats, weight_factor: Floats) -> Floats:
        """Return (d,) changes of the logarithms of the variances."""
        rates, state = self._scale_rates, self.state
        state.scale_path, state.weights[2] = self._path(
            rates, state.scale_path, path_step, state.weights[2]
        )
        path = product((state.scale_path / state.scale)[np.newaxis], self._root().inverse)[0]
        weights = np.where(rates.weights < 0.0, rates.weights * weight_factor, rates.weights)
        rank_mu = product(weights[np.newaxis], np.square(z))[0] - math.fsum(weights)
        rank_one = rates.rank_one * (np.square(path) - state.weights[2])
        change: Floats = rank_one + rates.rank_mu * rank_mu
        return change

    def _path(
        self, rates: _Rates, path: Floats, step: Floats, reached: float
    ) -> tuple[Floats, float]:
        """Return an updated evolution path and its share of the steady state."""
        decay, added = 1.0 - rates.path, rates.path * (2.0 - rates.path)
        stalled = not step.any()
        reached = decay * decay * reached + (0.0 if stalled else added)
        return decay * path + math.sqrt(added * self._mu_eff) * step, reached

    def _widen_integers(self) -> None:
        """Widen the scales of integers so that some samples have other values."""
        integers, state = self._integers, self.state
        span = self._space.span[integers]
        nearest = np.abs(state.mean[integers] * span - self._borders()[0]) / span
        least = nearest / -normal_quantiles(_OTHERS / self._size) / state.sigma
        state.scale[integers] = np.maximum(state.scale[integers], least)

    def _borders(self) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Return of every integer the border to the value next to the mean's, how many standard
        deviations the mean is away from it, and whether the mean's value is the first or last.
        """
        span = self._space.span[self._integers]
        mean = self.state.mean[self._integers] * span
        value = np.clip(np.rint(mean), 0.0, span)
        is_above = (value == 0.0) | ((mean > value) & (value < span))
        border = value + np.where(is_above, 0.5, -0.5)
        deviation = self.state.sigma * self.state.scale[self._integers] * span
        return border, np.abs(mean - border) / deviation, (value == 0.0) | (value == span)

    def _centred(self, y: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Move integers of the better samples to what was evaluated (integer centring)."""
        integers, count = self._integers, self._better_count
        span = self._space.span[integers]
        deviation = self.state.sigma * self.state.scale[integers] * span
        mean = self.state.mean[integers] * span
        drawn = mean + deviation * y[:count, integers]
        value = np.clip(np.rint(drawn), 0.0, span)
        is_other = value != np.clip(np.rint(mean), 0.0, span)
        all_rows = np.ones((1, count))
        move = np.where(is_other, value - drawn, 0.0)
        bias = product(all_rows, move)[0]
        back = np.where(~is_other & ((value - drawn) * bias < 0.0), value - drawn, 0.0)
        room = product(all_rows, back)[0]
        share = np.minimum(1.0, -bias / np.where(room == 0.0, 1.0, room))
        centred = y.copy()
        centred[:count, integers] += (move + share * back) / deviation
        return centred, is_other.any(axis=0)

    def _keep_near_borders(self, before: Floats, mutated: NDArray[np.bool_]) -> None:
        """Keep the mean of every integer within reach of a border."""
        integers = self._integers
        span, count = self._space.span[integers], len(integers) + len(self._chosen)
        farthest = float(-normal_quantiles(0.5 * (1.0 - (1.0 - _MUTATED) ** (1.0 / count))))
        least = 0.5 / farthest / span / self.state.sigma
        self.state.scale[integers] = np.maximum(self.state.scale[integers], least)
        border, distance, is_outermost = self._borders()
        nearest = np.where(is_outermost & ~mutated, np.minimum(before, farthest), 0.0)
        reach = np.clip(distance, nearest, farthest) * self.state.sigma * self.state.scale[integers]
        mean = self.state.mean[integers]
        moved = border / span + np.copysign(reach, mean - border / span)
        self.state.mean[integers] = np.where(
            (distance < nearest) | (distance > farthest), moved, mean
        )

    def _learn_choices(self, choices: Floats) -> None:
        """Move probabilities towards the choices of better samples, above the minimum."""
        rate = min(1.0, self._scale_rates.rank_one + self._scale_rates.rank_mu)
        for column, chances in zip(choices.T, self.state.chances, strict=True):
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
