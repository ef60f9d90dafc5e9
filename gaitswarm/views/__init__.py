"""Views: domain objects as JSON, for the HTTP API and for `--json` on the command line.

Nothing in this package knows FastAPI or HTTP.
"""

from __future__ import annotations

from gaitswarm.views.analysis import (
    DistributionItemView,
    DistributionView,
    RankedDesignView,
    RankingRequest,
    RankingView,
)
from gaitswarm.views.base import PageView, View, finite
from gaitswarm.views.budget import EstimateView
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
from gaitswarm.views.commands import ExtensionRequest, PriorityRequest, ResumeRequest
from gaitswarm.views.evaluation import (
    BestView,
    EvaluationView,
    ObjectiveView,
    ScenarioResultView,
    encoded_evaluations,
    evaluation_views,
)
from gaitswarm.views.iteration import HistoryIterationView, IterationView, encoded_iterations
from gaitswarm.views.job import (
    JobSummaryView,
    JobView,
    StateView,
)
from gaitswarm.views.links import PREFIX
from gaitswarm.views.particles import ParticlesHeaderView, encoded_particles
from gaitswarm.views.problem import FieldErrorView, ProblemView, field_errors
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
    "DistributionItemView",
    "DistributionView",
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
    "RankedDesignView",
    "RankingRequest",
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
    "encoded_evaluations",
    "encoded_iterations",
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
