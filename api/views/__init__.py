"""Views: domain objects as JSON, for the HTTP API and for `--json` on the command line.

Nothing in this package knows FastAPI or HTTP.
"""

from __future__ import annotations

from api.views.analysis import (
    DistributionItemView,
    DistributionView,
    RankedDesignView,
    RankingRequest,
    RankingView,
)
from api.views.base import View, finite
from api.views.catalogue import (
    CatalogueView,
    ControllerView,
    PreferenceView,
    ScenarioView,
    controller_views,
    preference_views,
    scenario_views,
)
from api.views.cost import CostView
from api.views.evaluation import (
    BestView,
    EvaluationView,
    ObjectiveView,
    ScenarioResultView,
    evaluation_views,
)
from api.views.job import (
    PREFIX,
    ExtensionRequest,
    HistoryIterationView,
    IterationView,
    JobSummaryView,
    JobView,
    PageView,
    StateView,
)
from api.views.particles import ParticlesHeaderView, encoded_particles
from api.views.problem import FieldErrorView, ProblemView
from api.views.simulation import SimulatedScenarioView, SimulationView, WalkLogView

__all__ = [
    "PREFIX",
    "BestView",
    "CatalogueView",
    "ControllerView",
    "CostView",
    "DistributionItemView",
    "DistributionView",
    "EvaluationView",
    "ExtensionRequest",
    "FieldErrorView",
    "HistoryIterationView",
    "IterationView",
    "JobSummaryView",
    "JobView",
    "ObjectiveView",
    "PageView",
    "ParticlesHeaderView",
    "PreferenceView",
    "ProblemView",
    "RankedDesignView",
    "RankingRequest",
    "RankingView",
    "ScenarioResultView",
    "ScenarioView",
    "SimulatedScenarioView",
    "SimulationView",
    "StateView",
    "View",
    "WalkLogView",
    "controller_views",
    "encoded_particles",
    "evaluation_views",
    "finite",
    "preference_views",
    "scenario_views",
]
