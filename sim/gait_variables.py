"""Gait parameters that a design may set, for all legs or groups of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic import ValidationError

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import message_of
from gaitswarm.sim.scenario import GAIT_NAMES, Scenario
from gaitswarm.sim.variables import Variable, VariableCatalogue, split_name

GAIT_VARIABLES: Final[tuple[Variable, ...]] = (
    Variable(name="cycle_time", low=0.9, high=1.7, unit="s", description="Walking cycle."),
    Variable(
        name="stride",
        low=0.10,
        high=0.18,
        unit="m",
        by_leg_group=True,
        description="Stroke on the ground.",
    ),
    Variable(
        name="height",
        low=0.01,
        high=0.04,
        unit="m",
        by_leg_group=True,
        description="Height of the swing.",
    ),
    Variable(
        name="duty_factor",
        low=0.45,
        high=0.75,
        unit="1",
        by_leg_group=True,
        description="Share of the cycle of the phase selected by duty_phase.",
    ),
    Variable(
        name="duty_phase",
        kind="categorical",
        choices=("support", "swing"),
        description="Phase to which duty_factor applies.",
    ),
    Variable(
        name="start_phase",
        low=0.0,
        high=0.95,
        unit="1",
        by_leg_group=True,
        description="Share of the cycle at which the gait starts: which legs swing first.",
    ),
    Variable(
        name="curve",
        kind="categorical",
        choices=("quadratic_spline", "half_ellipse", "cycloid"),
        description="Shape of the swing.",
    ),
    Variable(
        name="fir_ms",
        low=4,
        high=300,
        unit="ms",
        kind="integer",
        description="Low-pass FIR filter of the desired angles.",
    ),
    Variable(
        name="fir_window",
        kind="categorical",
        choices=("moving_average", "hamming"),
        description="Coefficients of the filter: all equal, or those of Matlab's fir1.",
    ),
    Variable(
        name="trajectory_rate",
        low=20.0,
        high=500.0,
        unit="Hz",
        description="Update rate of the desired angles.",
    ),
    Variable(
        name="gait",
        kind="categorical",
        choices=GAIT_NAMES,
        description="Order of the legs' steps; own is the order in the robot's description.",
    ),
    Variable(
        name="hip_height",
        low=0.10,
        high=0.20,
        unit="m",
        description="Height of the coxa axes above the ground.",
    ),
    Variable(
        name="radius",
        low=0.12,
        high=0.22,
        unit="m",
        by_leg_group=True,
        description="Lateral distance of the feet from the body's long axis.",
    ),
    Variable(
        name="sway_lateral",
        low=0.0,
        high=0.04,
        unit="m",
        description="Amplitude of the body's sway to the left and right, once per cycle.",
    ),
    Variable(
        name="sway_longitudinal",
        low=0.0,
        high=0.04,
        unit="m",
        description="Amplitude of the body's sway along the walk, twice per cycle.",
    ),
    Variable(
        name="sway_phase",
        low=0.0,
        high=0.95,
        unit="1",
        description="Share of the cycle at which the body is furthest to the left.",
    ),
)
"""Gait parameters that a design may set besides the controller's, the first as in thesis table 3.2.

A value set by a design replaces the scenario's own in every scenario. Bounds suit Szabad(ka)-II.
"""

GAIT_CATALOGUE: Final = VariableCatalogue(GAIT_VARIABLES)
"""The same by name, including those of groups, such as `stride[front]`."""


def orders_searched(searched: Iterable[Variable]) -> list[dict[str, float]]:
    """Return every order of footfalls that a search may choose."""
    known = GAIT_CATALOGUE["gait"]
    choices = [choice for v in searched if v.name == known.name for choice in v.choices]
    return [{known.name: known.number(choice)} for choice in choices] or [{}]


def with_gait(scenario: Scenario, gait: Mapping[str, float]) -> Scenario:
    if not gait:
        return scenario
    values: dict[str, Any] = {name: v for name, v in gait.items() if split_name(name)[1] is None}
    of_groups = {name: value for name, value in gait.items() if name not in values}
    if of_groups:
        values["by_group"] = {**(scenario.by_group or {}), **of_groups}
    for variable in GAIT_VARIABLES:
        if variable.kind == "categorical" and variable.name in values:
            try:
                values[variable.name] = variable.shown(variable.number(values[variable.name]))
            except ValueError as error:
                raise SimulationInputError(str(error)) from error
    if "fir_ms" in values:
        if not float(values["fir_ms"]).is_integer():
            raise SimulationInputError(f"fir_ms: {values['fir_ms']:g} is not a whole number of ms")
        values["fir_ms"] = int(values["fir_ms"])
    if "gait" in values:
        values["phases"] = None
    try:
        return Scenario.model_validate(scenario.model_dump() | values)
    except ValidationError as error:
        first = error.errors()[0]
        message = message_of(first).removeprefix("by_group.")
        where = ".".join(str(part) for part in first["loc"])
        raise SimulationInputError(f"{where}: {message}" if where else message) from error
