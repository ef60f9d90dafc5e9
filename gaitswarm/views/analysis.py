"""Analyses of a job's designs"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import ConfigDict, Field

from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.controllers.mamdani import Rule
from gaitswarm.sim.controllers.quantisation import OUTPUT_BITS
from gaitswarm.sim.controllers.surface import Memberships, Surface


class MembershipView(View):
    """One fuzzy set."""

    name: str = Field(description="Name of the set, as rules call it.", examples=["positive"])
    degrees: list[float] = Field(
        description="Degree of membership of every value, from 0 to 1 [1].", examples=[[0.0, 1.0]]
    )


class UniverseView(View):
    """An input's range and sets."""

    name: str = Field(description="error, current or velocity.", examples=["error"])
    unit: str = Field(description="Unit of range and values.", examples=["counts"])
    range: tuple[float, float] = Field(
        description="Where the universe ends: inputs saturate there, and an output's centroid is"
        " taken over it, which may reach beyond the output's range.",
        examples=[[-5837.0, 5837.0]],
    )
    values: list[float] = Field(
        description="Points of the range; those of error and current are the surfaces' grid, in"
        " whole counts.",
        examples=[[-5837.0, 0.0, 5837.0]],
    )
    memberships: list[MembershipView] = Field(description="Its fuzzy sets.")


class RuleView(View):
    """IF every input is in its set THEN the output is in another; a weight scales its strength."""

    # `if` is a word of Python.
    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True)

    antecedents: dict[str, str] = Field(
        alias="if",
        description="Set of every input that matters to it, by input.",
        examples=[{"error": "positive", "current": "large"}],
    )
    then: str = Field(description="Set of the output.", examples=["negative-extreme"])
    weight: float = Field(description="From 0 to 1 [1].", examples=[0.927])

    @classmethod
    def from_rule(cls, rule: Rule) -> RuleView:
        """Make a view of a rule."""
        return cls(antecedents=dict(rule.antecedents), then=rule.consequent, weight=rule.weight)


class QuantisationView(View):
    """The lookup table that replaces the inference, and its error."""

    error_bits: int = Field(description="Of the error's index [bit].", examples=[10])
    current_bits: int = Field(description="Of the current's index [bit].", examples=[6])
    velocity_bits: int | None = Field(
        description="Of the velocity error's index [bit]; null if it does not matter.",
        examples=[None],
    )
    output_bits: int = Field(description="Of an entry [bit].", examples=[8])
    bytes: int = Field(description="Memory of the table (eq. 5.1) [B].", examples=[65536])
    largest_difference: float = Field(
        description="Of table and inference over the grid [unit of the output].", examples=[5.37]
    )
    rms_difference: float = Field(
        description="Of table and inference over the grid [unit of the output].", examples=[2.07]
    )


class FuzzyOutputView(UniverseView):
    """An output with its rules, and its surface over error and current."""

    name: str = Field(
        description="Variable of the design that is its range: FOR's FO, FzzP or FzzI.",
        examples=["FO"],
    )
    values: list[float] = Field(
        description="Points over which the inference takes the centre of area.",
        examples=[[-781.0, 0.0, 781.0]],
    )
    rules: list[RuleView] = Field(description="Its rules, in the thesis's order.")
    inference: list[list[float]] = Field(
        description="Exact inference: a row for each error, a number for each current.",
        examples=[[[-386.8, -100.0], [386.8, 100.0]]],
    )
    table: list[list[float]] = Field(
        description="The lookup table on the same grid.",
        examples=[[[-387.4, -98.4], [387.4, 98.4]]],
    )
    quantisation: QuantisationView = Field(description="What of the rules the table keeps.")

    @classmethod
    def from_surface(cls, surface: Surface) -> FuzzyOutputView:
        """Make a view of one output."""
        axes = surface.source.axes
        velocity = axes.get("velocity")
        return cls.model_construct(
            **dict(_universe(surface.output)),
            rules=[RuleView.from_rule(rule) for rule in surface.source.system.rules],
            inference=surface.inference.tolist(),
            table=surface.table.tolist(),
            quantisation=QuantisationView(
                error_bits=axes["error"].bits,
                current_bits=axes["current"].bits,
                velocity_bits=None if velocity is None else velocity.bits,
                output_bits=OUTPUT_BITS,
                bytes=surface.bytes,
                largest_difference=surface.largest_difference,
                rms_difference=surface.rms_difference,
            ),
        )


class SurfaceView(View):
    """Fuzzy sets, rules and control surfaces of a design."""

    controller: ControllerName = Field(description="Controller.", examples=["fuzzy-pi"])
    inputs: list[UniverseView] = Field(description="All inputs of any output.")
    velocity_error: float | None = Field(
        description="At which the surfaces are drawn [counts/s], in whole counts a tick of 2 ms;"
        " null if the controller does not see it.",
        examples=[None],
    )
    outputs: list[FuzzyOutputView] = Field(
        description="fuzzy-pi has one, fuzzy-pi-3 the voltage FzzP and the integrated FzzI."
    )

    @classmethod
    def from_surfaces(cls, controller: ControllerName, surfaces: Sequence[Surface]) -> SurfaceView:
        """Make a view of a controller.

        Args:
            controller: its name.
            surfaces: of every output, on the same grid.
        """
        inputs = {name: m for surface in surfaces for name, m in surface.inputs.items()}
        held = {name: value for surface in surfaces for name, value in surface.held.items()}
        return cls(
            controller=controller,
            inputs=[_universe(memberships) for memberships in inputs.values()],
            velocity_error=held.get("velocity"),
            outputs=[FuzzyOutputView.from_surface(surface) for surface in surfaces],
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
