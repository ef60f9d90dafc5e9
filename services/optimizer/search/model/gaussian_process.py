"""A Gaussian process over designs: fitted by likelihood, asked for batches."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.memory import require_room_for_scipy

if TYPE_CHECKING:
    from sklearn.gaussian_process import GaussianProcessRegressor
    from threadpoolctl import ThreadpoolController

Floats = NDArray[np.float64]

_STEPS: Final = 30
"""Steps of a fit, at most; the next one begins where it ended."""


class GaussianProcess:
    """A model of fitness that sees integers rounded and choices as 0 and 1 (scikit-learn)."""

    def __init__(self, space: Space) -> None:
        """Create a model that knows nothing."""
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
        """Which designs are nearest to one."""
        offset = self._features(designs) - self._features(centre[np.newaxis])
        return np.sort(np.argsort(np.square(offset).sum(axis=1), kind="stable")[:most])

    def fit(self, designs: Floats, values: Floats) -> None:
        """Fit by the likelihood, from the last fit on."""
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
        """Sides of a region that is long where the fitness changes little."""
        lengths = self._kernel.k1.k2.length_scale
        first = np.cumsum(self._widths()) - self._widths()
        sides: Floats = np.atleast_1d(lengths)[first]
        scaled: Floats = sides / np.exp(np.log(sides).mean())
        return scaled

    def batch(self, candidates: Floats, count: int) -> Floats:
        """Choose designs by expected improvement, each as if those before were as expected."""
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
            # What is known of a design is known of those like it, too.
            row = covariance[pick]
            for earlier in known:
                row = row - earlier[pick] * earlier
            row = row / np.sqrt(max(row[pick], 1e-12))
            variance -= row * row
            known.append(row)
            least = min(least, float(mean[pick]))
        return candidates[chosen + [chosen[-1]] * (count - len(chosen))]

    def _widths(self) -> NDArray[np.intp]:
        """(d,) features of each variable."""
        choices = self._space.categorical
        return np.where(choices, self._space.span + 1.0, 1.0).astype(np.intp)

    def _features(self, designs: Floats) -> Floats:
        """(n, k) unit coordinates; of choices, 1 for the one that it is."""
        unit = self._space.to_unit(designs)
        columns = []
        for j, width in enumerate(self._widths().tolist()):
            if self._space.categorical[j]:
                columns.append((designs[:, j, np.newaxis] == np.arange(width)).astype(np.float64))
            else:
                columns.append(unit[:, j, np.newaxis])
        return np.hstack(columns)


def _one_thread() -> AbstractContextManager[object]:
    """Hold linear algebra to one thread: another number of them would add in another order."""
    limiter: AbstractContextManager[object] = _linear_algebra().limit(limits=1)
    return limiter


@cache
def _linear_algebra() -> ThreadpoolController:
    """The libraries that scikit-learn computes with, looked for once a process."""
    import sklearn.gaussian_process  # noqa: F401, PLC0415 - so that they are loaded
    from threadpoolctl import ThreadpoolController  # noqa: PLC0415

    return ThreadpoolController()
