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
    from gaitswarm.firmware import write_firmware
    from gaitswarm.jobs.async_port import AsyncJobs
    from gaitswarm.jobs.database.async_jobs import AsyncDatabaseJobs
    from gaitswarm.jobs.database.jobs import DatabaseJobs
    from gaitswarm.jobs.open import connect, connect_async, open, open_async  # noqa: A004
    from gaitswarm.jobs.port import JobEvent, Jobs
    from gaitswarm.jobs.server.async_jobs import AsyncServerJobs
    from gaitswarm.jobs.server.jobs import ServerJobs
    from gaitswarm.optimization import OptimizationResult, optimize, optimizers
    from gaitswarm.preferences import robust_preferences
    from gaitswarm.requests.firmware import FirmwareOptions
    from gaitswarm.requests.robustness import RobustnessOptions
    from gaitswarm.simulation import robustness, simulate
    from gaitswarm.simulation_result import ScenarioResult, SimulationResult
    from gaitswarm.specs import SpecOptions
    from gaitswarm.tables import EvaluationTable, Table
    from gaitswarm.views import (
        BestView,
        EvaluationView,
        HistoryIterationView,
        IterationView,
        JobSummaryView,
        JobView,
        RankingView,
        StateView,
    )
    from gaitswarm.views.calibration import TargetsView
    from gaitswarm.views.certificate import CertificateView
    from gaitswarm.views.comparison import JobComparisonView
    from gaitswarm.views.families import ScenarioFamiliesView
    from gaitswarm.views.firmware import FirmwareView
    from gaitswarm.views.identification import IdentifiabilityView
    from gaitswarm.views.importance import ImportanceView
    from gaitswarm.views.preferences import RobustPreferencesView
    from gaitswarm.views.replay import WalkReplay
    from gaitswarm.views.robustness import RobustnessView
    from gaitswarm.views.surface import SurfaceView
    from gaitswarm.views.tournament import (
        ProblemRunsView,
        TournamentStandingsView,
        TournamentView,
    )
    from gaitswarm.views.trade_offs import FrontView, PreferenceForView
    from gaitswarm.views.verification import VerificationView
    from services.optimizer.jobs.kinds.calibration import CalibrationSpec
    from services.optimizer.jobs.kinds.certificate import CertificateSpec
    from services.optimizer.jobs.kinds.identification import IdentificationSpec
    from services.optimizer.jobs.kinds.tournament import TournamentSpec
    from services.optimizer.jobs.kinds.tuning import JobSpec
    from services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
    from services.optimizer.jobs.labels import JobFilter
    from services.optimizer.jobs.preference import PREFERENCES, Preference
    from services.optimizer.run.outage import Backoff
    from services.optimizer.search.automatic import AutoSettings
    from services.optimizer.search.evolution.cma_es import CmaEsSettings
    from services.optimizer.search.evolution.differential_evolution import DeSettings
    from services.optimizer.search.evolution.genetic import GaSettings
    from services.optimizer.search.evolution.hype import HypeSettings
    from services.optimizer.search.local.annealing import AnnealingSettings
    from services.optimizer.search.local.directed_tabu import DirectedTabuSettings
    from services.optimizer.search.local.mads import MadsSettings
    from services.optimizer.search.local.nelder_mead import NelderMeadSettings
    from services.optimizer.search.local.pattern_search import PatternSearchSettings
    from services.optimizer.search.model.bayesian import BayesianSettings
    from services.optimizer.search.multistart.global_search import (
        GlobalBfgsSettings,
        GlobalNelderMeadSettings,
        GlobalUnirandiSettings,
    )
    from services.optimizer.search.random_search import RandomSearchSettings
    from services.optimizer.search.swarm.gsa import GsaSettings
    from services.optimizer.search.swarm.pso import PsoSettings
    from services.optimizer.search.swarm.pso_ps import PsoPsSettings
    from services.optimizer.search.swarm.tlbo import TlboSettings
    from sim.calibration.targets import Target, TargetWalk
    from sim.controllers import CONTROLLERS
    from sim.identification.recorded_walk import RecordedWalk
    from sim.kernel.observation import WalkLog
    from sim.outcome import MEASUREMENTS, OBJECTIVES, Status
    from sim.robot import RobotFiles, RobotVariant
    from sim.scenario import PRESETS, SCENARIOS, Scenario
    from sim.variables import Variable

    __version__: str

