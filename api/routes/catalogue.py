"""What there is to choose from, and how a fuzzy controller answers."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Path, Response

from gaitswarm.api.dependencies import Slots
from gaitswarm.api.documentation import problems
from gaitswarm.api.routes.simulations import NOT_STORED
from gaitswarm.requests.surface import SurfaceRequest, run_surface
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
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
    """Robots that ship; a job names one, brings a variant of one, or the files of its own."""
    return CatalogueView(items=robot_views())


@router.get(
    "/scenarios",
    operation_id="list_scenarios",
    summary="List preset scenarios",
    responses=problems(),
)
def list_scenarios() -> CatalogueView[ScenarioView]:
    """The six walks of thesis table 4.2, in full; a job names them or brings its own."""
    return CatalogueView(items=scenario_views())


@router.get(
    "/preferences",
    operation_id="list_preferences",
    summary="List preferences",
    responses=problems(),
)
def list_preferences() -> CatalogueView[PreferenceView]:
    """Biases and exponents by which objectives are weighed: thesis table 4.5, eq. 3.1."""
    return CatalogueView(items=preference_views())


@router.get(
    "/optimizers",
    operation_id="list_optimizers",
    summary="List optimizers",
    responses=problems(),
)
def list_optimizers() -> CatalogueView[OptimizerView]:
    """Search methods with their settings, by the names that jobs may give them."""
    return CatalogueView(items=optimizer_views())


@router.get(
    "/controllers",
    operation_id="list_controllers",
    summary="List controllers",
    responses=problems(),
)
def list_controllers() -> CatalogueView[ControllerView]:
    """Motor controllers, their design variables with bounds and units, and published designs."""
    return CatalogueView(items=controller_views())


@router.get(
    "/cases",
    operation_id="list_cases",
    summary="List cases of plug-ins",
    responses=problems(),
)
def list_cases() -> CatalogueView[CaseView]:
    """What designs may be put to in place of walks in gaitswarm's simulator, by plug-ins here."""
    return CatalogueView(items=case_views())


@router.get(
    "/plugins",
    operation_id="list_plugins",
    summary="List plug-ins",
    responses=problems(),
)
def list_plugins() -> CatalogueView[PluginView]:
    """Controllers, cases and search methods that other packages bring to this server."""
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
    slots: Slots,
) -> Response:
    """How a design answers to angle error and motor current: by its rules, and by its table.

    Sets and rules are those of the thesis; the table is what the microcontroller looks up in place
    of the inference.
    """
    if controller not in CONTROLLERS:
        raise NotFound(CONTROLLERS.unknown(controller))
    body = await slots.run(partial(_surface, controller, request))
    return Response(body, media_type="application/json", headers=NOT_STORED)


def _surface(controller: ControllerName, request: SurfaceRequest) -> str:
    """Serialized in the worker thread, as it has thousands of numbers."""
    return run_surface(controller, request).model_dump_json(by_alias=True)
