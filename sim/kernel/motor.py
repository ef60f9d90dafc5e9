"""Motors and supply as symbols (thesis 2.2.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sim.kernel.spatial import Scalar
from sim.robot.robot import JointActuators


@dataclass(frozen=True, slots=True)
class Electrical:
    """Motors and battery at one instant.

    Attributes:
        supply: voltage of the battery under load [V].
        voltages: of the motors, (J,) [V].
        currents: of the motors, (J,) [A].
        torques: at the joints after friction, (J,) [N m].
    """

    supply: Scalar
    voltages: tuple[Scalar, ...]
    currents: tuple[Scalar, ...]
    torques: tuple[Scalar, ...]


def electrical(
    actuators: JointActuators,
    duty: Sequence[Scalar],
    rates: Sequence[Scalar],
    viscous: Sequence[Scalar],
    source: Scalar,
    internal: Scalar,
) -> Electrical:
    """Quasi-static motor currents on one battery of finite resistance.

    The bridges conserve power, so the battery's current is sum(duty_j I_j); with
    I_j = (duty_j U_S - k_j omega_j) / R_j, U_S = V - R_i sum(duty_j I_j) is linear in U_S.
    The electrical pole (L/R = 44 us) is faster than a physics step, hence quasi-static.

    Args:
        actuators: Motors and gears by joint.
        duty: Motor voltage per supply voltage, (J,) [1].
        rates: Motor velocities at the gearheads' outputs, (J,) [rad/s].
        viscous: Friction, (J,) [N m s/rad].
        source: Open-circuit voltage of the battery [V].
        internal: Resistance of the battery [ohm].

    Returns:
        Voltages, currents and torques.
    """
    constants = list(zip(actuators.torque.tolist(), actuators.resistance.tolist(), strict=True))
    back, load = 0.0, 0.0
    for (k, r), share, rate in zip(constants, duty, rates, strict=True):
        per_ohm = share * (1.0 / r)
        back = back + per_ohm * (k * rate)
        load = load + per_ohm * share
    supply = (source + internal * back) / (1.0 + internal * load)
    voltages = tuple(share * supply for share in duty)
    currents = tuple(
        (voltage - k * rate) * (1.0 / r)
        for (k, r), voltage, rate in zip(constants, voltages, rates, strict=True)
    )
    torques = tuple(
        k * current - b * rate
        for (k, _), current, b, rate in zip(constants, currents, viscous, rates, strict=True)
    )
    return Electrical(supply, voltages, currents, torques)