__all__ = [
    "CONTROLLERS",
    "MEASUREMENTS",
    "OBJECTIVES",
    "PREFERENCES",
    "PRESETS",
    "SCENARIOS",
    "AnnealingSettings",
    "AsyncDatabaseJobs",
    "AsyncJobs",
    "AsyncServerJobs",
    "AutoSettings",
    "Backoff",
    "BayesianSettings",
    "BestView",
    "CalibrationSpec",
    "CertificateSpec",
    "CertificateView",
    "CmaEsSettings",
    "Conflict",
    "DatabaseJobs",
    "DeSettings",
    "DirectedTabuSettings",
    "EvaluationTable",
    "EvaluationView",
    "EvaluatorUnavailable",
    "FirmwareOptions",
    "FirmwareView",
    "Forbidden",
    "FrontView",
    "GaSettings",
    "GaitswarmError",
    "GlobalBfgsSettings",
    "GlobalNelderMeadSettings",
    "GlobalUnirandiSettings",
    "GsaSettings",
    "HistoryIterationView",
    "HypeSettings",
    "IdempotencyConflict",
    "IdentifiabilityView",
    "IdentificationSpec",
    "ImportanceView",
    "Interrupted",
    "InvalidRequest",
    "IterationView",
    "JobComparisonView",
    "JobEnded",
    "JobEvent",
    "JobFilter",
    "JobSpec",
    "JobSummaryView",
    "JobView",
    "Jobs",
    "LeaseLost",
    "MadsSettings",
    "NelderMeadSettings",
    "NotFound",
    "OptimizationResult",
    "PatternSearchSettings",
    "Preference",
    "PreferenceForView",
    "ProblemRunsView",
    "ProvenanceChanged",
    "PsoPsSettings",
    "PsoSettings",
    "QuotaExceeded",
    "RandomSearchSettings",
    "RankingView",
    "RecordedWalk",
    "RobotFiles",
    "RobotVariant",
    "RobustPreferencesView",
    "RobustnessOptions",
    "RobustnessView",
    "Scenario",
    "ScenarioFamiliesView",
    "ScenarioResult",
    "ServerJobs",
    "SimulationResult",
    "SpecOptions",
    "StateView",
    "Status",
    "StoreUnavailable",
    "SurfaceView",
    "Table",
    "Target",
    "TargetWalk",
    "TargetsView",
    "TlboSettings",
    "TooManyRequests",
    "TournamentSpec",
    "TournamentStandingsView",
    "TournamentView",
    "TuningWorlds",
    "Unauthorized",
    "Unavailable",
    "Unreadable",
    "Variable",
    "VerificationView",
    "WalkLog",
    "WalkReplay",
    "__version__",
    "connect",
    "connect_async",
    "open",
    "open_async",
    "optimize",
    "optimizers",
    "robust_preferences",
    "robustness",
    "simulate",
    "verify",
    "write_firmware",
]

