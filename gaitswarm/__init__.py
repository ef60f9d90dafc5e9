"""The Python library: simulate designs, run jobs, ask about them.

    import gaitswarm

    result = gaitswarm.optimize(controller="pi", scenarios="normal-fast", iterations=10)
    walk = gaitswarm.simulate(result.best.design, controller="pi", log=True)

    with gaitswarm.connect("http://127.0.0.1:8000") as jobs:
        job = jobs.submit(controller="pi", iterations=10)
        for event in jobs.follow(job.id):
            print(event)

A name is imported when it is first used, so that `import gaitswarm` takes no time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from gaitswarm.errors import (
        Conflict,
        EvaluatorUnavailable,
        GaitswarmError,
        IdempotencyConflict,
        Interrupted,
        InvalidRequest,
        JobEnded,
        LeaseLost,
        NotFound,
        StoreUnavailable,
        Unavailable,
    )
    from gaitswarm.simulation import simulate
    from gaitswarm.simulation_result import ScenarioResult, SimulationResult
    from gaitswarm.tables import EvaluationTable, Table
    from services.optimizer.jobs.identification import IdentificationSpec
    from services.optimizer.jobs.preference import PREFERENCES, Preference
    from services.optimizer.jobs.tuning import JobSpec
    from services.optimizer.search.pso import PsoSettings
    from sim.controllers import CONTROLLERS
    from sim.kernel.observation import WalkLog
    from sim.outcome import OBJECTIVES, Status
    from sim.robot import RobotFiles, RobotVariant
    from sim.scenario import SCENARIOS, Scenario
    from sim.variables import Variable

    __version__: str

__all__ = [
    "CONTROLLERS",
    "OBJECTIVES",
    "PREFERENCES",
    "SCENARIOS",
    "Conflict",
    "EvaluationTable",
    "EvaluatorUnavailable",
    "GaitswarmError",
    "IdempotencyConflict",
    "IdentificationSpec",
    "Interrupted",
    "InvalidRequest",
    "JobEnded",
    "JobSpec",
    "LeaseLost",
    "NotFound",
    "Preference",
    "PsoSettings",
    "RobotFiles",
    "RobotVariant",
    "Scenario",
    "ScenarioResult",
    "SimulationResult",
    "Status",
    "StoreUnavailable",
    "Table",
    "Unavailable",
    "Variable",
    "WalkLog",
    "__version__",
    "simulate",
]

_MODULES: Final = {
    "gaitswarm.errors": (
        "Conflict", "EvaluatorUnavailable", "GaitswarmError", "IdempotencyConflict", "Interrupted",
        "InvalidRequest", "JobEnded", "LeaseLost", "NotFound", "StoreUnavailable", "Unavailable",
    ),
    "gaitswarm.simulation": ("simulate",),
    "gaitswarm.simulation_result": ("ScenarioResult", "SimulationResult"),
    "gaitswarm.tables": ("EvaluationTable", "Table"),
    "services.optimizer.jobs.identification": ("IdentificationSpec",),
    "services.optimizer.jobs.preference": ("PREFERENCES", "Preference"),
    "services.optimizer.jobs.tuning": ("JobSpec",),
    "services.optimizer.search.pso": ("PsoSettings",),
    "sim.controllers": ("CONTROLLERS",),
    "sim.kernel.observation": ("WalkLog",),
    "sim.outcome": ("OBJECTIVES", "Status"),
    "sim.robot": ("RobotFiles", "RobotVariant"),
    "sim.scenario": ("SCENARIOS", "Scenario"),
    "sim.variables": ("Variable",),
}  # fmt: skip
"""Where each name is defined."""

_HOMES: Final = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        found: Any = _version()
    elif name in _HOMES:
        from importlib import import_module

        found = getattr(import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _version() -> str:
    """Of the installed package; a bare checkout has none."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("gaitswarm")
    except PackageNotFoundError:
        return "0+unknown"
