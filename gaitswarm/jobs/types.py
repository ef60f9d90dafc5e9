"""Types of arguments and answers of `Jobs` that few operations need, imported with the first."""

from gaitswarm.recordings import RecordingEntryView, RecordingView
from gaitswarm.services.optimizer.analysis.certificate import MOST_WORST, CertificateView
from gaitswarm.services.optimizer.analysis.comparison import MOST_JOBS, JobComparisonView
from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView
from gaitswarm.services.optimizer.analysis.failures import FailuresView
from gaitswarm.services.optimizer.analysis.front import FrontRequest, FrontView
from gaitswarm.services.optimizer.analysis.identifiability import IdentifiabilityView
from gaitswarm.services.optimizer.analysis.importance import ImportanceView
from gaitswarm.services.optimizer.analysis.preferences import (
    CandidatePreferencesView,
    PreferenceForView,
    RankingRequest,
    RankingView,
)
from gaitswarm.services.optimizer.analysis.targets import LeaveOut, TargetsView
from gaitswarm.services.optimizer.analysis.verdict import VerdictView
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.identification import RecordedWalk
from gaitswarm.views.catalogue import CatalogueView
from gaitswarm.views.verification import Digest, HistoryVerificationView

__all__ = [
    "MOST_JOBS", "MOST_WORST", "CandidatePreferencesView", "CatalogueView", "CertificateView",
    "Digest", "EvaluationColumns", "EvaluationView", "FailuresView", "ForkRequest",
    "FrontRequest", "FrontView", "HistoryVerificationView", "IdentifiabilityView",
    "ImportanceView", "JobComparisonView", "JobSpec", "LeaveOut", "PreferenceForView",
    "RankingRequest", "RankingView", "RecordedWalk", "RecordingEntryView", "RecordingView",
    "TargetsView", "VerdictView",
]  # fmt: skip
