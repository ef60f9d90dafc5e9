"""All that the reconstruction has found, and the results that it keeps for the next time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from gaitswarm.cli.atomic_file import replacing
from gaitswarm.cli.reconstruction.alternatives import (
    Alternative,
    alternatives,
    default_choice,
    predicted,
    simulated_targets,
)
from gaitswarm.cli.reconstruction.bound import greatest_product
from gaitswarm.cli.reconstruction.optimality import (
    Optimality,
    optimality,
    published_designs,
    random_designs,
    walk_all,
)
from gaitswarm.cli.reconstruction.plan import Size
from gaitswarm.services.optimizer.analysis.identifiability import (
    Identifiability,
    ParameterIdentifiability,
    identifiability,
)
from gaitswarm.services.optimizer.analysis.targets import TargetResults, target_results
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.sim.plugins import source_digest

Floats = NDArray[np.float64]

RESULTS_FILE: Final = "optimality.json"
"""In the output folder: what random designs came to."""

PRINTED: Final = {"A": 20.8696, "C": 1396908.0}
"""f_G of table 4.6, each by its own preference."""

_OPTIMALITY: Final = Path(__file__).parent / "optimality.py"

_SEED: Final = 1
"""Of the random designs, the same for every choice."""


class Walked(BaseModel):
    """What one choice of conventions came to in chapter 4's scenarios.

    Attributes:
        optimality: of the published optima.
        means: geometric means of f1 to f5 over the scenarios, by optimum; none for one that fails.
    """

    model_config = ConfigDict(frozen=True)

    optimality: Optimality
    means: dict[str, list[float]]


_KEPT: Final = TypeAdapter(dict[str, Walked])


@dataclass(frozen=True, slots=True)
class Found:
    """One choice of conventions with all evidence on it.

    Attributes:
        label: for people.
        choice: conventions as walks take them; what is not given is the default's.
        simulated: (T,) values of the targets.
        fitness: misfit [tolerances].
        walked: in chapter 4's scenarios, with random designs.
    """

    label: str
    choice: Mapping[str, float]
    simulated: Floats
    fitness: float
    walked: Walked

    def product_bound(self) -> float | None:
        """Greatest f_C of A's torque and speed if f_A is within 10 % of the printed one."""
        means = self.walked.means.get("A")
        if means is None:
            return None
        return greatest_product(PREFERENCES["A"], 1.1 * PRINTED["A"], {0: means[0], 4: means[4]})


@dataclass(frozen=True, slots=True)
class Evidence:
    """Everything that the report tells.

    Attributes:
        spec: of the calibrations, which differ in their seed.
        size: of the reconstruction.
        runs: all evaluations of each calibration.
        parameters: what the calibrations agree on.
        by_target: targets, each left out in its turn.
        by_walk: targets, each left out with all of its walk.
        defaults: what is changed from, by convention.
        default: the model as it is shipped.
        best: of each calibration.
        changed: one convention at a time.
        predictions: of optima that no target tells, by label of the choice.
    """

    spec: CalibrationSpec
    size: Size
    runs: tuple[EvaluationColumns, ...]
    parameters: Identifiability
    by_target: TargetResults
    by_walk: TargetResults
    defaults: Mapping[str, float | str]
    default: Found
    best: tuple[Found, ...]
    changed: tuple[tuple[Alternative, Found], ...]
    predictions: Mapping[str, Mapping[str, Mapping[str, float | None]]]

    @property
    def winner(self) -> Found:
        """The best of all calibrations."""
        return min(self.best, key=lambda found: found.fitness)

    def remaining(self, parameter: ParameterIdentifiability) -> list[str]:
        """Choices of a categorical convention that the evidence leaves.

        A search may leave early what would do as well, so the default and its changes count, too.
        """
        name, limit = parameter.variable.name, self.spec.as_good_as(self.winner.fitness)
        near = {choice.name for choice in parameter.choices if choice.remains}
        for one in (self.default, *(found for _, found in self.changed)):
            if one.fitness <= limit:
                given = one.choice.get(name)
                near.add(
                    str(self.defaults[name] if given is None else parameter.variable.shown(given))
                )
        return [choice.name for choice in parameter.choices if choice.name in near]

    def choices(self) -> Iterator[Found]:
        """All choices of conventions that random designs walked under."""
        yield self.default
        yield from self.best
        yield from (found for _, found in self.changed)


