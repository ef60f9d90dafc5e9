"""Firmware as a folder of files: the text of each, and the walks that test them."""

from __future__ import annotations

import json
import shlex
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from string import Template
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, judge, kernel_of, plan_walk
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.controllers import CONTROLLERS, ControlLaw, ControllerName, control_law
from gaitswarm.sim.controllers.base import LookupTable
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.controllers.quantisation import Axis
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.firmware.microcontroller import (
    LawIntegers,
    Memory,
    TrajectoryTable,
    in_16_bits,
    law_integers,
    trajectory_table,
)
from gaitswarm.sim.gait.trajectory import require_reachable
from gaitswarm.sim.kernel.emitted.source import control_tick
from gaitswarm.sim.kernel.observation import encoder_angles, split_states
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotChoice, RobotFiles, RobotVariant, load_robot
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import PRESETS, Scenario

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
        **_table_numbers("DIRECT", law.tables.get("direct")),
        **_table_numbers("INTEGRATED", law.tables.get("integrated")),
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
    for name, table in law.tables.items():
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


def expected_source(law: LawIntegers, walks: Mapping[str, int]) -> str:
    """`test/expected.c`: files of walks, and hashes of tables."""
    tables = [
        f'    {{"{name} table", {name}_table, {table.values.size}u, {fnv(table.values)}u}},'
        for name, table in law.tables.items()
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
        processor=memory.processor,
        flash=memory.flash,
        ram=memory.ram,
        tables=memory.tables,
        remembered=memory.remembered,
        remarks="\n".join(f"\n**It does not fit:** {remark}." for remark in memory.remarks),
        trajectories="\n".join(rows),
        validate="\n".join(
            f"gaitswarm validate measured.csv --design firmware.json --controller {controller}"
            f" --scenario {scenario}{robot_option}"
            for scenario in scenarios
        ),
    )


Codes = NDArray[np.int16]


@dataclass(frozen=True, slots=True, eq=False)
class ControlLog:
    """Coded inputs and outputs of a walk's controllers; T ticks, J joints."""

    scenario: Scenario  # in the gait of the design
    status: Status
    desired: Codes  # (T, J) [counts of angle]
    angle: Codes  # of the motors, (T, J) [counts of angle]
    current: NDArray[np.uint16]  # absolute, (T, J) [counts of current]
    pwm: Codes  # output of the controllers, (T, J) [PWM counts]
    objectives: NDArray[np.float64]  # f1 to f6, (6,), NaN where undefined

    @property
    def ticks(self) -> int:
        return len(self.pwm)


def control_logs(
    robot: Robot, scenarios: Sequence[Scenario], law: ControlLaw, gait: Mapping[str, float]
) -> tuple[ControlLog, ...]:
    """Simulate a control law and log its inputs and outputs."""
    kernel = kernel_of(robot)
    coding, timestep = control_steps(robot)
    walked = [with_gait(scenario, gait) for scenario in scenarios]
    setups = []
    for scenario in walked:
        require_reachable(robot, scenario)
        plan = plan_walk(robot, scenario, timestep)
        assert plan is not None  # noqa: S101 - the gait is reachable
        setups.append(plan(law))
    logs = []
    for scenario, setup, result in zip(
        walked, setups, kernel.walk(setups, coding, log=True), strict=True
    ):
        assert result.states is not None  # noqa: S101
        ticks = int(np.isfinite(result.states).all(axis=1).sum())
        states = split_states(robot, result.states[:ticks])
        name, joints = scenario.name, robot.joint_names
        desired = setup.desired[:ticks].astype(np.int64)
        angle = coding.angle_codes(encoder_angles(robot, states))
        current = coding.current_codes(states.sensed_current)
        status, objectives = judge(setup, result, coding.substeps, timestep)
        logs.append(
            ControlLog(
                scenario=scenario,
                status=status,
                desired=in_16_bits(desired, np.int16, f"{name}: the desired angle", joints),
                angle=in_16_bits(angle, np.int16, f"{name}: the angle", joints),
                current=in_16_bits(current, np.uint16, f"{name}: the current", joints),
                pwm=coding.pwm_codes(states.duty).astype(np.int16),
                objectives=objectives,
            )
        )
    return tuple(logs)


