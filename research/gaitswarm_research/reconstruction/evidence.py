"""Evidence of the reconstruction, and the file that keeps results of random designs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from gaitswarm import (
    PREFERENCES,
    CalibrationSpec,
    EvaluationTable,
    IdentifiabilityView,
    Jobs,
    JobView,
    TargetsView,
)
from gaitswarm_research.reconstruction import optimality as optimality_module
from gaitswarm_research.reconstruction.bound import greatest_product
from gaitswarm_research.reconstruction.conventions import (
    CHAPTER_4,
    Alternative,
    Choice,
    alternatives,
    default_choice,
    predicted,
    simulated_targets,
)
from gaitswarm_research.reconstruction.deviations import PUBLISHED
from gaitswarm_research.reconstruction.optimality import (
    OPTIMA,
    Optimality,
    optimality,
    published_designs,
    random_designs,
    simulate_designs,
)
from gaitswarm_research.reconstruction.targets import Size

Floats = NDArray[np.float64]

RESULTS_FILE: Final = "optimality.json"
"""Results of random designs, in the output folder."""

PRINTED: Final = {row.label: row.fitness for row in PUBLISHED if row.label in OPTIMA}
"""f_G of table 4.6, each under its own preference."""

_SEED: Final = 1
"""Seed of the random designs, the same for every choice."""


class RandomDesigns(BaseModel):
    """Results of optima and random designs in chapter 4's scenarios under one choice.

    Attributes:
        means: Geometric means of f1 to f5 over the scenarios, by optimum that does not fail.
    """

    model_config = ConfigDict(frozen=True)

    optimality: Optimality
    means: dict[str, list[float]]


_RESULTS: Final = TypeAdapter(dict[str, RandomDesigns])


@dataclass(frozen=True, slots=True)
class Assessment:
    """One choice of conventions with all evidence on it.

    Attributes:
        label: Name of the choice in the report.
        simulated: (T,) values of the targets.
        fitness: Misfit [tolerances].
    """

    label: str
    choice: Choice
    simulated: Floats
    fitness: float
    designs: RandomDesigns

    def product_bound(self) -> float | None:
        """Greatest f_C with A's torque and speed if f_A is within 10 % of the printed one."""
        means = self.designs.means.get("A")
        if means is None:
            return None
        return greatest_product(PREFERENCES["A"], 1.1 * PRINTED["A"], {0: means[0], 4: means[4]})


@dataclass(frozen=True, slots=True)
class Evidence:
    """Contents of the report.

    Attributes:
        spec: Specification of the calibrations, which differ in their seed.
        runs: All evaluations of each calibration.
        parameters: Agreement of the calibrations on each convention.
        by_target: Targets, each left out in turn.
        by_walk: Targets, each left out with all of its walk.
        defaults: Values of the default, by convention.
        default: The model as it ships.
        best: Best choice of each calibration.
        changed: Default with one convention changed.
        predictions: Results of optima that are no targets, by label of the choice.
    """

    spec: CalibrationSpec
    size: Size
    runs: tuple[EvaluationTable, ...]
    parameters: IdentifiabilityView
    by_target: TargetsView
    by_walk: TargetsView
    defaults: Mapping[str, float | str]
    default: Assessment
    best: tuple[Assessment, ...]
    changed: tuple[tuple[Alternative, Assessment], ...]
    predictions: Mapping[str, Mapping[str, Mapping[str, float | None]]]

    @property
    def winner(self) -> Assessment:
        """Best choice of all calibrations."""
        return min(self.best, key=lambda assessment: assessment.fitness)

    def remaining(self, column: int) -> list[str]:
        """Choices of a categorical convention that the evidence leaves.

        A search may leave a choice early that would do as well, so the default and its changes
        count, too.
        """
        variable = self.spec.design_space().variables[column]
        choices = self.parameters.parameters[column].choices
        limit = self.spec.as_good_as(self.winner.fitness)
        near = {choice.name for choice in choices if choice.remains}
        for one in (self.default, *(assessment for _, assessment in self.changed)):
            if one.fitness <= limit:
                value = one.choice.get(variable.name)
                shown = self.defaults[variable.name] if value is None else variable.shown(value)
                near.add(str(shown))
        return [choice.name for choice in choices if choice.name in near]

    def choices(self) -> Iterator[Assessment]:
        """All choices that random designs were simulated under."""
        yield self.default
        yield from self.best
        yield from (assessment for _, assessment in self.changed)