def gather(
    spec: CalibrationSpec,
    runs: Sequence[EvaluationColumns],
    size: Size,
    folder: Path,
    workers: Executor,
    change: Sequence[str] | None = None,
    on_choice: Callable[[int, int, str], None] = lambda _k, _n, _label: None,
) -> Evidence:
    """Compute what the calibrations do not tell, and analyse what they do."""
    default, others = default_choice(spec, "fuzzy-pi"), alternatives(spec, change)
    named: list[tuple[str, dict[str, float], int]] = [("default", {}, size.samples)]
    for number, run in enumerate(runs, start=1):
        row = run.designs[int(np.argmin(run.fitness))]
        choice = dict(zip(spec.design_space().names, row.tolist(), strict=True))
        named.append((f"best of seed {number}", choice, size.samples))
    named += [(f"{a.variable.name} {a.shown}", a.choice, size.samples_each) for a in others]
    simulated, fitness = simulated_targets(spec, [choice for _, choice, _ in named], workers)
    kept = Kept(folder, spec)
    found = []
    for index, (label, choice, samples) in enumerate(named):
        on_choice(index, len(named), label)
        walked = kept.get_or_walk(default | choice, samples, workers)
        found.append(Found(label, choice, simulated[index], float(fitness[index]), walked))
    best = tuple(found[1 : 1 + len(runs)])
    told = (found[0], *best)
    kept_rows = predicted(spec, [one.choice for one in told])
    return Evidence(
        spec=spec,
        size=size,
        runs=tuple(runs),
        parameters=identifiability(spec.design_space().variables, runs, spec.as_good_as),
        by_target=target_results(spec, runs, "target"),
        by_walk=target_results(spec, runs, "walk"),
        defaults=spec.design_space().shown(default.values()),
        default=found[0],
        best=best,
        changed=tuple(zip(others, found[1 + len(runs) :], strict=True)),
        predictions={one.label: rows for one, rows in zip(told, kept_rows, strict=True)},
    )


class Kept:
    """Results of random designs in a file, by all that they depend on."""

    def __init__(self, folder: Path, spec: CalibrationSpec) -> None:
        self._path = folder / RESULTS_FILE
        self._robots = spec.described
        provenance: dict[str, Any] = job_provenance(spec).model_dump(mode="json")
        code = source_digest(_OPTIMALITY.parent, [_OPTIMALITY])
        self._common = {"robots": list(spec.described), "provenance": provenance, "code": code}
        self._results = self._read()

    def get_or_walk(self, choice: Mapping[str, float], samples: int, workers: Executor) -> Walked:
        """What was computed before, or is now."""
        asked = {"choice": dict(choice), "samples": samples, "seed": _SEED, **self._common}
        text = json.dumps(asked, sort_keys=True)
        key = hashlib.sha256(text.encode()).hexdigest()
        if key not in self._results:
            self._results[key] = self._walk(choice, samples, workers)
            with replacing(self._path, "output") as file:
                file.write(_KEPT.dump_json(self._results, indent=1))
        return self._results[key]

    def _walk(self, choice: Mapping[str, float], samples: int, workers: Executor) -> Walked:
        published = published_designs()
        designs = np.concatenate([published, random_designs(samples, _SEED)])
        objectives, failed = walk_all(choice, designs, robots=self._robots, workers=workers)
        means = {
            name: np.exp(np.log(objectives[k, :, :5]).mean(axis=0)).tolist()
            for k, name in enumerate(("A", "B", "C"))
            if not failed[k].any()
        }
        return Walked(optimality=optimality(objectives, failed), means=means)

    def _read(self) -> dict[str, Walked]:
        """An unreadable file holds nothing."""
        try:
            return _KEPT.validate_json(self._path.read_bytes())
        except (OSError, ValidationError):
            return {}
