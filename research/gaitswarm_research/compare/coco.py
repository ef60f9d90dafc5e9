"""Problems of COCO's suites bbob and bbob-mixint (Hansen et al. 2021; Tušar et al. 2019)."""

from __future__ import annotations

from contextlib import chdir
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, Space

Floats = NDArray[np.float64]

TARGETS: Final = np.logspace(2.0, -8.0, 51)
"""Distances from the minimum by which a run is scored."""


FUNCTIONS: Final = range(1, 25)

SUITES: Final = {"bbob": (2, 3, 5, 10, 20, 40), "bbob-mixint": (5, 10, 20, 40, 80, 160)}
"""Numbers of variables by suite."""


class CocoProblem:
    """A function of a suite, by a name such as `bbob-mixint_f001_i01_d05`."""

    excess = None

    def __init__(self, name: str) -> None:
        suite, function, instance, dimension = name.split("_")
        numbers = (int(part[1:]) for part in (function, instance, dimension))
        options = "function_indices:{} instance_indices:{} dimensions:{}".format(*numbers)
        # The suite owns its problems.
        self._suite: Any = import_module("cocoex").Suite(suite, "", options)
        self._problem = self._suite[0]
        integers = self._problem.number_of_integer_variables
        bounds = zip(self._problem.lower_bounds, self._problem.upper_bounds, strict=True)
        self.space = Space(
            [
                Axis(float(low), float(high), "integer" if j < integers else "continuous")
                for j, (low, high) in enumerate(bounds)
            ]
        )
        self.start = np.empty((0, self.space.dimension))
        self._least = float(self._problem(_minimizer(self._problem)))
        self.target: float | None = self._least + float(TARGETS[-1])

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:  # noqa: ARG002
        """Evaluate the function."""
        return np.array([self._problem(design) for design in designs])

    def final(self, designs: Floats, fitness: Floats) -> Floats:  # noqa: ARG002
        """Return the distances from the minimum."""
        return np.maximum(fitness - self._least, 0.0)


def _minimizer(function: Any) -> list[float]:
    """Return the minimizer, which the library only writes to a file of the working directory."""
    with TemporaryDirectory() as folder, chdir(folder):
        function._best_parameter("print")  # noqa: SLF001 - has no other name
        text = Path("._bbob_problem_best_parameter.txt").read_text(encoding="utf-8")
    return [float(number) for number in text.split()]