MANIFEST: Final = "firmware.json"
"""File that lists the others; it identifies a folder as firmware."""

FORMAT: Final = "gaitswarm firmware 1"

MAX_BITS: Final = (12, 8)
"""Largest resolution of a table's indices: angle error and current."""

_CODE: Final = (
    "Makefile",
    "controller.c",
    "counts.h",
    "tables.h",
    "trajectory.h",
    "test/host.c",
    "test/machine.h",
    "test/replay.c",
    "target/board.c",
    "target/board.ld",
    "target/cycles.awk",
)
"""Files of this package that are copied unchanged."""

_MAGIC: Final = b"GSWALK1\0"


@dataclass(frozen=True, slots=True, eq=False)
class Firmware:
    """A design for a microcontroller."""

    files: Mapping[str, bytes]  # content by path; the manifest is the last
    law: LawIntegers
    trajectories: tuple[TrajectoryTable, ...]  # desired angles, by scenario
    logs: tuple[ControlLog, ...]  # simulated walks that a test of the files repeats
    memory: Memory
    # by objective, largest relative difference from walks with the default table [1]; None with the
    # default table
    table_difference: Mapping[str, float] | None = None

    @property
    def samples(self) -> int:
        """Number of outputs that a test of the files compares."""
        return sum(log.pwm.size for log in self.logs)


def firmware_of(
    robot: RobotChoice,
    controller: ControllerName,
    design: Mapping[str, float],
    scenarios: Sequence[Scenario],
    *,
    label: str,
    table_bits: tuple[int, int] | None = None,
) -> Firmware:
    """Write a design as C, and simulate the walks that test it."""
    gait = {name: value for name, value in design.items() if name in GAIT_CATALOGUE}
    gains = {name: value for name, value in design.items() if name not in gait}
    check_drives_by_pwm(robot)
    machine = load_robot(robot)
    usual = control_law(controller, tuple(gains.items()))
    law = usual
    if table_bits is not None:
        error, current = table_bits
        axes = Axis(error, centred=True), Axis(current, centred=False)
        law = _tabulated(controller).compile_with(gains, *axes)
    coding, _ = control_steps(machine)
    integers = law_integers(law, coding)
    logs = control_logs(machine, scenarios, law, gait)
    trajectories = tuple(trajectory_table(machine, log.scenario) for log in logs)
    memory = Memory.of(integers, trajectories)
    difference = None
    if table_bits is not None:
        difference = _difference(logs, control_logs(machine, scenarios, usual, gait))
    walks = {f"test/walks/{log.scenario.name}.walk": log for log in logs}
    legs = machine.n_joints // JOINTS_PER_LEG
    names, scenario_files = _scenario_files(scenarios)
    robot_option, robot_files = _robot_files(robot)
    texts = {
        **{name: code_file(name) for name in _CODE},
        "tick.c": control_tick(),
        "controller.h": controller_header(machine, controller, label),
        "law.h": law_header(integers),
        "tables.c": tables_source(integers),
        "trajectories.c": trajectories_source(trajectories),
        "test/expected.h": filled(
            "test/expected.h", legs=legs, walks=len(logs), tables=len(integers.tables)
        ),
        "test/expected.c": expected_source(integers, {f: log.ticks for f, log in walks.items()}),
        "README.md": readme(label, controller, memory, trajectories, names, robot_option),
        **scenario_files,
        **robot_files,
    }
    files = {name: text.encode() for name, text in sorted(texts.items())}
    files |= {name: _walk_file(log) for name, log in walks.items()}
    manifest = {
        "format": FORMAT,
        "label": label,
        "robot": machine.description.name,
        "controller": controller,
        "design": dict(design),
        "table_bits": table_bits,
        "scenarios": [log.scenario.model_dump(mode="json") for log in logs],
        "files": [*files, MANIFEST],
    }
    files[MANIFEST] = (json.dumps(manifest, indent=2) + "\n").encode()
    return Firmware(files, integers, trajectories, logs, memory, difference)


