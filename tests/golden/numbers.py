"""Numbers that no change may move: the published optimum, and the demo's jobs."""

from __future__ import annotations

import hashlib
import json
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitswarm import optimize
from gaitswarm.services.optimizer.jobs.constraints import Constraint
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import judge_outcomes
from gaitswarm.services.runtime import open_evaluator, open_store, run_embedded
from gaitswarm.sim.assembly import Backend
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, Status
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples.walks import short_walk, torque_quadruped_files, walk

FILE: Final = Path(__file__).with_name("numbers.json")

ITERATIONS: Final = 5
"""Of the demo's job, that are kept: all of them would take half a minute."""

DEMO: Final = JobSpec(preference="A", iterations=25, seed=2)
"""The job of `make demo`, by the default search method: 625 designs."""

GAIT_DEMO: Final = JobSpec(
    preference="A",
    iterations=25,
    seed=1,
    constraints=(Constraint(quantity="*", relative_to="published:A", max=1.0),),
).with_gait_searched()
"""The second job of `make demo`: controller and gait, no worse than the published optimum."""

TORQUE_WALK: Final = short_walk(cycles=1.0, cycle_time=0.5)

TORQUE_DESIGNS: Final[dict[str, dict[str, float]]] = {
    "joint-pd": {"Kp": 40.0, "Kd": 1.0, "feed_forward": 0.8},
    "pid": {"P": 0.5, "I": 0.1, "D": 0.01},
}

Optimum = dict[str, dict[str, float]]
"""By scenario, by objective."""


@dataclass(frozen=True, slots=True)
class DemoIteration:
    """One iteration of the demo's job.

    designs: digest of all designs' bits. fitness: of every design; less strict, because
    a drive's tables are quantised.
    """

    designs: str
    fitness: list[float]


@dataclass(frozen=True, slots=True)
class Best:
    """The best design of the demo's job, and where it was found."""

    iteration: int
    particle: int
    fitness: float
    design: dict[str, float]


@dataclass(frozen=True, slots=True)
class Numbers:
    """optimum: objectives of design A. torque: objectives of the quadruped with torque-controlled
    actuators, by controller. iterations: the first of the demo. best: its last word. gait_best:
    that of the demo's second job.
    """

    optimum: Optimum
    torque: Optimum
    iterations: list[DemoIteration]
    best: Best
    gait_best: Best


def objectives_of_the_optimum(
    scenarios: tuple[Scenario, ...] = SCENARIOS, *, backend: Backend = "native"
) -> Optimum:
    """What the published design A is worth."""
    found = {}
    for scenario in scenarios:
        outcome = walk(scenario, backend=backend).outcome
        assert outcome.statuses.tolist() == [Status.OK]
        found[scenario.name] = dict(
            zip(OBJECTIVE_NAMES, outcome.objectives[0].tolist(), strict=True)
        )
    return found


def objectives_with_torque(*, backend: Backend = "native") -> Optimum:
    """What designs of a robot with torque-controlled actuators are worth."""
    robot, found = load_robot(torque_quadruped_files()), {}
    for controller, design in TORQUE_DESIGNS.items():
        outcome = walk(TORQUE_WALK, design, controller, robot=robot, backend=backend).outcome
        assert outcome.statuses.tolist() == [Status.OK]
        found[controller] = dict(zip(OBJECTIVE_NAMES, outcome.objectives[0].tolist(), strict=True))
    return found


def run_demo(most: int | None) -> tuple[list[DemoIteration], Evaluation]:
    """The first iterations of the demo's job, None for all, and the best design in them."""
    with tempfile.TemporaryDirectory() as folder:
        store = open_store(str(Path(folder) / "jobs.db"))
        evaluator = open_evaluator("in-process")
        enough = threading.Event()
        job, _ = store.create_job(DEMO)

        def stop_after(iteration: Iteration) -> None:
            if iteration.index + 1 == most:
                enough.set()

        run_embedded(store, evaluator, job.id, on_iteration=stop_after, stop=enough)
        done = store.job(job.id).progress.iterations
        iterations = [_iteration(store.evaluations(job.id, index)) for index in range(done)]
        best = store.best(job.id)
        evaluator.close()
        store.close()
    assert best is not None
    return iterations, best


def _iteration(evaluations: Sequence[Evaluation]) -> DemoIteration:
    designs = hashlib.sha256(b"".join(e.design.tobytes() for e in evaluations))
    return DemoIteration(designs.hexdigest(), [e.fitness for e in evaluations])


def fitness_of(design: dict[str, float]) -> float:
    """What the demo's job says of a design."""
    values = np.array([[design[name] for name in DEMO.design_space().names]])
    outcomes = tuple(case.run(values) for case in DEMO.cases({}))
    return float(judge_outcomes(DEMO, outcomes).fitness[0])


def run_gait_demo() -> Best:
    """The best design of the demo's second job."""
    with tempfile.TemporaryDirectory() as folder:
        best = optimize(GAIT_DEMO, db=Path(folder) / "jobs.db").best
        assert best.fitness is not None
        design = {name: float(value) for name, value in best.design.items()}
        return Best(best.iteration, best.particle, best.fitness, design)


def measure() -> Numbers:
    """All numbers as this version has them; both jobs take a minute."""
    iterations, best = run_demo(None)
    design = dict(zip(DEMO.design_space().names, best.design.tolist(), strict=True))
    return Numbers(
        objectives_of_the_optimum(),
        objectives_with_torque(),
        iterations[:ITERATIONS],
        Best(best.iteration, best.particle, best.fitness, design),
        run_gait_demo(),
    )


def write(numbers: Numbers) -> None:
    """Keep them, exact to the bit."""
    document = {
        "optimum": _hex(numbers.optimum),
        "torque": _hex(numbers.torque),
        "demo": {
            "iterations": [
                {"designs": iteration.designs, "fitness": _hex(iteration.fitness)}
                for iteration in numbers.iterations
            ],
            "best": _best(numbers.best),
            "gait_best": _best(numbers.gait_best),
        },
    }
    FILE.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def read() -> Numbers:
    """The numbers that are kept."""
    document = json.loads(FILE.read_text(encoding="utf-8"))
    demo = document["demo"]
    return Numbers(
        _from_hex(document["optimum"]),
        _from_hex(document["torque"]),
        [
            DemoIteration(iteration["designs"], _from_hex(iteration["fitness"]))
            for iteration in demo["iterations"]
        ],
        _best_of(demo["best"]),
        _best_of(demo["gait_best"]),
    )


def _best(best: Best) -> dict[str, Any]:
    return asdict(best) | {"fitness": best.fitness.hex(), "design": _hex(best.design)}


def _best_of(kept: dict[str, Any]) -> Best:
    """Inverse of `_best`."""
    fitness, design = float.fromhex(kept["fitness"]), _from_hex(kept["design"])
    return Best(**kept | {"fitness": fitness, "design": design})


def _hex(numbers: Any) -> Any:
    """Nested numbers as hexadecimal text."""
    if isinstance(numbers, dict):
        return {name: _hex(value) for name, value in numbers.items()}
    return [_hex(value) for value in numbers] if isinstance(numbers, list) else numbers.hex()


def _from_hex(text: Any) -> Any:
    """Inverse of `_hex`."""
    if isinstance(text, dict):
        return {name: _from_hex(value) for name, value in text.items()}
    return [_from_hex(value) for value in text] if isinstance(text, list) else float.fromhex(text)
