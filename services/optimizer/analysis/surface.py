"""Control surfaces of fuzzy controllers."""

from __future__ import annotations

import numpy as np
from pydantic import ConfigDict, Field

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.designs import PUBLISHED_DESIGN
from gaitswarm.services.optimizer.views import Request, View
from gaitswarm.sim.catalogue import check_design, design_numbers
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.controllers.quantisation import OUTPUT_BITS
from gaitswarm.sim.controllers.surface import Memberships, Surface, surface
from gaitswarm.sim.variables import VariableName, VariableValue


class SurfaceRequest(Request):
    """A design of a fuzzy controller and the grid of its surfaces."""

    design: dict[VariableName, VariableValue] = Field(examples=[PUBLISHED_DESIGN])
    """Value of each of the controller's variables; gait variables are ignored."""
    error_points: int = Field(default=65, ge=3, le=129)
    """Points of the grid over the error's range [1]."""
    current_points: int = Field(default=33, ge=2, le=65)
    """Points of the grid over the current's range [1]."""
    velocity_error: float = Field(default=0.0, ge=-1e7, le=1e7)
    """Velocity error at which the surfaces of fuzzy-pi-3 are drawn [counts/s]."""


class MembershipView(View):
    """One fuzzy set."""

    name: str = Field(description="Name of the set in rules.", examples=["positive"])
    degrees: list[float] = Field(description="Membership of every value, from 0 to 1 [1].")


class UniverseView(View):
    """An input's range and sets."""

    name: str = Field(description="error, current or velocity.", examples=["error"])
    unit: str = Field(description="Unit of range and values.", examples=["counts"])
    range: tuple[float, float]
    """Ends of the universe: inputs saturate there, and an output's centroid is taken over it, which
    may reach beyond the output's range."""
    values: list[float]
    """Points of the range; those of error and current are the surfaces' grid, in whole counts."""
    memberships: list[MembershipView] = Field(description="Its fuzzy sets.")


class RuleView(View):
    """IF every input is in its set THEN the output is in another; a weight scales its strength."""

    # `if` is a word of Python.
    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True)

    antecedents: dict[str, str] = Field(
        alias="if",
        description="Set of every relevant input, by input.",
        examples=[{"error": "positive", "current": "large"}],
    )
    then: str = Field(description="Set of the output.", examples=["negative-extreme"])
    weight: float = Field(description="From 0 to 1 [1].", examples=[0.927])


class QuantisationView(View):
    """The lookup table that replaces the inference, and its error."""

    error_bits: int = Field(description="Of the error's index [bit].", examples=[10])
    current_bits: int = Field(description="Of the current's index [bit].", examples=[6])
    velocity_bits: int | None = Field(description="Of the velocity error's index, if any [bit].")
    output_bits: int = Field(description="Of an entry [bit].", examples=[8])
    bytes: int = Field(description="Memory of the table (eq. 5.1) [B].", examples=[65536])
    largest_difference: float = Field(examples=[5.37])
    """Of table and inference over the grid [unit of the output]."""
    rms_difference: float = Field(examples=[2.07])
    """Of table and inference over the grid [unit of the output]."""


class FuzzyOutputView(UniverseView):
    """An output with its rules, and its surface over error and current."""

    name: str = Field(examples=["FO"])
    """Variable of the design that is its range: FOR's FO, FzzP or FzzI."""
    values: list[float]
    """Points over which the inference takes the centre of area."""
    rules: list[RuleView] = Field(description="Its rules, in the thesis's order.")
    inference: list[list[float]]
    """Exact inference: a row for each error, a number for each current."""
    table: list[list[float]] = Field(description="The lookup table on the same grid.")
    quantisation: QuantisationView = Field(description="Resolution and error of the table.")


class SurfaceView(View):
    """Fuzzy sets, rules and control surfaces of a design."""

    controller: ControllerName = Field(description="Controller.", examples=["fuzzy-pi"])
    inputs: list[UniverseView] = Field(description="All inputs of any output.")
    velocity_error: float | None
    """At which the surfaces are drawn [counts/s], in whole counts a tick of 2 ms; null if it is no
    input of the controller."""
    outputs: list[FuzzyOutputView]
    """fuzzy-pi has one, fuzzy-pi-3 the voltage FzzP and the integrated FzzI."""


def run_surface(controller: ControllerName, request: SurfaceRequest) -> SurfaceView:
    """Compute the surface of every output."""
    try:
        numbers = design_numbers(controller, request.design)
        inferences = CONTROLLERS[controller].inferences(numbers)
        if inferences:
            check_design(controller, request.design)
    except ValueError as error:
        raise InvalidRequest(str(error).removeprefix("design: "), field="design") from error
    if not inferences:
        raise InvalidRequest(
            f"{controller} has no fuzzy surface; choose a fuzzy controller", field="controller"
        )
    surfaces = [
        surface(
            inference,
            error_points=request.error_points,
            current_points=request.current_points,
            velocity=request.velocity_error,
        )
        for inference in inferences
    ]
    inputs = {name: m for output in surfaces for name, m in output.inputs.items()}
    held = {name: value for output in surfaces for name, value in output.held.items()}
    return SurfaceView(
        controller=controller,
        inputs=[_universe(memberships) for memberships in inputs.values()],
        velocity_error=held.get("velocity"),
        outputs=[_output(output) for output in surfaces],
    )


def _universe(memberships: Memberships) -> UniverseView:
    universe = memberships.universe
    return UniverseView(
        name=universe.name,
        unit=universe.unit,
        range=memberships.limits,
        values=memberships.values.tolist(),
        memberships=[
            MembershipView(name=name, degrees=np.asarray(degrees).tolist())
            for name, degrees in memberships.degrees.items()
        ],
    )


def _output(output: Surface) -> FuzzyOutputView:
    axes = output.source.axes
    velocity = axes.get("velocity")
    return FuzzyOutputView.model_construct(
        **dict(_universe(output.output)),
        rules=[
            RuleView(antecedents=dict(rule.antecedents), then=rule.consequent, weight=rule.weight)
            for rule in output.source.system.rules
        ],
        inference=output.inference.tolist(),
        table=output.table.tolist(),
        quantisation=QuantisationView(
            error_bits=axes["error"].bits,
            current_bits=axes["current"].bits,
            velocity_bits=None if velocity is None else velocity.bits,
            output_bits=OUTPUT_BITS,
            bytes=output.bytes,
            largest_difference=output.largest_difference,
            rms_difference=output.rms_difference,
        ),
    )
