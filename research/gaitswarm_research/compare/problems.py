"""The problems that methods are compared on: test functions and jobs that tune a drive."""

from __future__ import annotations

from functools import cache
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from gaitswarm import JobSpec, simulate
from gaitswarm.plugins import Space
from gaitswarm_research.compare.coco import CocoProblem
from gaitswarm_research.compare.functions import ACCEPTANCE, FUNCTIONS, BenchmarkFunction, draw

Floats = NDArray[np.float64]


class Problem(Protocol):
    """A box with a fitness."""

    @property
    def space(self) -> Space:
        """The box that is searched."""

    @property
    def target(self) -> float | None:
        """Fitness that counts as solved; None if there is none."""

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:
        """Evaluate (n, d) designs as the search sees them; `first` evaluations precede them."""

    def final(self, designs: Floats, fitness: Floats) -> Floats:
        """Evaluate designs as the report shows them."""


class FunctionProblem:
    """A test function."""

    target = ACCEPTANCE

    def __init__(self, function: BenchmarkFunction) -> None:
        self._function = function
        self.space = function.space

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:
        """Evaluate the function with the random numbers of the run."""
        numbers = np.zeros(len(designs))
        if self._function.is_random:
            numbers = draw(seed, first=first, count=len(designs))
        return self._function.value(designs, numbers)

    def final(self, designs: Floats, fitness: Floats) -> Floats:  # noqa: ARG002 - as searched
        """Return the fitness of the search."""
        return fitness


class WalkingProblem:
    """A job that tunes a drive: searched in single precision, reported in double."""

    target = None

    def __init__(self, *, gait: bool = False, **options: Any) -> None:
        spec = JobSpec(**options)
        self._options = options
        self._design_space = (spec.with_gait_searched() if gait else spec).design_space()
        self.space: Space = self._design_space.box

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:  # noqa: ARG002
        """Simulate designs in single precision."""
        return self._simulated(designs, "single")

    def final(self, designs: Floats, fitness: Floats) -> Floats:  # noqa: ARG002
        """Simulate designs in double precision."""
        return self._simulated(designs, "double")

    def _simulated(self, designs: Floats, precision: str) -> Floats:
        space = self._design_space
        rows = space.simulated(space.designs(space.box.positions(designs)))
        columns = dict(zip(space.names, rows.T, strict=True))
        options: dict[str, Any] = {**self._options, "precision": precision, "cpus": 1}
        fitness = simulate(columns, **options).fitness
        return np.where(np.isfinite(fitness), fitness, np.inf)


_CHAPTER_3: Final = {"preference": "chapter-3", "scenarios": ("straight",)}

WALKING: Final[dict[str, dict[str, Any]]] = {
    **{f"chapter-4.{name}": {"controller": "fuzzy-pi", "preference": name} for name in "ABC"},
    "chapter-3.pi": {"controller": "pi", "gait": True, **_CHAPTER_3},
    "chapter-3.fuzzy-pi": {"controller": "fuzzy-pi-3", "gait": True, **_CHAPTER_3},
    "chapter-3.fuzzy-pi-fixed-gait": {"controller": "fuzzy-pi-3", **_CHAPTER_3},
    "chapter-4.A-straight": {
        "controller": "fuzzy-pi",
        "preference": "A",
        "scenarios": ("straight",),
    },
    "chapter-4.A-gait": {"controller": "fuzzy-pi", "preference": "A", "gait": True},
}
"""Options of the walking jobs by name; `gait`: the gait is searched with the controller."""

NAMES: Final = (*FUNCTIONS, *WALKING)
"""Names of all problems."""


@cache
def problem(name: str) -> Problem:
    """Return the problem of a name, a function of COCO's suites included."""
    if name.startswith("bbob"):
        return CocoProblem(name)
    if name in FUNCTIONS:
        return FunctionProblem(FUNCTIONS[name])
    return WalkingProblem(**WALKING[name])
