"""Gait parameters that a design may set, for all legs or groups of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic import ValidationError

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import message_of
from gaitswarm.sim.scenario import GAIT_NAMES, Scenario
from gaitswarm.sim.variables import (
    Variable,
    VariableCatalogue,
    categorical,
    numeric,
    split_name,
)

GAIT_VARIABLES: Final[tuple[Variable, ...]] = (
    numeric("cycle_time", 0.9, 1.7, "s", "Walking cycle."),
    numeric("stride", 0.10, 0.18, "m", "Stroke on the ground.", by_leg_group=True),
    numeric("height", 0.01, 0.04, "m", "Height of the swing.", by_leg_group=True),
    numeric(
        "duty_factor",
        0.45,
        0.75,
        "1",
        "Share of the cycle of the phase selected by duty_phase.",
        by_leg_group=True,
    ),
    categorical("duty_phase", ("support", "swing"), "Phase to which duty_factor applies."),
    numeric(
        "start_phase",
        0.0,
        0.95,
        "1",
        "Share of the cycle at which the gait starts: which legs swing first.",
        by_leg_group=True,
    ),
    categorical("curve", ("quadratic_spline", "half_ellipse", "cycloid"), "Shape of the swing."),
    numeric("fir_ms", 4, 300, "ms", "Low-pass FIR filter of the desired angles.", kind="integer"),
    categorical(
        "fir_window",
        ("moving_average", "hamming"),
        "Coefficients of the filter: all equal, or those of Matlab's fir1.",
    ),
    numeric("trajectory_rate", 20.0, 500.0, "Hz", "Update rate of the desired angles."),
    categorical(
        "gait", GAIT_NAMES, "Order of the legs' steps; own is the order in the robot's description."
    ),
    numeric("hip_height", 0.10, 0.20, "m", "Height of the coxa axes above the ground."),
    numeric(
        "radius",
        0.12,
        0.22,
        "m",
        "Lateral distance of the feet from the body's long axis.",
        by_leg_group=True,
    ),
    numeric(
        "sway_lateral",
        0.0,
        0.04,
        "m",
        "Amplitude of the body's sway to the left and right, once per cycle.",
    ),
    numeric(
        "sway_longitudinal",
        0.0,
        0.04,
        "m",
        "Amplitude of the body's sway along the walk, twice per cycle.",
    ),
    numeric(
        "sway_phase",
        0.0,
        0.95,
        "1",
        "Share of the cycle at which the body is furthest to the left.",
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
