"""The battery shared by all motors, in symbols or numbers (thesis 2.2.5)."""

from __future__ import annotations

from collections.abc import Sequence

from gaitswarm.sim.kernel.dynamics.spatial import Scalar


def supply_voltage(
    duty: Sequence[Scalar],
    rates: Sequence[Scalar],
    torque: Sequence[Scalar],
    conductance: Sequence[Scalar],
    source: Scalar,
    internal: Scalar,
) -> Scalar:
    """Supply voltage [V] of one battery of finite resistance under quasi-static motor currents.

    The bridges conserve power: the battery's current is sum(duty_j I_j), I_j = (duty_j U_S - k_j
    omega_j) / R_j, so U_S = V - R_i sum(duty_j I_j) is linear in U_S (thesis 2.2.5).
    """
    back, load = 0.0, 0.0
    for share, rate, k, g in zip(duty, rates, torque, conductance, strict=True):
        per_ohm = share * g
        back = back + per_ohm * (k * rate)
        load = load + per_ohm * share
    return (source + internal * back) / (1.0 + internal * load)
