"""Motors and supply as symbols (thesis 2.2.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sim.kernel.spatial import Scalar
from sim.robot.robot import JointActuators


@dataclass(frozen=True, slots=True)
class Electrical:
    """supply [V]; voltage, current, torque by joint: (J,) [V], [A], [N m] after friction."""

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

    duty: motor voltage per supply voltage (J,) [1]; rates: joint velocities (J,) [rad/s];
    viscous (J,) [N m s/rad]; source [V] and internal resistance [ohm] of the battery.

    The bridges conserve power, so the battery's current is sum(duty_j I_j); with
    I_j = (duty_j U_S - k_j omega_j) / R_j, U_S = V - R_i sum(duty_j I_j) is linear in U_S.
    The electrical pole (L/R = 44 us) is faster than a physics step, hence quasi-static.
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