def gather(
    spec: CalibrationSpec,
    jobs: Jobs,
    calibrated: Sequence[JobView],
    size: Size,
    folder: Path,
    workers: Executor,
    change: Sequence[str] | None = None,
    on_choice: Callable[[int, int, str], None] = lambda _k, _n, _label: None,
) -> Evidence:
    """Analyse the calibrations and simulate random designs."""
    default, others = default_choice(spec, CHAPTER_4), alternatives(spec, change)
    ids = [job.id for job in calibrated]
    runs = [jobs.evaluations(job_id) for job_id in ids]
    named: list[tuple[str, Choice, int]] = [("default", {}, size.samples)]
    for number, run in enumerate(runs, start=1):
        row = run.designs[int(np.nanargmin(run.fitness))]
        best_choice = dict(zip(spec.design_space().names, row.tolist(), strict=True))
        named.append((f"best of seed {number}", best_choice, size.samples))
    named += [(f"{a.variable.name} {a.shown}", a.choice, size.samples_each) for a in others]
    simulated, fitness = simulated_targets(spec, [choice for _, choice, _ in named], workers)
    results = ResultsFile(folder, spec, calibrated[0])
    assessments = []
    for index, (label, choice, samples) in enumerate(named):
        on_choice(index, len(named), label)
        designs = results.get_or_compute({**default, **choice}, samples, workers)
        assessments.append(
            Assessment(label, choice, simulated[index], float(fitness[index]), designs)
        )
    best = tuple(assessments[1 : 1 + len(runs)])
    main = (assessments[0], *best)
    predictions = predicted(spec, [one.choice for one in main], workers)
    return Evidence(
        spec=spec,
        size=size,
        runs=tuple(runs),
        parameters=jobs.parameters(ids),
        by_target=jobs.targets(ids, leave_out="target"),
        by_walk=jobs.targets(ids, leave_out="walk"),
        defaults=spec.design_space().shown(list(default.values())),
        default=assessments[0],
        best=best,
        changed=tuple(zip(others, assessments[1 + len(runs) :], strict=True)),
        predictions={one.label: rows for one, rows in zip(main, predictions, strict=True)},
    )


class ResultsFile:
    """Results of random designs in a file, by all that they depend on."""

    def __init__(self, folder: Path, spec: CalibrationSpec, calibration: JobView) -> None:
        self._path = folder / RESULTS_FILE
        self._robots = [str(robot) for robot in spec.robot_sources]
        code = Path(str(optimality_module.__file__)).read_bytes()
        self._dependencies = {
            "robots": self._robots,
            "provenance": calibration.provenance[-1].provenance.model_dump(mode="json"),
            "code": hashlib.sha256(code).hexdigest(),
        }
        self._results = self._read()

    def get_or_compute(self, choice: Choice, samples: int, workers: Executor) -> RandomDesigns:
        """Return the stored result, or compute and store it."""
        request = {"choice": dict(choice), "samples": samples, "seed": _SEED, **self._dependencies}
        key = hashlib.sha256(json.dumps(request, sort_keys=True).encode()).hexdigest()
        if key not in self._results:
            self._results[key] = self._compute(choice, samples, workers)
            temporary = self._path.with_suffix(".tmp")
            temporary.write_bytes(_RESULTS.dump_json(self._results, indent=1))
            temporary.replace(self._path)
        return self._results[key]

    def _compute(self, choice: Choice, samples: int, workers: Executor) -> RandomDesigns:
        designs = np.concatenate([published_designs(), random_designs(samples, _SEED)])
        objectives, failed = simulate_designs(choice, designs, robots=self._robots, workers=workers)
        means = {
            name: np.exp(np.log(objectives[k, :, :5]).mean(axis=0)).tolist()
            for k, name in enumerate(OPTIMA)
            if not failed[k].any()
        }
        return RandomDesigns(optimality=optimality(objectives, failed), means=means)

    def _read(self) -> dict[str, RandomDesigns]:
        """An unreadable file holds nothing."""
        try:
            return _RESULTS.validate_json(self._path.read_bytes())
        except (OSError, ValidationError):
            return {}
