"""How the robot was driven in 2011: timing, duty and turn of its trajectory (appendix .2.1)."""

from __future__ import annotations

from typing import Final

from gaitswarm.sim.scenario import Scenario

UPDATES_PER_CYCLE: Final = 42
"""New targets a cycle: 20 points of support, 20 of swing, and the two ends of the stride."""


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
