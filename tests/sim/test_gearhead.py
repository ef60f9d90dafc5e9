"""Efficiency of a gearhead against its load, by the datasheet's nominal point (thesis fig. 2.4).

Of the datasheet there are ratio, nominal torque and speed, and the efficiency there; the other
points of the figure are not in our sources.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.parameters import pack_parameters
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.description import Actuator
from gaitswarm.sim.scenario import SCENARIOS

Floats = NDArray[np.float64]

ROBOT = load_robot("szabadka2")


def nominal() -> tuple[Floats, Floats]:
    """Nominal torque [N m] and speed [rad/s] of the gearheads, at the joints."""
    d = ROBOT.description
    points = []
    for name in (name for leg in d.legs for name in leg.actuators):
        actuator = d.actuators[name]
        assert isinstance(actuator, Actuator)
        gear = d.gearheads[actuator.gearhead]
        speed = gear.nominal_speed / (gear.ratio * actuator.bevel)
        points.append((gear.nominal_torque * actuator.bevel, speed))
    torque, speed = np.array(points).T
    return torque, speed


def torques(share: float) -> tuple[Floats, Floats]:
    """Torques into and out of every gearhead at nominal speed, at the joints (J,) [N m].

    share: of the nominal torque that goes in.
    """
    torque, speed = nominal()
    motors = ROBOT.actuators()
    current = (share * torque + motors.motor_friction * speed) / motors.torque
    voltage = motors.resistance * current + motors.torque * speed
    supply = ROBOT.description.supply
    # U (V - U) / R_i = P, as the bridges conserve power.
    half, power = 0.5 * supply.voltage, float(voltage @ current)
    battery = half + np.sqrt(half * half - supply.resistance * power)
    q = np.concatenate([[0, 0, 1.0, 0, 0, 0, 1], np.tile([0.0, -0.2, -1.6], 6)])
    v = np.concatenate([np.zeros(6), speed])
    p = pack_parameters(ROBOT, SCENARIOS[0], 2e-4)
    seen = physics_model(ROBOT).observe(q, v, [], voltage / battery, np.zeros(18), p)
    amperes, _, load, _, _, acceleration = (np.array(part).ravel() for part in seen)
    np.testing.assert_allclose(amperes, current, rtol=1e-9)
    # The load torque is what remains behind the inertia of the rotor.
    return share * torque, load + motors.armature * acceleration[6:]


def test_a_gearhead_that_receives_its_nominal_torque_has_the_datasheets_efficiency() -> None:
    given, passed = torques(1.0)
    np.testing.assert_allclose(passed / given, 0.6, rtol=1e-9)


@pytest.mark.parametrize("load", [0.05, 0.2, 0.6, 1.0])
def test_efficiency_rises_with_the_load_as_losses_depend_on_speed_alone(load: float) -> None:
    """load: share of the nominal torque that comes out."""
    loss = 1.0 - 0.6
    given, passed = torques(load + loss)
    np.testing.assert_allclose(passed, load * nominal()[0], rtol=1e-9)
    np.testing.assert_allclose(passed / given, load / (load + loss), rtol=1e-9)
