"""What there is to choose from."""

from __future__ import annotations

from fastapi import APIRouter

from api.openapi import problems
from gaitswarm.views import (
    PREFIX,
    CatalogueView,
    ControllerView,
    PreferenceView,
    ScenarioView,
    controller_views,
    preference_views,
    scenario_views,
)

router = APIRouter(prefix=PREFIX, tags=["catalogue"])


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
    """Biases and exponents of thesis table 4.5, by which objectives are weighed."""
    return CatalogueView(items=preference_views())


@router.get(
    "/controllers",
    operation_id="list_controllers",
    summary="List controllers",
    responses=problems(),
)
def list_controllers() -> CatalogueView[ControllerView]:
    """Motor controllers, their design variables with bounds and units, and published designs."""
    return CatalogueView(items=controller_views())
