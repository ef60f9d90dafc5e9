"""Robustness index: sensitivity of a design's objectives to small changes of its variables

The norm of the Jacobian of the normalised objectives with respect to the normalised variables, by
scenario; the smaller, the more robust (thesis 4.4.3). The objectives are not smooth, so the
Jacobian is that of a linear regression over a sample of designs around the given one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.statistics import CONFIDENCE, Interval
from gaitswarm.services.optimizer.analysis.utilities import NORMALISED_OBJECTIVES
from gaitswarm.services.optimizer.search.random_stream import swarm_uniform
from gaitswarm.sim.variables import Variable

Floats = NDArray[np.float64]

_RESAMPLES: Final = 400
_SAMPLE, _RESAMPLE = 0x10CA1, 0xB0075


@dataclass(frozen=True, slots=True, eq=False)
class LocalSample:
    """Designs uniform in a box around a design, within the variables' bounds.

    Attributes:
        varied: the d varied variables.
        held: names of fixed variables: categorical ones, and integers whose neighbors are outside
            the box.
        names: v columns of the designs.
        designs: (1 + n, v), the center first.
        shift: (1 + n, d) distance from the center, as a share of each variable's bounds.
        radius: half the box's width, as a share of the bounds.
    """

    varied: tuple[Variable, ...]
    held: tuple[str, ...]
    names: tuple[str, ...]
    designs: Floats
    shift: Floats
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """Effect of small changes of d variables on the M objectives in one scenario.

    Values are relative changes of an objective over a variable's whole bounds; all are NaN, and
    `index` is None, if too few simulations completed.

    Attributes:
        index: Frobenius norm of the Jacobian.
        jacobian: (M, d).
        standard_error: (M, d) of the Jacobian's entries.
        spectral_norm: largest singular value.
        by_objective: (M,) norms of the rows.
        by_variable: (d,) norms of the columns.
        unexplained: (M,) standard deviation of the residuals of the objectives' relative changes:
            curvature and roughness.
        walked: number of simulations with all objectives.
        failed: number of simulations without.
    """

    index: Interval | None
    jacobian: Floats
    standard_error: Floats
    spectral_norm: float
    by_objective: Floats
    by_variable: Floats
    unexplained: Floats
    walked: int
    failed: int


@dataclass(frozen=True, slots=True, eq=False)
class Robustness:
    """A design's sensitivities in K scenarios.

    Attributes:
        index: root mean square of the scenarios' indices; None if one has none.
    """

    index: Interval | None
    scenarios: tuple[Sensitivity, ...]

    @property
    def by_objective(self) -> Floats:
        """(M,) root mean squares over the scenarios; NaN if one has no index."""
        return _rms([scenario.by_objective for scenario in self.scenarios])

    @property
    def by_variable(self) -> Floats:
        """(d,) root mean squares over the scenarios; NaN if one has no index."""
        return _rms([scenario.by_variable for scenario in self.scenarios])


def least_samples(varied: int) -> int:
    """Return the minimum sample size."""
    return 4 * (varied + 1)


def local_sample(
    design: Mapping[str, float],
    variables: Sequence[Variable],
    *,
    radius: float,
    samples: int,
    seed: int,
) -> LocalSample:
    """Sample designs around one.

    Values are within `radius` times the width of the bounds on either side, and within the bounds.
    A design outside its bounds is sampled on the side towards them. Larger samples extend smaller
    ones.
    """
    varied = tuple(v for v in variables if _reaches_neighbours(v, radius))
    if not varied:
        raise ValueError("variables: none of them can vary; choose others or a greater radius")
    if samples < least_samples(len(varied)):
        raise ValueError(
            f"samples: {len(varied)} variables require at least {least_samples(len(varied))}"
        )
    names = tuple(design)
    designs = np.tile(np.array(list(design.values()), dtype=np.float64), (1 + samples, 1))
    shift = np.zeros((1 + samples, len(varied)))
    numbers = swarm_uniform(seed, _SAMPLE, iteration=0, particles=samples, count=len(varied))
    for j, variable in enumerate(varied):
        center, width = design[variable.name], variable.high - variable.low
        values = _around(center, variable, radius, numbers[:, j])
        designs[1:, names.index(variable.name)] = values
        shift[1:, j] = (values - center) / width
    moving = {variable.name for variable in varied}
    held = tuple(v.name for v in variables if v.name not in moving)
    return LocalSample(varied, held, names, designs, shift, radius)


def _reaches_neighbours(variable: Variable, radius: float) -> bool:
    if variable.kind == "integer":
        return radius * (variable.high - variable.low) >= 1.0
    return variable.kind == "continuous"


def _around(center: float, variable: Variable, radius: float, numbers: Floats) -> Floats:
    """Map numbers (n,) in [0, 1) to values of a variable."""
    reach = radius * (variable.high - variable.low)
    low = max(center - reach, min(variable.low, center))
    high = min(center + reach, max(variable.high, center))
    if variable.kind == "integer":
        first, last = math.ceil(low), math.floor(high)
        return np.asarray(first + np.floor(numbers * (last - first + 1)))
    return np.asarray(low + numbers * (high - low))


def robustness(sample: LocalSample, objectives: Floats, failed: NDArray[np.bool_]) -> Robustness:
    """Estimate the index from the results of a sample.

    Logarithms of the objectives are fitted, so that derivatives are relative changes. The
    contribution of noise to a squared norm is subtracted. Intervals are from a bootstrap over the
    designs, the same for all scenarios.
    """
    values = objectives[:, :, : len(NORMALISED_OBJECTIVES)]
    usable = ~failed & (np.isfinite(values) & (values > 0.0)).all(axis=2)
    weights = _resamples(len(sample.designs))
    scenarios, squares = [], []
    for k in range(values.shape[1]):
        sensitivity, norm = _sensitivity(sample, values[:, k], usable[:, k], weights)
        scenarios.append(sensitivity)
        squares.append(norm)
    complete_squares = [s for s in squares if s is not None]
    complete = bool(complete_squares) and len(complete_squares) == len(squares)
    return Robustness(
        _SquaredNorm.mean(complete_squares).interval() if complete else None, tuple(scenarios)
    )


@dataclass(frozen=True, slots=True, eq=False)
class _SquaredNorm:
    """Squared norm of a Jacobian.

    biased: of the sample's regression; unbiased: (1 + B,) less the contribution of noise, of the
    sample and of each resample.
    """

    biased: float
    unbiased: Floats

    @classmethod
    def mean(cls, norms: Sequence[_SquaredNorm]) -> _SquaredNorm:
        return cls(
            float(np.mean([norm.biased for norm in norms])),
            np.mean([norm.unbiased for norm in norms], axis=0),
        )

    def interval(self) -> Interval:
        """Interval of the norm. For a resample the sample's biased norm is the true one."""
        estimate, *resampled = np.sqrt(np.maximum(self.unbiased, 0.0)).tolist()
        errors = np.array(resampled) - math.sqrt(self.biased)
        tail = (1.0 - CONFIDENCE) / 2.0
        least, most = np.quantile(errors, [tail, 1.0 - tail]).tolist()
        low, high = max(0.0, estimate - most), max(0.0, estimate - least)
        return Interval(estimate, min(low, estimate), max(high, estimate))


