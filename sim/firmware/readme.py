"""The text that lies beside firmware: what is what, what it takes, and the way back."""

from __future__ import annotations

from collections.abc import Sequence

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.firmware.c_text import filled
from gaitswarm.sim.firmware.memory import BUDGET, Memory
from gaitswarm.sim.firmware.trajectory_table import TrajectoryTable


def readme(
    label: str,
    controller: str,
    memory: Memory,
    trajectories: Sequence[TrajectoryTable],
    scenarios: Sequence[str],
    robot: str,
) -> str:
    """`README.md` of a folder of firmware."""
    rows = [
        f"| {t.name} | {len(t.rows)} | {t.rows.shape[1]} |"
        f" {t.repeats_from if t.repeats else 'none'} | {t.bytes} | {t.bytes_of_a_leg} |"
        for t in trajectories
    ]
    rows.append(f"| all | | | | {memory.trajectories} | {memory.trajectories_of_a_leg} |")
    robot_option = f" --robot {robot}" if robot else ""
    return filled(
        "README.md",
        label=label,
        controller=controller,
        period=f"{CONTROL_PERIOD * 1000:g}",
        rate=f"{1.0 / CONTROL_PERIOD:g}",
        processor=BUDGET.name,
        flash=BUDGET.flash,
        ram=BUDGET.ram,
        tables=memory.tables,
        remembered=memory.ram,
        remarks="\n".join(f"\n**It does not fit:** {remark}." for remark in memory.remarks()),
        trajectories="\n".join(rows),
        validate="\n".join(
            f"gaitswarm validate measured.csv --design firmware.json --controller {controller}"
            f" --scenario {scenario}{robot_option}"
            for scenario in scenarios
        ),
    )
