"""Runs of methods on problems: executed in processes, and recorded in a CSV file."""

from __future__ import annotations

import csv
import json
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm import InvalidRequest, optimizers
from gaitswarm.plugins import RandomNumbers, create_search
from gaitswarm_research.compare.problems import NAMES, problem
from gaitswarm_research.compare.rivals import RIVALS

Floats = NDArray[np.float64]

CHECKPOINTS: Final = (25, 50, 100, 250, 625, 1250, 2500, 5000)
"""Evaluations after which the best so far is recorded, as far as the budget reaches."""

_KEY: Final = ("problem", "method", "settings", "evaluations", "repetition", "seed")
_RESULTS: Final = ("to_best", "to_target", "cpu_s")
HEADER: Final = (*_KEY, *(f"best_{count}" for count in CHECKPOINTS), *_RESULTS, "versions")

_SEEDS: Final = 3
_SETTINGS: Final = 2_001
"""Purposes of random streams."""


@dataclass(frozen=True, slots=True)
class Task:
    """A run that is to be executed.

    Attributes:
        settings: Settings of the method as JSON; empty for its defaults.
        evaluations: Budget, one of `CHECKPOINTS`.
        repetition: Number of the run, from 0.
    """

    problem: str
    method: str
    settings: str
    evaluations: int
    repetition: int
    seed: int


@dataclass(frozen=True, slots=True)
class Run:
    """A recorded run.

    Attributes:
        best: Least fitness after each of `CHECKPOINTS`; NaN beyond the budget or without a
            successful evaluation.
        to_best: Evaluations until the best design; NaN without one.
        to_target: Evaluations until the target; NaN if it was not reached.
        cpu_s: Processor time [s].
    """

    task: Task
    best: tuple[float, ...]
    to_best: float
    to_target: float
    cpu_s: float
    versions: str = ""

    @property
    def final(self) -> float:
        """Least fitness at the end of the budget, +inf without one."""
        value = self.best[CHECKPOINTS.index(self.task.evaluations)]
        return math.inf if math.isnan(value) else value


def seeds(count: int, seed: int = 1) -> list[int]:
    """Return the seeds of repetitions; run k has the same seed for every method and problem."""
    return [int(u * 2.0**31) for u in RandomNumbers(seed, _SEEDS).uniform(count).tolist()]


def tasks(
    methods: Sequence[str],
    problems: Sequence[str],
    *,
    repetitions: int,
    evaluations: int,
    seed: int = 1,
    random_settings: bool = False,
) -> list[Task]:
    """List the runs of a comparison, repetition by repetition.

    Raises:
        InvalidRequest: A name or the budget is unknown, or a library is missing.
    """
    for name in problems:
        if name not in NAMES:
            raise InvalidRequest(f"unknown {name!r}; known are {', '.join(NAMES)}", field="problem")
    for name in methods:
        check_method(name)
    if evaluations not in CHECKPOINTS:
        known = ", ".join(map(str, CHECKPOINTS))
        raise InvalidRequest(f"must be one of {known}", field="evaluations")
    return [
        Task(
            name,
            method,
            json.dumps(drawn_settings(method, run_seed)) if random_settings else "",
            evaluations,
            repetition,
            run_seed,
        )
        for repetition, run_seed in enumerate(seeds(repetitions, seed))
        for name in problems
        for method in methods
    ]


def check_method(name: str) -> None:
    """Check that a method exists, has a single objective, and is installed.

    Raises:
        InvalidRequest: It cannot be compared; says why.
    """
    if name in RIVALS:
        missing = [library for library in RIVALS[name][1].split() if not _version(library)]
        remedy = "pip install './research[rivals]'"
    elif name in _views():
        remedy = _views()[name].needs or ""
        missing = ["a library"] if remedy else []
    else:
        known = ", ".join((*_views(), *RIVALS))
        raise InvalidRequest(f"unknown method {name!r}; known are {known}", field="methods")
    if missing:
        needed = f"{name} needs {', '.join(missing)}, which is not installed: {remedy}"
        raise InvalidRequest(needed, field="methods")


@cache
def _views() -> Mapping[str, Any]:
    """Methods that can be compared by one fitness, by name."""
    return {view.name: view for view in optimizers() if view.name != "hype"}


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return ""


_SWARM: Final = {
    "particles": (12, 50),
    "cognitive": (0.25, 2.0),
    "social": (0.75, 2.5),
    "inertia_start": (0.7, 1.0),
    "inertia_end": (0.3, 0.7),
    "velocity_limit": (0.25, 1.0),
}

RANGES: Final[Mapping[str, Mapping[str, tuple[float, float]]]] = {"pso": _SWARM, "pso-ps": _SWARM}
"""Ranges of random settings where half to twice the default is not reasonable."""


def drawn_settings(method: str, seed: int) -> dict[str, Any]:
    """Draw settings: numbers from half to twice their default, choices with equal probability."""
    if method in RIVALS:
        return {}
    view, random = _views()[method], RandomNumbers(seed, _SETTINGS)
    defaults = view.settings.model_dump()
    drawn: dict[str, Any] = {"name": defaults["name"]}
    for name, schema in view.settings_schema["properties"].items():
        draw = float(random.uniform())
        default, kind = defaults[name], schema.get("type")
        if name == "name":
            continue
        if "enum" in schema:
            drawn[name] = schema["enum"][int(draw * len(schema["enum"]))]
        elif kind == "boolean":
            drawn[name] = draw < 0.5
        elif kind in ("integer", "number") and default:
            low, high = RANGES.get(method, {}).get(name, (0.5 * default, 2.0 * default))
            low = max(low, schema.get("minimum", schema.get("exclusiveMinimum", low)))
            high = min(high, schema.get("maximum", schema.get("exclusiveMaximum", high)))
            value = low + draw * (high - low)
            drawn[name] = round(value) if kind == "integer" else value
    return drawn