def parsed_table_bits(text: str) -> tuple[int, int]:
    """Parse the resolution of a table."""
    error, _, current = text.partition("x")
    if not (error.isascii() and error.isdigit() and current.isascii() and current.isdigit()):
        raise SimulationInputError(f"{text!r} is not a resolution such as 8x6")
    return int(error), int(current)


def check_drives_by_pwm(robot: RobotChoice) -> None:
    """Check that the robot's drives are DC motors."""
    machine = load_robot(robot)
    if machine.is_torque_controlled:
        raise SimulationInputError(
            f"firmware outputs the PWM of DC motors; {machine.description.name} has"
            " torque-controlled actuators, which take torques or a joint PD's gains"
        )
    if machine.servos is not None:
        raise SimulationInputError(
            f"{machine.description.name} has servos, which run their own firmware; export their"
            " angles by `gaitswarm trajectories`"
        )


def check_table_bits(controller: ControllerName, bits: tuple[int, int]) -> None:
    """Check that a controller supports a table of this resolution."""
    _tabulated(controller)
    for name, requested, most in zip(("angle error", "current"), bits, MAX_BITS, strict=True):
        if not 2 <= requested <= most:
            raise SimulationInputError(f"{requested} bits of {name}: must be 2 to {most}")


@runtime_checkable
class _Tabulated(Protocol):
    """A controller whose direct part is a table."""

    def compile_with(
        self, design: Mapping[str, float], error: Axis, current: Axis
    ) -> ControlLaw: ...


def _tabulated(controller: ControllerName) -> _Tabulated:
    family = CONTROLLERS[controller]
    if isinstance(family, _Tabulated):
        return family
    raise SimulationInputError(f"{controller} has no table")


def _difference(logs: Sequence[ControlLog], usual: Sequence[ControlLog]) -> dict[str, float]:
    """Largest over scenarios by objective, except the height loss, which is near zero."""
    ours, theirs = (np.array([log.objectives for log in walked]) for walked in (logs, usual))
    largest = np.abs(ours / theirs - 1.0).max(axis=0)
    return dict(zip(OBJECTIVE_NAMES[:-1], largest[:-1].tolist(), strict=True))


def _scenario_files(scenarios: Sequence[Scenario]) -> tuple[list[str], dict[str, str]]:
    """Command-line names of the scenarios, and files of those that are not presets."""
    names, files = [], {}
    for scenario in scenarios:
        name = scenario.name
        if scenario not in PRESETS:
            name = f"scenarios/{scenario.name}.json"
            files[name] = scenario.model_dump_json(indent=2) + "\n"
        names.append(name)
    return names, files


def _robot_files(robot: RobotChoice) -> tuple[str, dict[str, str]]:
    """Command-line name of the robot, empty for the default, and files of a custom one."""
    if isinstance(robot, str):
        return ("" if robot == DEFAULT_ROBOT else robot), {}
    if isinstance(robot, RobotVariant):
        return shlex.quote(robot.model_dump_json(exclude_defaults=True)), {}
    if isinstance(robot, RobotFiles):
        return "robot", {"robot/robot.toml": robot.toml, "robot/robot.urdf": robot.urdf}
    return "FOLDER", {}


def _walk_file(log: ControlLog) -> bytes:
    """Little-endian; by leg and tick: desired angles, angles, currents, PWM counts."""
    ticks, joints = log.pwm.shape
    legs = joints // JOINTS_PER_LEG
    columns = np.stack(
        [
            log.desired.view(np.uint16),
            log.angle.view(np.uint16),
            log.current,
            log.pwm.view(np.uint16),
        ]
    )
    by_leg = columns.reshape(4, ticks, legs, JOINTS_PER_LEG).transpose(2, 1, 0, 3)
    return _MAGIC + struct.pack("<II", legs, ticks) + by_leg.astype("<u2").tobytes()
