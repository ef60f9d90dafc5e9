"""Control laws that a kernel cannot run, refused before it does."""

from __future__ import annotations

from typing import Final

from gaitswarm.sim.controllers.base import ControlLaw, LookupTable
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.walk import CODE_LIMIT

NO_JOINT_PD: Final = (
    "a joint PD commands torques, and this robot has DC motors; choose another controller, or give"
    ' robot.toml actuators of kind = "torque"'
)
"""Why such a robot does not walk."""

_LARGEST_TERM = 2**51
"""Of a control law's sums; the compiled kernel adds up three of them, exactly, in 53 bits."""


def check_gains(law: ControlLaw, *, torque: bool) -> None:
    """Refuse gains with which the compiled kernel's arithmetic is not exact, or leaves a table."""
    if law.joint_pd is not None and not torque:
        raise SimulationInputError(NO_JOINT_PD)
    largest = {
        "proportional_gain": law.proportional_gain * CODE_LIMIT,
        "integral_gain": law.integral_gain * CODE_LIMIT,
        "derivative_gain": law.derivative_gain * 2 * CODE_LIMIT,
    }
    for part, table in (("direct", law.direct), ("integrated", law.integrated)):
        if isinstance(table, LookupTable):
            largest |= {
                f"{part}.output_gain": table.output_gain * 128,
                f"{part}.error_gain": table.error_gain * CODE_LIMIT,
                f"{part}.current_gain": table.current_gain * CODE_LIMIT,
                f"{part}.velocity_gain": table.velocity_gain * 2 * CODE_LIMIT,
            }
    for name, term in largest.items():
        if abs(term) > _LARGEST_TERM:
            raise SimulationInputError(f"{name}: too large for the controllers' integers")
