"""How the robot was driven in 2011: timing, duty and turn of its trajectory (appendix .2.1)."""

from __future__ import annotations

from typing import Final

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.scenario import Scenario

UPDATES_PER_CYCLE: Final = 42
"""New targets a cycle: 20 points of support, 20 of swing, and the two ends of the stride."""

SPEEDS: Final = (7.5, 10.0, 12.0, 15.0, 20.0)
"""Values of w_S, which sets the cycle's length."""

_CYCLE_TIMES_SPEED: Final = 25.2
"""w_S times the length of a cycle [s]."""


def driven_as_in_2011(scenario: Scenario) -> Scenario:
    """A scenario with the trajectory of 2011, in its own cycle time."""
    fields = {
        "curve": "quadratic_spline",
        "duty_factor": 0.5,
        "duty_phase": "support",
        "trajectory_rate": UPDATES_PER_CYCLE / scenario.cycle_time,
        "fir_ms": 0,
        "start_phase": 0.5,
        "turn_mode": "both",
    }
    return Scenario.model_validate(scenario.model_dump() | fields)


def scenario_2011(w_s: float, w_d: float = 0.0) -> Scenario:
    """A level walk as the robot of 2011 was told to walk.

    Args:
        w_d: Share by which the stride is shortened on one side and lengthened on the other, -1 to
            1, right turns positive [1].
    """
    if w_s not in SPEEDS:
        raise SimulationInputError(
            f"w_s: {w_s:g} is none of {', '.join(f'{speed:g}' for speed in SPEEDS)}"
        )
    if not -1.0 <= w_d <= 1.0:
        raise SimulationInputError(f"w_d: {w_d:g} is not between -1 and 1")
    return driven_as_in_2011(
        Scenario(
            name=f"2011-{w_s:g}",
            cycle_time=_CYCLE_TIMES_SPEED / w_s,
            radius=0.16,
            hip_height=0.15,
            turn=w_d,
        )
    )
