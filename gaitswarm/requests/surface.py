"""Control surfaces of fuzzy controllers."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.designs import PUBLISHED_DESIGN
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.catalogue import check_design, design_numbers
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName, Inference
from gaitswarm.sim.controllers.surface import surface
from gaitswarm.sim.variables import VariableName, VariableValue
from gaitswarm.views.analysis import SurfaceView


class SurfaceRequest(BaseModel):
    """A design of a fuzzy controller and the grid of its surfaces."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    design: dict[VariableName, VariableValue] = Field(
        description="Value of each of the controller's variables; gait variables are ignored.",
        examples=[PUBLISHED_DESIGN],
    )
    error_points: int = Field(
        default=65, ge=3, le=129, description="Points of the grid over the error's range [1]."
    )
    current_points: int = Field(
        default=33, ge=2, le=65, description="Points of the grid over the current's range [1]."
    )
    velocity_error: float = Field(
        default=0.0,
        ge=-1e7,
        le=1e7,
        description="Velocity error at which the surfaces of fuzzy-pi-3 are drawn [counts/s].",
    )


def run_surface(controller: ControllerName, request: SurfaceRequest) -> SurfaceView:
    """Compute the surface of every output."""
    surfaces = [
        surface(
            inference,
            error_points=request.error_points,
            current_points=request.current_points,
            velocity=request.velocity_error,
        )
        for inference in _inferences(controller, request.design)
    ]
    if not surfaces:
        raise InvalidRequest(
            f"{controller} has no fuzzy surface; choose a fuzzy controller", field="controller"
        )
    return SurfaceView.from_surfaces(controller, surfaces)


def _inferences(
    controller: ControllerName, design: Mapping[str, float | str]
) -> tuple[Inference, ...]:
    try:
        inferences = CONTROLLERS[controller].inferences(design_numbers(controller, design))
        if inferences:
            check_design(controller, design)
    except ValueError as error:
        raise InvalidRequest(str(error).removeprefix("design: "), field="design") from error
    return inferences
