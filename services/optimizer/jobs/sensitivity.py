"""Local sensitivity: a sample of designs around one, and regressions of logarithms over it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.search.random_stream import swarm_uniform
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.variables import Variable

_SAMPLE = 0x10CA1


@dataclass(frozen=True, slots=True, eq=False)
class LocalSample:
    """Designs uniform in a box around a design, within the variables' bounds."""

    varied: tuple[Variable, ...]  # d
    held: tuple[str, ...]  # categorical ones, and integers whose neighbors are outside the box
    names: tuple[str, ...]  # v columns of the designs
    designs: Floats  # (1 + n, v), the center first
    shift: Floats  # (1 + n, d) from the center, as a share of each variable's bounds
    radius: float  # half the box's width, as a share of the bounds


def least_samples(varied: int) -> int:
    return 4 * (varied + 1)


def local_sample(
    design: Mapping[str, float],
    variables: Sequence[Variable],
    *,
    radius: float,
    samples: int,
    seed: int,
) -> LocalSample:
    """Sample designs around one, within `radius` times the width of the bounds, and inside them.

    Larger samples extend smaller ones.
    """
    varied = tuple(v for v in variables if _reaches_neighbours(v, radius))
    if not varied:
        raise InvalidRequest(
            "none of them can vary; choose others or a greater radius", field="variables"
        )
    least = least_samples(len(varied))
    if samples < least:
        raise InvalidRequest(f"{len(varied)} variables require at least {least}", field="samples")
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


def usable_rows(values: Floats, failed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which of the simulations (n, K) have a logarithm of every objective (n, K, M)."""
    usable: NDArray[np.bool_] = ~failed & (np.isfinite(values) & (values > 0.0)).all(axis=2)
    return usable


def slopes_and_squares(
    sample: LocalSample, values: Floats, chosen: NDArray[np.bool_], weights: Floats
) -> tuple[Floats, Floats]:
    """Fit logarithms of a scenario's objectives (n, M) with each row of weights (1 + B, n).

    Returns slopes and their squares (1 + B, d, M), less the contribution of noise; NaN for too few
    designs.
    """
    if chosen.sum() < least_samples(len(sample.varied)):
        nothing = np.full((len(weights), len(sample.varied), values.shape[1]), np.nan)
        return nothing, nothing
    shift = sample.shift[chosen] / sample.radius
    logarithms = np.log(values[chosen])
    slopes, variances = _regressions(
        np.hstack([np.ones((len(shift), 1)), shift]),
        logarithms - logarithms.mean(axis=0),
        weights[:, chosen],
    )
    slopes = slopes / sample.radius
    return slopes, slopes**2 - variances / sample.radius**2


def sensitivity_index(sample: LocalSample, values: Floats, failed: NDArray[np.bool_]) -> float:
    """Return the root mean square over scenarios of the Jacobian's norm; NaN if too few succeed."""
    usable, weights = usable_rows(values, failed), np.ones((1, len(values)))
    squares = [
        slopes_and_squares(sample, values[:, k], usable[:, k], weights)[1].sum()
        for k in range(values.shape[1])
    ]
    return math.sqrt(max(float(np.mean(squares)), 0.0))


def _regressions(x: Floats, y: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Slopes (1 + B, d, M) and variances by least squares; x (n, 1 + d) has a column of ones."""
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
    return coefficients[:, 1:], diagonal[:, :, None] * residual_variance[:, None, :]
