"""Text of the firmware's files: numbers of a control law, tables, trajectories, README."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from string import Template
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.base import LookupTable
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.firmware.integers import LawIntegers
from gaitswarm.sim.firmware.memory import BUDGET, Memory, TrajectoryTable
from gaitswarm.sim.robot import Robot

_WIDTH: Final = 24
"""Numbers per line."""


def code_file(path: str) -> str:
    """Read a file that every firmware folder has."""
    return (resources.files("gaitswarm.sim.firmware") / "code" / path).read_text(encoding="utf-8")


def filled(path: str, **values: object) -> str:
    """Read a template and fill in its values."""
    return Template(code_file(path)).substitute(values)


def law_header(law: LawIntegers) -> str:
    """`law.h`: the control law's numbers."""
    numbers: dict[str, int] = {
        "FINE_BITS": law.fine_bits,
        "PROPORTIONAL_GAIN": law.law.proportional_gain,
        "DERIVATIVE_GAIN": law.law.derivative_gain,
        "INTEGRAL_GAIN": law.law.integral_gain,
        **_table_numbers("DIRECT", law.direct),
        **_table_numbers("INTEGRATED", law.integrated),
    }
    return filled(
        "law.h",
        ranges="\n".join(
            f"   {r.name:8} {r.largest:>20} {r.bits:>3}  {r.meaning}" for r in law.ranges
        ),
        numbers="\n".join(f"#define {name} {value}" for name, value in numbers.items()),
    )


def _table_numbers(part: str, table: LookupTable | None) -> dict[str, int]:
    if table is None:
        shape: tuple[int, ...] = (1, 1, 1)
        gains, largest = (0, 0, 0, 0), 0
    else:
        shape = table.values.shape
        gains = (table.output_gain, table.error_gain, table.current_gain, table.velocity_gain)
        largest = int(np.abs(table.values.astype(np.int64)).max())
    sizes = zip(("ERRORS", "CURRENTS", "VELOCITIES"), shape, strict=True)
    scales = zip(("GAIN", "ERROR_GAIN", "CURRENT_GAIN", "VELOCITY_GAIN"), gains, strict=True)
    return {
        f"{part}_USED": int(table is not None),
        **{f"{part}_{name}": size for name, size in sizes},
        # A product evaluated by the preprocessor may not fit an int of 16 bits.
        f"{part}_CELLS": int(np.prod(shape)),
        f"{part}_LARGEST": largest,
        **{f"{part}_{name}": gain for name, gain in scales},
    }


def controller_header(robot: Robot, controller: str, label: str) -> str:
    """`controller.h`: the functions that a leg's firmware calls, with units and scales."""
    sensors, pwm = robot.description.sensors, robot.description.pwm
    assert pwm is not None  # noqa: S101 - only DC motors get firmware
    return filled(
        "controller.h",
        label=_comment(label),
        controller=controller,
        robot=_comment(robot.description.name),
        rate=round(1.0 / CONTROL_PERIOD),
        angle_counts=f"{sensors.angle_counts:g}",
        angle_step=sensors.angle_step,
        current_counts=f"{sensors.current_counts:g}",
        current_step=sensors.current_step,
        current_filter=f"{sensors.current_filter * 1000:g}",
        pwm_counts=pwm.counts,
        pwm_step=pwm.step,
        full_scale=f"{pwm.full_scale:g}",
        nominal_voltage=f"{robot.description.supply.nominal_voltage:g}",
    )


def tables_source(law: LawIntegers) -> str:
    """`tables.c`: the fuzzy tables."""
    lines = ['#include "tables.h"', ""]
    for name, table in _tables(law).items():
        head = f"const int8_t {name}_table[{name.upper()}_CELLS] = {{"
        lines += [head, *_rows(table.values), "};", ""]
    return "\n".join(lines)


def trajectories_source(tables: Sequence[TrajectoryTable]) -> str:
    """`trajectories.c`: desired angles."""
    lines = ['#include "trajectory.h"', ""]
    entries = []
    for number, table in enumerate(tables):
        size, width = table.rows.shape
        lines += [
            f"/* {table.name}: {size} rows of {width} angles, {table.bytes} B (eq. 5.1). */",
            f"static const int16_t rows_{number}[{table.rows.size}] = {{",
            *_rows(table.rows),
            "};",
            f"static const uint8_t columns_{number}[{len(table.columns)}] = {{",
            *_rows(table.columns),
            "};",
            "",
        ]
        entries.append(
            f'    {{"{table.name}", rows_{number}, {size}, {table.repeats_from}, {width},'
            f" columns_{number}}},"
        )
    lines += ["const Trajectory trajectories[] = {", *entries, "};", ""]
    return "\n".join(lines)


def expected_header(law: LawIntegers, walks: int, legs: int) -> str:
    """`test/expected.h`: numbers of compared walks and tables."""
    return filled("test/expected.h", legs=legs, walks=walks, tables=len(_tables(law)))


def expected_source(law: LawIntegers, walks: Mapping[str, int]) -> str:
    """`test/expected.c`: files of walks, and hashes of tables."""
    tables = [
        f'    {{"{name} table", {name}_table, {table.values.size}u, {fnv(table.values)}u}},'
        for name, table in _tables(law).items()
    ]
    return "\n".join(
        [
            '#include "expected.h"',
            "",
            '#include "tables.h"',
            "",
            "const Expected_walk expected_walks[] = {",
            *(f'    {{"{file}", {ticks}u}},' for file, ticks in walks.items()),
            "};",
            "",
            "const Expected_table expected_tables[] = {",
            *tables,
            "    {0, 0, 0, 0}, /* end of the list, which may be empty */",
            "};",
            "",
        ]
    )


def fnv(values: NDArray[np.int8]) -> int:
    """FNV-1a hash of 32 bits."""
    hashed = 2166136261
    for byte in values.tobytes():
        hashed = (hashed ^ byte) * 16777619 & 0xFFFFFFFF
    return hashed


def _tables(law: LawIntegers) -> dict[str, LookupTable]:
    parts = {"direct": law.direct, "integrated": law.integrated}
    return {name: table for name, table in parts.items() if table is not None}


def _rows(values: NDArray[np.integer]) -> Iterable[str]:
    flat = values.ravel().tolist()
    for start in range(0, len(flat), _WIDTH):
        yield "    " + ", ".join(map(str, flat[start : start + _WIDTH])) + ","


def _comment(text: str) -> str:
    """Make a text neither end a C comment nor begin another one."""
    return text.replace("*/", "* /").replace("/*", "/ *").replace("\n", " ")


def readme(
    label: str,
    controller: str,
    memory: Memory,
    trajectories: Sequence[TrajectoryTable],
    scenarios: Sequence[str],
    robot: str,
) -> str:
    """`README.md` of a firmware folder."""
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
