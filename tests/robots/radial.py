"""Robots whose legs point away from the middle, as those of round hexapods and spiders do."""

from __future__ import annotations

import math


def radial_robot(legs: int, first: float = 0.0, limit: float = 0.8) -> str:
    """A URDF with legs all round: coxa about the vertical, femur and tibia up and down.

    Args:
        legs: How many.
        first: Direction of the first one, from ahead to the left [rad].
        limit: Of the coxae to both sides [rad].

    Returns:
        Text of the file.
    """
    parts = [f'<robot name="round{legs}"><link name="base">{_inertial(2.0, 0.0)}</link>']
    for number in range(legs):
        angle = first + 2.0 * math.pi * number / legs
        hip = f"{0.12 * math.cos(angle)!r} {0.12 * math.sin(angle)!r} 0"
        before = "base"
        for part, length, mass, at, turned, axis, lower, upper in (
            ("coxa", 0.05, 0.05, hip, angle, "0 0 1", -limit, limit),
            ("femur", 0.07, 0.1, "0.05 0 0", 0.0, "0 1 0", -1.5, 1.5),
            ("tibia", 0.12, 0.08, "0.07 0 0", 0.0, "0 1 0", -0.5, 2.4),
        ):
            joint = f"leg{number}_{part}"
            parts.append(
                f'<joint name="{joint}" type="revolute"><parent link="{before}"/>'
                f'<child link="{joint}_link"/><origin xyz="{at}" rpy="0 0 {turned!r}"/>'
                f'<axis xyz="{axis}"/>'
                f'<limit lower="{lower}" upper="{upper}" effort="6" velocity="6"/></joint>'
                f'<link name="{joint}_link">{_inertial(mass, length)}</link>'
            )
            before = f"{joint}_link"
        parts.append(
            f'<joint name="leg{number}_end" type="fixed"><parent link="{before}"/>'
            f'<child link="leg{number}_foot"/><origin xyz="0.12 0 0"/></joint>'
            f'<link name="leg{number}_foot"/>'
        )
    return "\n".join([*parts, "</robot>"])


def _inertial(mass: float, length: float) -> str:
    """Of a rod along x, of a body of the same kind if it has no length."""
    across = mass * length**2 / 12.0 + 1e-5 if length else 0.01
    return (
        f'<inertial><origin xyz="{length / 2.0} 0 0"/><mass value="{mass}"/>'
        f'<inertia ixx="{min(across, 1e-5) if length else 0.01!r}" iyy="{across!r}"'
        f' izz="{across!r}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
