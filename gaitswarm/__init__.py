"""The Python library: simulate designs, run jobs, ask about them.

.. code-block:: python

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
        Forbidden,
        GaitswarmError,
        IdempotencyConflict,
        Interrupted,
        InvalidRequest,
        JobEnded,
        LeaseLost,
        NotFound,
        ProvenanceChanged,
        QuotaExceeded,
        StoreUnavailable,
        TooManyRequests,
        Unauthorized,
        Unavailable,
        Unreadable,
    )
    from gaitswarm.evidence.verify import verify
    from gaitswarm.firmware import FirmwareOptions, FirmwareView, write_firmware
    from gaitswarm.jobs.asynchronous import AsyncDatabaseJobs, AsyncJobs
    from gaitswarm.jobs.base import JobEvent, Jobs
    from gaitswarm.jobs.database import DatabaseJobs
    from gaitswarm.jobs.open import connect, connect_async, open, open_async  # noqa: A004
    from gaitswarm.jobs.server import ServerJobs
    from gaitswarm.optimization import (
        OptimizationResult,
        optimize,
        optimizers,
        robust_preferences,
    )
    from gaitswarm.replay import WalkReplay
    from gaitswarm.robustness_index import RobustnessOptions, RobustnessView, robustness
    from gaitswarm.services.optimizer.analysis.certificate import CertificateView
    from gaitswarm.services.optimizer.analysis.comparison import JobComparisonView
    from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView
    from gaitswarm.services.optimizer.analysis.front import FrontView
    from gaitswarm.services.optimizer.analysis.identifiability import IdentifiabilityView
    from gaitswarm.services.optimizer.analysis.importance import ImportanceView
    from gaitswarm.services.optimizer.analysis.preferences import (
        PreferenceForView,
        RobustPreferencesView,
    )
    from gaitswarm.services.optimizer.analysis.ranking import RankingView
    from gaitswarm.services.optimizer.analysis.scenario_families import ScenarioFamiliesView
    from gaitswarm.services.optimizer.analysis.targets import TargetsView
    from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
    from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
    from gaitswarm.services.optimizer.jobs.kinds.identification import IdentificationSpec
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
    from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
    from gaitswarm.services.optimizer.jobs.labels import JobFilter
    from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference
    from gaitswarm.services.optimizer.run.outage import Backoff
    from gaitswarm.services.optimizer.search.automatic import AutoSettings
    from gaitswarm.services.optimizer.search.bayesian import BayesianSettings
    from gaitswarm.services.optimizer.search.cma_es import CmaEsSettings
    from gaitswarm.services.optimizer.search.differential_evolution import DeSettings
    from gaitswarm.services.optimizer.search.hype import HypeSettings
    from gaitswarm.services.optimizer.search.pso import PsoSettings
    from gaitswarm.services.optimizer.search.pso_ps import PsoPsSettings
    from gaitswarm.services.optimizer.search.random_search import RandomSearchSettings
    from gaitswarm.sim.calibration.targets import Target, TargetWalk
    from gaitswarm.sim.controllers import CONTROLLERS
    from gaitswarm.sim.identification.recorded_walk import RecordedWalk
    from gaitswarm.sim.kernel.observation import WalkLog
    from gaitswarm.sim.outcome import MEASUREMENTS, OBJECTIVES, Status
    from gaitswarm.sim.robot import RobotFiles, RobotVariant
    from gaitswarm.sim.scenario import PRESETS, SCENARIOS, Scenario
    from gaitswarm.sim.variables import Variable
    from gaitswarm.simulation import ScenarioResult, SimulationResult, simulate
    from gaitswarm.specs import SpecOptions, job_spec
    from gaitswarm.surface import SurfaceView
    from gaitswarm.tables import EvaluationTable, Table
    from gaitswarm.views.history import BestView, HistoryIterationView, IterationView
    from gaitswarm.views.job import JobSummaryView, JobView, StateView
    from gaitswarm.views.verification import VerificationView

    __version__: str

__all__ = [
    "CONTROLLERS", "MEASUREMENTS", "OBJECTIVES", "PREFERENCES", "PRESETS", "SCENARIOS",
    "AsyncDatabaseJobs", "AsyncJobs", "AutoSettings", "Backoff", "BayesianSettings", "BestView",
    "CalibrationSpec", "CertificateSpec", "CertificateView", "CmaEsSettings", "Conflict",
    "DatabaseJobs", "DeSettings", "EvaluationTable", "EvaluationView", "EvaluatorUnavailable",
    "FirmwareOptions", "FirmwareView", "Forbidden", "FrontView", "GaitswarmError",
    "HistoryIterationView", "HypeSettings", "IdempotencyConflict", "IdentifiabilityView",
    "IdentificationSpec", "ImportanceView", "Interrupted", "InvalidRequest", "IterationView",
    "JobComparisonView", "JobEnded", "JobEvent", "JobFilter", "JobSpec", "JobSummaryView",
    "JobView", "Jobs", "LeaseLost", "NotFound", "OptimizationResult", "Preference",
    "PreferenceForView", "ProvenanceChanged", "PsoPsSettings", "PsoSettings", "QuotaExceeded",
    "RandomSearchSettings", "RankingView", "RecordedWalk", "RobotFiles", "RobotVariant",
    "RobustPreferencesView", "RobustnessOptions", "RobustnessView", "Scenario",
    "ScenarioFamiliesView", "ScenarioResult", "ServerJobs", "SimulationResult", "SpecOptions",
    "StateView", "Status", "StoreUnavailable", "SurfaceView", "Table", "Target", "TargetWalk",
    "TargetsView", "TooManyRequests", "TuningWorlds", "Unauthorized", "Unavailable", "Unreadable",
    "Variable", "VerificationView", "WalkLog", "WalkReplay", "__version__", "connect",
    "connect_async", "job_spec", "open", "open_async", "optimize", "optimizers",
    "robust_preferences", "robustness", "simulate", "verify", "write_firmware",
]  # fmt: skip

_MODULES: Final = {
    "gaitswarm.errors": (
        "Conflict", "EvaluatorUnavailable", "Forbidden", "GaitswarmError", "IdempotencyConflict",
        "Interrupted", "InvalidRequest", "JobEnded", "LeaseLost", "NotFound", "ProvenanceChanged",
        "QuotaExceeded", "StoreUnavailable", "TooManyRequests", "Unauthorized", "Unavailable",
        "Unreadable",
    ),
    "gaitswarm.evidence.verify": ("verify",),
    "gaitswarm.firmware": ("FirmwareOptions", "FirmwareView", "write_firmware"),
    "gaitswarm.jobs.asynchronous": ("AsyncDatabaseJobs", "AsyncJobs"),
    "gaitswarm.jobs.base": ("JobEvent", "Jobs"),
    "gaitswarm.jobs.database": ("DatabaseJobs",),
    "gaitswarm.jobs.open": ("connect", "connect_async", "open", "open_async"),
    "gaitswarm.jobs.server": ("ServerJobs",),
    "gaitswarm.optimization": (
        "OptimizationResult", "optimize", "optimizers", "robust_preferences",
    ),
    "gaitswarm.simulation": ("ScenarioResult", "SimulationResult", "simulate"),
    "gaitswarm.specs": ("SpecOptions", "job_spec"),
    "gaitswarm.tables": ("EvaluationTable", "Table"),
    "gaitswarm.services.optimizer.analysis.evaluations": ("EvaluationView",),
    "gaitswarm.views.history": ("BestView", "HistoryIterationView", "IterationView"),
    "gaitswarm.views.job": ("JobSummaryView", "JobView", "StateView"),
    "gaitswarm.views.verification": ("VerificationView",),
    "gaitswarm.services.optimizer.analysis.preferences": (
        "PreferenceForView", "RobustPreferencesView",
    ),
    "gaitswarm.services.optimizer.analysis.front": ("FrontView",),
    "gaitswarm.services.optimizer.analysis.ranking": ("RankingView",),
    "gaitswarm.services.optimizer.analysis.importance": ("ImportanceView",),
    "gaitswarm.services.optimizer.analysis.scenario_families": ("ScenarioFamiliesView",),
    "gaitswarm.services.optimizer.analysis.certificate": ("CertificateView",),
    "gaitswarm.services.optimizer.analysis.targets": ("TargetsView",),
    "gaitswarm.services.optimizer.analysis.comparison": ("JobComparisonView",),
    "gaitswarm.services.optimizer.analysis.identifiability": ("IdentifiabilityView",),
    "gaitswarm.replay": ("WalkReplay",),
    "gaitswarm.robustness_index": ("RobustnessOptions", "RobustnessView", "robustness"),
    "gaitswarm.surface": ("SurfaceView",),
    "gaitswarm.services.optimizer.jobs.kinds.calibration": ("CalibrationSpec",),
    "gaitswarm.services.optimizer.jobs.kinds.certificate": ("CertificateSpec",),
    "gaitswarm.services.optimizer.jobs.labels": ("JobFilter",),
    "gaitswarm.services.optimizer.jobs.kinds.identification": ("IdentificationSpec",),
    "gaitswarm.services.optimizer.jobs.preference": ("PREFERENCES", "Preference"),
    "gaitswarm.services.optimizer.jobs.kinds.tuning": ("JobSpec",),
    "gaitswarm.services.optimizer.jobs.kinds.tuning_worlds": ("TuningWorlds",),
    "gaitswarm.services.optimizer.search.automatic": ("AutoSettings",),
    "gaitswarm.services.optimizer.search.cma_es": ("CmaEsSettings",),
    "gaitswarm.services.optimizer.search.differential_evolution": ("DeSettings",),
    "gaitswarm.services.optimizer.search.hype": ("HypeSettings",),
    "gaitswarm.services.optimizer.search.bayesian": ("BayesianSettings",),
    "gaitswarm.services.optimizer.search.random_search": ("RandomSearchSettings",),
    "gaitswarm.services.optimizer.search.pso": ("PsoSettings",),
    "gaitswarm.services.optimizer.search.pso_ps": ("PsoPsSettings",),
    "gaitswarm.services.optimizer.run.outage": ("Backoff",),
    "gaitswarm.sim.controllers": ("CONTROLLERS",),
    "gaitswarm.sim.calibration.targets": ("Target", "TargetWalk"),
    "gaitswarm.sim.identification.recorded_walk": ("RecordedWalk",),
    "gaitswarm.sim.kernel.observation": ("WalkLog",),
    "gaitswarm.sim.outcome": ("MEASUREMENTS", "OBJECTIVES", "Status"),
    "gaitswarm.sim.robot": ("RobotFiles", "RobotVariant"),
    "gaitswarm.sim.scenario": ("PRESETS", "SCENARIOS", "Scenario"),
    "gaitswarm.sim.variables": ("Variable",),
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
