"""The problems that methods are compared on: test functions and jobs that tune a drive."""

from __future__ import annotations

from functools import cache
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from gaitswarm import CONTROLLERS, JobSpec, SimulationResult, simulate
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

    @property
    def start(self) -> Floats:
        """(k, d) positions that are evaluated before any others."""

    @property
    def excess(self) -> Floats | None:
        """(n, c) constraints of the designs evaluated last, kept if <= 0; None without any."""

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:
        """Evaluate (n, d) designs as the search sees them; `first` evaluations precede them."""

    def final(self, designs: Floats, fitness: Floats) -> Floats:
        """Evaluate designs as the report shows them."""


class FunctionProblem:
    """A test function."""

    target = ACCEPTANCE
    excess = None

    def __init__(self, function: BenchmarkFunction) -> None:
        self._function = function
        self.space = function.space
        self.start = np.empty((0, self.space.dimension))

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
    """A job that tunes a drive: searched in single precision, reported in double.

    With constraints, no objective f1 to f5 may be worse than the published design's in any
    scenario. Searches start from that design, and results are those of single precision.
    """

    target = None

    def __init__(self, *, gait: bool = False, no_worse_than: str = "", **options: Any) -> None:
        spec = JobSpec(**options)
        self._options = options
        self._design_space = (spec.with_gait_searched() if gait else spec).design_space()
        self.space: Space = self._design_space.box
        self.start: Floats = np.empty((0, self.space.dimension))
        self.excess: Floats | None = None
        self._limits: Floats | None = None
        if no_worse_than:
            published = CONTROLLERS[spec.controller].published[no_worse_than]
            self._limits = self._simulate(dict(published), "single").objectives[0, :, :5]
            known = spec.resolved_scenarios()[0].model_dump() | dict(published)
            values = [known[v.name] for v in self._design_space.variables]
            self.start = np.clip([values], self.space.low, self.space.high)

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:  # noqa: ARG002
        """Simulate designs in single precision."""
        return self._fitness(designs, "single")

    def final(self, designs: Floats, fitness: Floats) -> Floats:
        """Simulate designs in double precision."""
        if self._limits is not None:
            return np.where(fitness < _INFEASIBLE, fitness, np.inf)
        return self._fitness(designs, "double")

    def _fitness(self, designs: Floats, precision: str) -> Floats:
        space = self._design_space
        # A single design would be simulated scenario by scenario, which takes four times as long.
        repeated = designs if len(designs) > 1 else np.repeat(designs, 2, axis=0)
        rows = space.simulated(space.designs(space.box.positions(repeated)))
        result = self._simulate(dict(zip(space.names, rows.T, strict=True)), precision)
        fitness = np.where(np.isfinite(result.fitness), result.fitness, np.inf)[: len(designs)]
        if self._limits is None:
            return fitness
        ratios = result.objectives[: len(designs), :, :5] / self._limits - 1.0
        self.excess = np.where(np.isnan(ratios), np.inf, ratios).max(axis=1)
        violation = np.maximum(ratios, 0.0).sum(axis=(1, 2))
        infeasible = np.isfinite(fitness) & (violation > 0.0)
        return np.where(infeasible, _INFEASIBLE * (1.0 + violation), fitness)

    def _simulate(self, columns: dict[str, Any], precision: str) -> SimulationResult:
        options: dict[str, Any] = {**self._options, "precision": precision, "cpus": 1}
        return simulate(columns, **options)


_INFEASIBLE: Final = 1e3
"""Fitness beyond which designs are infeasible; less than the published design's is feasible."""

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
    "constrained.A-gait": {
        "controller": "fuzzy-pi",
        "preference": "A",
        "gait": True,
        "no_worse_than": "A",
    },
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