class _Ended(Exception):
    """The budget is spent or the target reached."""


@dataclass(slots=True)
class Recorder:
    """Evaluates what a search asks for, and records every improvement."""

    task: Task
    done: int = 0
    to_target: float = math.nan
    improvements: list[tuple[int, float, Floats]] = field(default_factory=list)

    @property
    def excess(self) -> Floats | None:
        return problem(self.task.problem).excess

    def __call__(self, positions: Floats) -> Floats:
        case, budget = problem(self.task.problem), self.task.evaluations
        designs = case.space.designs(positions[: budget - self.done])
        fitness = case.fitness(designs, seed=self.task.seed, first=self.done)
        for design, value in zip(designs, fitness.tolist(), strict=True):
            self.done += 1
            if value < (self.improvements[-1][1] if self.improvements else math.inf):
                self.improvements.append((self.done, value, design))
            if case.target is not None and value <= case.target and math.isnan(self.to_target):
                self.to_target = float(self.done)
        if self.done >= budget or not math.isnan(self.to_target):
            raise _Ended
        return fitness

    def best(self) -> tuple[float, ...]:
        """Least fitness at each checkpoint, evaluated as it is reported."""
        at = [
            sum(done <= count for done, *_ in self.improvements) - 1
            if count <= self.task.evaluations
            else -1
            for count in CHECKPOINTS
        ]
        shown = sorted(set(at) - {-1})
        if not shown:
            return (math.nan,) * len(at)
        designs = np.array([self.improvements[k][2] for k in shown])
        searched = np.array([self.improvements[k][1] for k in shown])
        final = problem(self.task.problem).final(designs, searched).tolist()
        values = dict(zip(shown, final, strict=True))
        curve = [values.get(k, math.nan) for k in at]
        # As many digits as the file has, so that a resumed comparison has the same numbers.
        return tuple(float(f"{v:.9g}") if math.isfinite(v) else math.nan for v in curve)


def search(task: Task) -> Recorder:
    """Search until the budget is spent or the target reached."""
    recorder = Recorder(task)
    space, start = problem(task.problem).space, problem(task.problem).start
    with suppress(_Ended):
        if task.method in RIVALS:
            RIVALS[task.method][0](space, task.seed, recorder, start)
        settings = json.loads(task.settings) if task.settings else task.method
        method = create_search(settings, space, task.evaluations, task.seed, start)
        while True:
            method.tell(recorder(method.ask(task.evaluations - method.evaluations)))
    return recorder


def execute(task: Task) -> Run:
    """Execute a run."""
    began = time.process_time()
    recorder = search(task)
    to_best = float(recorder.improvements[-1][0]) if recorder.improvements else math.nan
    libraries = RIVALS[task.method][1].split() if task.method in RIVALS else []
    versions = " ".join(f"{name} {_version(name)}" for name in ("gaitswarm", "numpy", *libraries))
    cpu = time.process_time() - began
    return Run(task, recorder.best(), to_best, recorder.to_target, cpu, versions)


def execute_missing(
    wanted: Iterable[Task], path: Path, *, processes: int, progress: Callable[[Run], None]
) -> list[Run]:
    """Execute the runs that a file does not have, append them, and return all that were wanted.

    An interrupted comparison resumes: every run is appended as soon as it has ended.
    """
    wanted = list(wanted)
    recorded = {run.task: run for run in read([path])} if path.exists() else {}
    missing = [task for task in wanted if task not in recorded]
    for name in dict.fromkeys(task.problem for task in missing):
        # Compiles the robot's kernel once, before the processes need it.
        space = problem(name).space
        middle = space.designs(space.from_unit(np.full((1, space.dimension), 0.5)))
        problem(name).fitness(middle, seed=1, first=0)
    if missing:
        with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
            try:
                for future in as_completed([pool.submit(execute, task) for task in missing]):
                    run = future.result()
                    append(path, run)
                    recorded[run.task] = run
                    progress(run)
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    return [recorded[task] for task in wanted]


def append(path: Path, run: Run) -> None:
    """Add a run to a file, with its header if the file is new."""
    path.parent.mkdir(parents=True, exist_ok=True)
    is_new = not path.exists()
    task = run.task
    row = [task.problem, task.method, task.settings, task.evaluations, task.repetition, task.seed]
    row += [_text(value) for value in (*run.best, run.to_best, run.to_target)]
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(HEADER)
        writer.writerow([*row, f"{run.cpu_s:.2f}", run.versions])


def read(paths: Iterable[Path]) -> Iterator[Run]:
    """Read the runs of files, those of the recorded comparisons in research/data included.

    Raises:
        InvalidRequest: A file cannot be read as runs.
    """
    for path in paths:
        try:
            with path.open(newline="", encoding="utf-8") as file:
                for row in csv.DictReader(file):
                    yield _run(row)
        except (OSError, KeyError, ValueError, TypeError) as error:
            raise InvalidRequest(f"cannot read {path} as runs: {error!r}", field="runs") from error


def _run(row: Mapping[str, str]) -> Run:
    task = Task(
        row["problem"],
        row["method"],
        row["settings"],
        *(int(row[name]) for name in ("evaluations", "repetition", "seed")),
    )
    best = tuple(_number(row[f"best_{count}"]) for count in CHECKPOINTS)
    to_best, to_target, cpu_s = (_number(row[name]) for name in _RESULTS)
    versions = row.get("versions") or row.get("libraries", "")
    return Run(task, best, to_best, to_target, cpu_s, versions)


def _text(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.9g}"


def _number(text: str) -> float:
    return float(text) if text else math.nan