def _sensitivity(
    sample: LocalSample, values: Floats, usable: NDArray[np.bool_], weights: Floats
) -> tuple[Sensitivity, _SquaredNorm | None]:
    """values: (1 + n, M) objectives of one scenario; usable: (1 + n,); weights: (1 + B, 1 + n)."""
    walked, varied = int(usable.sum()), len(sample.varied)
    counts = {"walked": walked, "failed": len(usable) - walked}
    if walked < least_samples(varied):
        none = np.full((values.shape[1], varied), np.nan)
        rows, columns = none[:, 0], none[0]
        return Sensitivity(None, none, none, math.nan, rows, columns, rows, **counts), None
    shift = np.hstack([np.ones((walked, 1)), sample.shift[usable] / sample.radius])
    logarithms = np.log(values[usable])
    estimated = _regressions(shift, logarithms - logarithms.mean(axis=0), weights[:, usable])
    slopes = estimated.slopes / sample.radius
    variances = estimated.variances / sample.radius**2
    squares = slopes**2 - variances
    norm = _SquaredNorm(float((slopes[0] ** 2).sum()), squares.sum(axis=(1, 2)))
    sensitivity = Sensitivity(
        index=norm.interval(),
        jacobian=slopes[0].T,
        standard_error=np.sqrt(variances[0]).T,
        spectral_norm=float(np.linalg.norm(slopes[0], 2)),
        by_objective=_root(squares[0].sum(axis=0)),
        by_variable=_root(squares[0].sum(axis=1)),
        unexplained=estimated.residual[0],
        **counts,
    )
    return sensitivity, norm


@dataclass(frozen=True, slots=True, eq=False)
class _Regressions:
    """slopes and their variances: (1 + B, d, M); residual: (1 + B, M) standard deviation."""

    slopes: Floats
    variances: Floats
    residual: Floats


def _regressions(x: Floats, y: Floats, weights: Floats) -> _Regressions:
    """Least squares by each row of weights: x (n, 1 + d) with a column of ones, y (n, M)."""
    n, p = x.shape
    gram = (weights @ (x[:, :, None] * x[:, None, :]).reshape(n, -1)).reshape(-1, p, p)
    moments = (weights @ (x[:, :, None] * y[:, None, :]).reshape(n, -1)).reshape(len(gram), p, -1)
    # A resample may have too few values of an integer variable.
    inverse = np.linalg.pinv(gram, hermitian=True)
    coefficients = inverse @ moments
    squares = weights @ y**2 - (coefficients * moments).sum(axis=1)
    freedom = np.maximum(weights.sum(axis=1) - p, 1.0)
    residual_variance = np.maximum(squares, 0.0) / freedom[:, None]
    diagonal = np.diagonal(inverse, axis1=1, axis2=2)[:, 1:]
    return _Regressions(
        slopes=coefficients[:, 1:],
        variances=diagonal[:, :, None] * residual_variance[:, None, :],
        residual=np.sqrt(residual_variance),
    )


def _resamples(n: int) -> Floats:
    """(1 + B, n) multiplicity of each design: first 1, then as drawn by a bootstrap."""
    drawn = swarm_uniform(0, _RESAMPLE, iteration=0, particles=_RESAMPLES, count=n)
    picks = (drawn * n).astype(np.intp)
    return np.vstack([np.ones(n), *(np.bincount(row, minlength=n) for row in picks)])


def _root(squares: Floats) -> Floats:
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def _rms(norms: Sequence[Floats]) -> Floats:
    return np.asarray(np.sqrt(np.mean(np.square(norms), axis=0)))