_MODULES: Final = {
    "gaitswarm.errors": (
        "Conflict", "EvaluatorUnavailable", "Forbidden", "GaitswarmError", "IdempotencyConflict",
        "Interrupted", "InvalidRequest", "JobEnded", "LeaseLost", "NotFound", "ProvenanceChanged",
        "QuotaExceeded", "StoreUnavailable", "TooManyRequests", "Unauthorized", "Unavailable",
        "Unreadable",
    ),
    "gaitswarm.evidence.verify": ("verify",),
    "gaitswarm.firmware": ("write_firmware",),
    "gaitswarm.jobs.database.async_jobs": ("AsyncDatabaseJobs",),
    "gaitswarm.jobs.async_port": ("AsyncJobs",),
    "gaitswarm.jobs.server.async_jobs": ("AsyncServerJobs",),
    "gaitswarm.jobs.database.jobs": ("DatabaseJobs",),
    "gaitswarm.jobs.open": ("connect", "connect_async", "open", "open_async"),
    "gaitswarm.jobs.port": ("JobEvent", "Jobs"),
    "gaitswarm.jobs.server.jobs": ("ServerJobs",),
    "gaitswarm.optimization": ("OptimizationResult", "optimize", "optimizers"),
    "gaitswarm.preferences": ("robust_preferences",),
    "gaitswarm.requests.firmware": ("FirmwareOptions",),
    "gaitswarm.requests.robustness": ("RobustnessOptions",),
    "gaitswarm.simulation": ("robustness", "simulate"),
    "gaitswarm.simulation_result": ("ScenarioResult", "SimulationResult"),
    "gaitswarm.specs": ("SpecOptions",),
    "gaitswarm.tables": ("EvaluationTable", "Table"),
    "gaitswarm.views": (
        "BestView", "EvaluationView", "HistoryIterationView", "IterationView", "JobSummaryView",
        "JobView", "RankingView", "StateView",
    ),
    "gaitswarm.views.calibration": ("TargetsView",),
    "gaitswarm.views.comparison": ("JobComparisonView",),
    "gaitswarm.views.families": ("ScenarioFamiliesView",),
    "gaitswarm.views.firmware": ("FirmwareView",),
    "gaitswarm.views.certificate": ("CertificateView",),
    "gaitswarm.views.importance": ("ImportanceView",),
    "gaitswarm.views.identification": ("IdentifiabilityView",),
    "gaitswarm.views.preferences": ("RobustPreferencesView",),
    "gaitswarm.views.replay": ("WalkReplay",),
    "gaitswarm.views.robustness": ("RobustnessView",),
    "gaitswarm.views.surface": ("SurfaceView",),
    "gaitswarm.views.tournament": (
        "ProblemRunsView", "TournamentStandingsView", "TournamentView",
    ),
    "gaitswarm.views.trade_offs": ("FrontView", "PreferenceForView"),
    "gaitswarm.views.verification": ("VerificationView",),
    "services.optimizer.jobs.kinds.calibration": ("CalibrationSpec",),
    "services.optimizer.jobs.kinds.certificate": ("CertificateSpec",),
    "services.optimizer.jobs.labels": ("JobFilter",),
    "services.optimizer.jobs.kinds.identification": ("IdentificationSpec",),
    "services.optimizer.jobs.preference": ("PREFERENCES", "Preference"),
    "services.optimizer.jobs.kinds.tournament": ("TournamentSpec",),
    "services.optimizer.jobs.kinds.tuning": ("JobSpec",),
    "services.optimizer.jobs.kinds.tuning_worlds": ("TuningWorlds",),
    "services.optimizer.search.automatic": ("AutoSettings",),
    "services.optimizer.search.evolution.cma_es": ("CmaEsSettings",),
    "services.optimizer.search.evolution.differential_evolution": ("DeSettings",),
    "services.optimizer.search.evolution.genetic": ("GaSettings",),
    "services.optimizer.search.evolution.hype": ("HypeSettings",),
    "services.optimizer.search.local.annealing": ("AnnealingSettings",),
    "services.optimizer.search.local.directed_tabu": ("DirectedTabuSettings",),
    "services.optimizer.search.local.mads": ("MadsSettings",),
    "services.optimizer.search.local.nelder_mead": ("NelderMeadSettings",),
    "services.optimizer.search.local.pattern_search": ("PatternSearchSettings",),
    "services.optimizer.search.model.bayesian": ("BayesianSettings",),
    "services.optimizer.search.multistart.global_search": (
        "GlobalBfgsSettings", "GlobalNelderMeadSettings", "GlobalUnirandiSettings",
    ),
    "services.optimizer.search.random_search": ("RandomSearchSettings",),
    "services.optimizer.search.swarm.gsa": ("GsaSettings",),
    "services.optimizer.search.swarm.pso": ("PsoSettings",),
    "services.optimizer.search.swarm.pso_ps": ("PsoPsSettings",),
    "services.optimizer.search.swarm.tlbo": ("TlboSettings",),
    "services.optimizer.run.outage": ("Backoff",),
    "sim.controllers": ("CONTROLLERS",),
    "sim.calibration.targets": ("Target", "TargetWalk"),
    "sim.identification.recorded_walk": ("RecordedWalk",),
    "sim.kernel.observation": ("WalkLog",),
    "sim.outcome": ("MEASUREMENTS", "OBJECTIVES", "Status"),
    "sim.robot": ("RobotFiles", "RobotVariant"),
    "sim.scenario": ("PRESETS", "SCENARIOS", "Scenario"),
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
