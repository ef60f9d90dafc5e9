"""Trade-offs of the chapter-4 job found by `hype` and by another library's search.

    python -m benchmarks.trade_offs [--seeds 4] [--evaluations 625] [--json]

Every method judges as many designs, in single precision. It receives the five objectives over all
six scenarios; methods that are not multi-objective receive the fitness by preference A.
Hypervolume is of all designs that a run judged, and not of a last population: the share of a box
that they dominate, in logarithms. The box is that of the front of all runs together, a tenth of its
range beyond.
"""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Callable
from importlib import import_module
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, judge, objective_vectors
from gaitswarm.services.optimizer.search.registry import METHODS, create_search
from gaitswarm.sim.case import run_together
from gaitswarm.sim.outcome import Status

Floats = NDArray[np.float64]

_SAMPLES: Final = 100_000
"""Points of the box by which hypervolumes are estimated: to half a percent of them."""

_FAILED: Final = 1e6
"""Value of each objective of a failed design for other libraries."""


class Problem:
    """The job's designs, judged as they are asked for."""

    def __init__(self, evaluations: int) -> None:
        self.spec = JobSpec(precision="single").resolved()
        self.space = self.spec.design_space().box
        self.left = evaluations
        self.objectives: list[Floats] = []
        self.failed: list[NDArray[np.bool_]] = []

    def evaluate(self, positions: Floats) -> tuple[Floats, Floats]:
        """Objective vectors, and fitness by preference A."""
        space, cases = self.spec.design_space(), self.spec.cases({})
        designs = space.simulated(space.designs(positions))
        outcomes = run_together(cases, [designs] * len(cases))
        objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
        failed = np.stack([outcome.statuses != Status.OK for outcome in outcomes], axis=1)
        self.objectives.append(objectives)
        self.failed.append(failed)
        self.left -= len(positions)
        return objective_vectors(objectives, failed), self.best_by("A", objectives, failed)

    @staticmethod
    def best_by(name: str, objectives: Floats, failed: NDArray[np.bool_]) -> Floats:
        return judge(objectives, failed, PREFERENCES[name]).fitness  # type: ignore[index]


def by_job_method(name: str, problem: Problem, seed: int) -> None:
    method = METHODS[name]  # type: ignore[index]
    search = create_search(method.settings(), problem.space, problem.left, seed)
    while problem.left:
        vectors, fitness = problem.evaluate(search.ask(problem.left))
        search.tell(vectors if method.multi_objective else fitness)


def by_pymoo(create: Callable[[], Any], problem: Problem, seed: int) -> None:
    core, evaluator, static = (
        import_module(f"pymoo.{name}")
        for name in ("core.problem", "core.evaluator", "problems.static")
    )
    never = import_module("pymoo.core.termination").NoTermination()
    d = problem.space.dimension
    box = core.Problem(n_var=d, n_obj=5, xl=np.zeros(d), xu=np.ones(d))
    algorithm = create()
    algorithm.setup(box, termination=never, seed=seed, verbose=False)
    while problem.left > 0:
        asked = algorithm.ask()
        values = problem.evaluate(problem.space.from_unit(asked.get("X")))[0]
        values = np.where(np.isfinite(values), values, _FAILED)
        evaluator.Evaluator().eval(static.StaticProblem(box, F=values), asked)
        algorithm.tell(infills=asked)


def nsga_ii(population: int) -> Any:
    return import_module("pymoo.algorithms.moo.nsga2").NSGA2(pop_size=population)


def nsga_iii() -> Any:
    directions = import_module("pymoo.util.ref_dirs").get_reference_directions
    algorithm = import_module("pymoo.algorithms.moo.nsga3").NSGA3
    return algorithm(directions("das-dennis", 5, n_partitions=3))


PYMOO: Final[dict[str, Callable[[], Any]]] = {
    "NSGA-II, 25": lambda: nsga_ii(25),
    "NSGA-II, 50": lambda: nsga_ii(50),
    "NSGA-III, 35": nsga_iii,
}


def run(name: str, evaluations: int, seed: int) -> dict[str, Any]:
    """Vectors of all designs of a run, and its best by each preference."""
    problem = Problem(evaluations)
    if name in PYMOO:
        by_pymoo(PYMOO[name], problem, seed)
    else:
        by_job_method(name, problem, seed)
    objectives = np.concatenate(problem.objectives)[:evaluations]
    failed = np.concatenate(problem.failed)[:evaluations]
    best = {p: float(problem.best_by(p, objectives, failed).min()) for p in "ABC"}
    return {"vectors": objective_vectors(objectives, failed), "best": best}


def non_dominated(vectors: Floats) -> Floats:
    """Those that no other dominates; those of failed designs are none of them."""
    finite = vectors[np.isfinite(vectors).all(axis=1)]
    kept = [not ((finite <= row).all(axis=1) & (finite < row).any(axis=1)).any() for row in finite]
    return finite[kept]


def hypervolumes(runs: list[Floats]) -> list[float]:
    """Share of the box of all of them that each dominates."""
    fronts = [np.log(non_dominated(vectors)) for vectors in runs]
    front = non_dominated(np.vstack(fronts))
    low, high = front.min(axis=0), front.max(axis=0)
    points = low + np.random.default_rng(0).random((_SAMPLES, 5)) * 1.1 * (high - low)
    found = []
    for own in fronts:
        covered = np.zeros(_SAMPLES, dtype=np.bool_)
        for vector in own:
            covered |= (vector <= points).all(axis=1)
        found.append(float(covered.mean()))
    return found


def measure(methods: list[str], evaluations: int, seeds: int) -> list[dict[str, Any]]:
    runs = [
        (name, run(name, evaluations, seed)) for name in methods for seed in range(1, seeds + 1)
    ]
    early = min(250, evaluations)
    vectors = [one["vectors"] for _, one in runs]
    volumes = hypervolumes([v[:early] for v in vectors] + vectors)
    rows = []
    for name in methods:
        mine = [k for k, (other, _) in enumerate(runs) if other == name]
        row: dict[str, Any] = {
            "method": name,
            "hypervolume_early": statistics.median(volumes[k] for k in mine),
            "hypervolume": statistics.median(volumes[len(runs) + k] for k in mine),
            "hypervolumes": sorted(volumes[len(runs) + k] for k in mine),
        }
        row |= {p: statistics.median(runs[k][1]["best"][p] for k in mine) for p in "ABC"}
        rows.append(row)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--methods", default=";".join(["hype", "cma-es", "random", *PYMOO]))
    parser.add_argument("--evaluations", type=int, default=625)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    rows = measure(given.methods.split(";"), given.evaluations, given.seeds)
    if given.json:
        print(json.dumps(rows))
        return
    print(f"{'method':14} {'at 250':>8} {'at end':>8} {'least':>8} {'A':>8} {'B':>8} {'C':>9}")
    for row in rows:
        print(
            f"{row['method']:14} {row['hypervolume_early']:8.3f} {row['hypervolume']:8.3f}"
            f" {row['hypervolumes'][0]:8.3f} {row['A']:8.2f} {row['B']:8.2f} {row['C']:9.0f}"
        )


if __name__ == "__main__":
    main()
