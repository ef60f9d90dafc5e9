"""Views: domain objects as JSON, for the HTTP API and for `--json` on the command line.

Nothing in this package knows FastAPI or HTTP.
"""

from __future__ import annotations

from gaitswarm.services.optimizer.analysis.evaluations import (
    EvaluationView,
    ObjectiveView,
    ScenarioResultView,
    evaluation_views,
)
from gaitswarm.services.optimizer.analysis.ranking import RankingView
from gaitswarm.services.optimizer.views import PageView, View, finite
from gaitswarm.views.base import (
    PREFIX,
    FieldErrorView,
    ProblemView,
    field_errors,
)
from gaitswarm.views.catalogue import (
    CaseView,
    CatalogueView,
    ControllerView,
    OptimizerView,
    PluginView,
    PreferenceView,
    RobotView,
    ScenarioView,
    case_views,
    controller_views,
    optimizer_views,
    plugin_views,
    preference_views,
    robot_views,
    scenario_views,
)
from gaitswarm.views.history import (
    BestView,
    HistoryIterationView,
    IterationView,
    ParticlesHeaderView,
    encoded_particles,
)
from gaitswarm.views.job import (
    EstimateView,
    ExtensionRequest,
    JobSummaryView,
    JobView,
    PriorityRequest,
    ResumeRequest,
    StateView,
)
from gaitswarm.views.simulation import (
    MeasurementsView,
    PlannedGaitView,
    SimulatedScenarioView,
    SimulationView,
    WalkLogView,
)

__all__ = [
    "PREFIX",
    "BestView",
    "CaseView",
    "CatalogueView",
    "ControllerView",
    "EstimateView",
    "EvaluationView",
    "ExtensionRequest",
    "FieldErrorView",
    "HistoryIterationView",
    "IterationView",
    "JobSummaryView",
    "JobView",
    "MeasurementsView",
    "ObjectiveView",
    "OptimizerView",
    "PageView",
    "ParticlesHeaderView",
    "PlannedGaitView",
    "PluginView",
    "PreferenceView",
    "PriorityRequest",
    "ProblemView",
    "RankingView",
    "ResumeRequest",
    "RobotView",
    "ScenarioResultView",
    "ScenarioView",
    "SimulatedScenarioView",
    "SimulationView",
    "StateView",
    "View",
    "WalkLogView",
    "case_views",
    "controller_views",
    "encoded_particles",
    "evaluation_views",
    "field_errors",
    "finite",
    "optimizer_views",
    "plugin_views",
    "preference_views",
    "robot_views",
    "scenario_views",
]
