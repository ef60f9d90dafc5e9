from gaitswarm.evidence.verify import verify
from gaitswarm.firmware import FirmwareView, TrajectoriesView, write_firmware, write_trajectories
from gaitswarm.jobs.asynchronous import AsyncJobs
from gaitswarm.jobs.base import JobEvent, Jobs
from gaitswarm.jobs.database import DatabaseJobs, Interrupted
from gaitswarm.jobs.open import connect, open  # noqa: A004
from gaitswarm.jobs.server import ServerJobs
from gaitswarm.optimization import JobEnded, OptimizationResult, optimize
from gaitswarm.services.optimizer.analysis.certificate import CertificateView
from gaitswarm.services.optimizer.analysis.comparison import JobComparisonView
from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView
from gaitswarm.services.optimizer.analysis.front import FrontView
from gaitswarm.services.optimizer.analysis.identifiability import IdentifiabilityView
from gaitswarm.services.optimizer.analysis.importance import ImportanceView
from gaitswarm.services.optimizer.analysis.preferences import (
    CandidatePreferencesView,
    PreferenceForView,
    RankingView,
)
from gaitswarm.services.optimizer.analysis.robustness import RobustnessView
from gaitswarm.services.optimizer.analysis.surface import SurfaceView
from gaitswarm.services.optimizer.analysis.targets import TargetsView
from gaitswarm.services.optimizer.analysis.verdict import VerdictView
from gaitswarm.services.optimizer.errors import (
    Conflict,
    EvaluatorUnavailable,
    Forbidden,
    GaitswarmError,
    IdempotencyConflict,
    InvalidRequest,
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
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec, IdentificationSpec
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.services.optimizer.search.bayesian import BayesianSettings
from gaitswarm.services.optimizer.search.cma_es import CmaEsSettings
from gaitswarm.services.optimizer.search.differential_evolution import DeSettings
from gaitswarm.services.optimizer.search.hype import HypeSettings
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.search.registry import AutoSettings, RandomSearchSettings
from gaitswarm.sim.calibration import Target, TargetWalk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.identification import RecordedWalk
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.outcome import MEASUREMENTS, OBJECTIVES, Status
from gaitswarm.sim.robot import RobotFiles, RobotVariant
from gaitswarm.sim.scenario import PRESETS, SCENARIOS, Scenario
from gaitswarm.sim.variables import Variable
from gaitswarm.simulation import ScenarioResult, SimulationResult, robustness, simulate
from gaitswarm.specs import SpecOptions, job_spec
from gaitswarm.tables import EvaluationTable, Table
from gaitswarm.views.catalogue import optimizers
from gaitswarm.views.job import (
    BestView,
    HistoryIterationView,
    IterationView,
    JobSummaryView,
    JobView,
    StateView,
)
from gaitswarm.views.verification import VerificationView

__all__ = [
    "CONTROLLERS", "MEASUREMENTS", "OBJECTIVES", "PREFERENCES", "PRESETS", "SCENARIOS",
    "AsyncJobs", "AutoSettings", "Backoff", "BayesianSettings", "BestView",
    "CalibrationSpec", "CandidatePreferencesView", "CertificateSpec", "CertificateView",
    "CmaEsSettings", "Conflict",
    "DatabaseJobs", "DeSettings", "EvaluationTable", "EvaluationView", "EvaluatorUnavailable",
    "FirmwareView", "Forbidden", "FrontView", "GaitswarmError",
    "HistoryIterationView", "HypeSettings", "IdempotencyConflict", "IdentifiabilityView",
    "IdentificationSpec", "ImportanceView", "Interrupted", "InvalidRequest", "IterationView",
    "JobComparisonView", "JobEnded", "JobEvent", "JobSpec", "JobSummaryView",
    "JobView", "Jobs", "LeaseLost", "NotFound", "OptimizationResult", "Preference",
    "PreferenceForView", "PreferencesSpec", "ProvenanceChanged", "PsoSettings", "QuotaExceeded",
    "RandomSearchSettings", "RankingView", "RecordedWalk", "RobotFiles", "RobotVariant",
    "RobustnessView", "Scenario",
    "ScenarioResult", "ServerJobs", "SimulationResult", "SpecOptions",
    "StateView", "Status", "StoreUnavailable", "SurfaceView", "Table", "Target", "TargetWalk",
    "TargetsView", "TooManyRequests", "TrajectoriesView", "TuningWorlds",
    "Unauthorized", "Unavailable", "Unreadable",
    "Variable", "VerdictView", "VerificationView", "WalkLog", "__version__", "connect",
    "job_spec", "open", "optimize", "optimizers", "robustness",
    "simulate", "verify", "write_firmware", "write_trajectories",
]  # fmt: skip

__version__: str
