"""Catalogue of robots, scenarios, preferences, optimizers, controllers and plug-ins."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from gaitswarm.api.dependencies import Computing
from gaitswarm.api.documentation import problems
from gaitswarm.api.responses import NOT_STORED, json_response
from gaitswarm.requests.surface import SurfaceRequest, run_surface
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.views import (
    PREFIX,
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
from gaitswarm.views.analysis import SurfaceView

router = APIRouter(prefix=PREFIX, tags=["catalogue"])


@router.get(
    "/robots",
    operation_id="list_robots",
    summary="List robots",
    responses=problems(),
)
def list_robots() -> CatalogueView[RobotView]:
    """Return shipped robots. A job names one, defines a variant of one, or has files of its own."""
    return CatalogueView(items=robot_views())


@router.get(
    "/scenarios",
    operation_id="list_scenarios",
    summary="List preset scenarios",
    responses=problems(),
)
def list_scenarios() -> CatalogueView[ScenarioView]:
    """Return the six scenarios of thesis table 4.2; a job names them or defines its own."""
    return CatalogueView(items=scenario_views())


@router.get(
    "/preferences",
    operation_id="list_preferences",
    summary="List preferences",
    responses=problems(),
)
def list_preferences() -> CatalogueView[PreferenceView]:
    """Return biases and exponents that weight the objectives (thesis table 4.5, eq. 3.1)."""
    return CatalogueView(items=preference_views())


@router.get(
    "/optimizers",
    operation_id="list_optimizers",
    summary="List optimizers",
    responses=problems(),
)
def list_optimizers() -> CatalogueView[OptimizerView]:
    """Return search methods with their settings, by the names that jobs use."""
    return CatalogueView(items=optimizer_views())


@router.get(
    "/controllers",
    operation_id="list_controllers",
    summary="List controllers",
    responses=problems(),
)
def list_controllers() -> CatalogueView[ControllerView]:
    """Return motor controllers with design variables, bounds, units and published designs."""
    return CatalogueView(items=controller_views())


@router.get(
    "/cases",
    operation_id="list_cases",
    summary="List cases of plug-ins",
    responses=problems(),
)
def list_cases() -> CatalogueView[CaseView]:
    """Return cases of installed plug-ins, which evaluate designs in place of the simulator."""
    return CatalogueView(items=case_views())


@router.get(
    "/plugins",
    operation_id="list_plugins",
    summary="List plug-ins",
    responses=problems(),
)
def list_plugins() -> CatalogueView[PluginView]:
    """Return controllers, cases and search methods that installed packages add."""
    return CatalogueView(items=plugin_views())


@router.post(
    "/controllers/{controller}/surface",
    operation_id="controller_surface",
    summary="Get a fuzzy controller's surface",
    response_model=SurfaceView,
    responses=problems(400, 404, 413, 422),
)
async def controller_surface(
    controller: Annotated[
        str,
        Path(
            max_length=40,
            description="Name of a fuzzy controller; see /v1/controllers.",
            examples=["fuzzy-pi"],
        ),
    ],
    request: SurfaceRequest,
    computing: Computing,
) -> Response:
    """Return the output over angle error and motor current: by the rules, and by the lookup table.

    Sets and rules are those of the thesis; the microcontroller uses the table instead of inference.
    """
    if controller not in CONTROLLERS:
        raise NotFound(CONTROLLERS.unknown(controller))
    return await computing.run(lambda: json_response(run_surface(controller, request), NOT_STORED))
