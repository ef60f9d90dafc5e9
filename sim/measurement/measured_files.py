"""Measured logs as CSV, npz and MCAP, with the unit in every heading.

    # gaitswarm measured log 1
    # robot: szabadka2
    time [s],q_D.right_front_coxa [rad],...,U_S.right_front [V],...,a_BODY.z [g]
    0.0,0.3217,...

Lines before the headings that begin with `#` are comments; `# key: value` is kept as metadata.
Columns may have any order. q_POT is optional for any joint, a_BODY and w_BODY for all axes
together, I_B for the battery; all other quantities are required for every joint and leg. Logs of
torque-controlled robots have no U_P, need no U_S, and may have tau_M in place of I_M.

npz: arrays by heading, `I_M.left_rear_tibia [A]` (T,), or `I_M [A]` (T, channels) in the robot's
order; arrays of one string are metadata. MCAP: messages of channels with the encoding `json` are
objects of numbers by heading; those logged at the same time are a row. Without `time [s]`, a row's
time is that of the log.
"""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.measurement.measured_log import MeasuredLog, Quantity, channels_by_kind
from gaitswarm.sim.robot.robot import Robot

TIME: Final = "time [s]"

MIN_ROWS: Final = 100
"""Rows; no walking cycle is shorter than 0.2 s."""

_JITTER: Final = 2e-5
"""Tolerated deviation of a row from the period of 2 ms [s]."""

_HEADING: Final = re.compile(r"^(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?$")


def parse_measured_log(text: str, robot: Robot) -> MeasuredLog:
    lines = enumerate(text.removeprefix("\ufeff").splitlines(), start=1)
    metadata, head_line, headings = _head(lines)
    places = _places(headings, robot, head_line)
    values, line_of = _values(lines, headings, head_line)
    return _checked(robot, metadata, headings, places, values, line_of, head_line)


def log_of_columns(
    columns: Mapping[str, Floats], metadata: Mapping[str, str], robot: Robot
) -> MeasuredLog:
    """Return the log with these columns (T,) by heading; errors name rows from 1."""
    try:
        headings = list(columns)
        places = _places(headings, robot, None)
        values = np.column_stack(list(columns.values()))
        rows = range(1, len(values) + 1)
        return _checked(robot, dict(metadata), headings, places, values, rows, None)
    except MeasuredLogError as error:
        raise MeasuredLogError(error.problem, row=error.line, column=error.column) from error


def _checked(
    robot: Robot,
    metadata: dict[str, str],
    headings: list[str],
    places: dict[Quantity, dict[str, int]],
    values: Floats,
    line_of: Sequence[int],
    head_line: int | None,
) -> MeasuredLog:
    finite = np.isfinite(values)
    if not finite.all():
        row, column = np.argwhere(~finite)[0]
        raise MeasuredLogError(
            f"{values[row, column]} is not a finite number",
            line=line_of[row],
            column=headings[column],
        )
    if len(values) < MIN_ROWS:
        raise MeasuredLogError(
            f"{len(values)} rows; at least {MIN_ROWS} are required, of {CONTROL_PERIOD:g} s each",
            line=line_of[-1] if line_of else head_line,
        )
    time = values[:, headings.index(TIME)]
    _check_time(time, line_of)
    _check_currents(values, places, line_of)

    columns: dict[str, Any] = {
        quantity.column: np.ascontiguousarray(values[:, list(of_channels.values())])
        for quantity, of_channels in places.items()
        if of_channels
    }
    if "current" not in columns:
        columns["current"] = np.abs(columns["torque"]) / robot.actuators().torque
    return MeasuredLog(
        joints=robot.joint_names,
        legs=tuple(leg.name for leg in robot.legs),
        time=time.copy(),
        potentiometer_joints=tuple(places[Quantity.POTENTIOMETER]),
        metadata=metadata,
        **{"control_voltage": None, "supply": None, **columns},
    )


def heading(quantity: Quantity, channel: str) -> str:
    """A column's heading in the file: `I_M.left_rear_tibia [A]`."""
    return f"{quantity}.{channel} [{quantity.unit}]"


def _head(lines: Iterator[tuple[int, str]]) -> tuple[dict[str, str], int, list[str]]:
    """Return the metadata, the line number of the headings, and the headings."""
    metadata: dict[str, str] = {}
    for number, line in lines:
        if line.startswith("#"):
            key, colon, value = line[1:].partition(":")
            if colon:
                metadata[key.strip()] = value.strip()
        elif line.strip():
            return metadata, number, _cells(line, number)
    example = f"{TIME},{Quantity.DESIRED_ANGLE}..."
    raise MeasuredLogError(f"no headings: a line like '{example}' is missing")


def _cells(line: str, number: int) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise MeasuredLogError(f"no headings: {error}", line=number) from error


def expected_channels(robot: Robot) -> dict[Quantity, tuple[str, ...]]:
    """Possible channels of each quantity."""
    channels = channels_by_kind(robot.joint_names, tuple(leg.name for leg in robot.legs))
    other = Quantity.CONTROL_VOLTAGE if robot.is_torque_controlled else Quantity.TORQUE
    return {quantity: channels[quantity.per] for quantity in Quantity if quantity is not other}


def _places(headings: list[str], robot: Robot, line: int | None) -> dict[Quantity, dict[str, int]]:
    """Column of every channel present, in the robot's order."""
    expected = expected_channels(robot)
    units = {"time": "s"} | {
        f"{quantity}.{channel}": quantity.unit
        for quantity, channels in expected.items()
        for channel in channels
    }
    column_of: dict[str, int] = {}
    for index, text in enumerate(headings):
        match = _HEADING.match(text)
        name, unit = (match["name"], match["unit"]) if match else (text, None)
        if name not in units:
            example = heading(Quantity.JOINT_ANGLE, expected[Quantity.JOINT_ANGLE][0])
            raise MeasuredLogError(
                f"unknown; expected '{TIME}' or one of {', '.join(expected)} with a joint, leg or"
                f" axis of this robot, such as '{example}'",
                line=line,
                column=text,
            )
        column = f"{name} [{units[name]}]"
        if unit != units[name]:
            given = "no unit" if unit is None else f"unit {unit!r}"
            raise MeasuredLogError(f"{given}; it must be {units[name]!r}", line=line, column=column)
        if name in column_of:
            raise MeasuredLogError("occurs twice", line=line, column=column)
        column_of[name] = index
        headings[index] = column
    if "time" not in column_of:
        raise MeasuredLogError("is missing", line=line, column=TIME)
    places = {}
    required = _required(robot, column_of)
    for quantity, channels in expected.items():
        names = {channel: f"{quantity}.{channel}" for channel in channels}
        present = {c: column_of[name] for c, name in names.items() if name in column_of}
        partly = quantity.per == "axis" and present
        if partly or quantity in required:
            for channel in channels:
                if channel not in present:
                    raise MeasuredLogError(
                        "is missing", line=line, column=heading(quantity, channel)
                    )
        places[quantity] = present
    return places


def _required(robot: Robot, names: Iterable[str]) -> set[Quantity]:
    """Quantities that a log with columns of these names needs for every joint or leg."""
    required = {quantity for quantity in Quantity if not quantity.optional}
    if robot.is_torque_controlled:
        required -= {Quantity.CONTROL_VOLTAGE, Quantity.SUPPLY}
        if any(name.startswith(f"{Quantity.TORQUE}.") for name in names):
            required = (required - {Quantity.CURRENT}) | {Quantity.TORQUE}
    return required


def _values(
    lines: Iterator[tuple[int, str]], headings: list[str], head_line: int
) -> tuple[Floats, list[int]]:
    """(T, columns), and the line of each row; blank lines are skipped."""
    numbers = array("d")
    line_of: list[int] = []
    for number, line in lines:
        if not line.strip():
            continue
        cells = line.split(",")
        if len(cells) != len(headings):
            raise MeasuredLogError(
                f"{len(cells)} values for the {len(headings)} columns of line {head_line}",
                line=number,
            )
        if "_" in line:  # Python parses 1_0 as ten
            raise _not_a_number(cells, headings, number)
        try:
            numbers.extend(map(float, cells))
        except ValueError:
            raise _not_a_number(cells, headings, number) from None
        line_of.append(number)
    return np.array(numbers, dtype=np.float64).reshape(-1, len(headings)), line_of


def _not_a_number(cells: list[str], headings: list[str], line: int) -> MeasuredLogError:
    for cell, column in zip(cells, headings, strict=True):
        with suppress(ValueError):
            float(cell)
            if "_" not in cell:
                continue
        return MeasuredLogError(f"{cell.strip()!r} is not a number", line=line, column=column)
    return MeasuredLogError("not numbers", line=line)


def _check_time(time: Floats, line_of: Sequence[int]) -> None:
    steps = np.diff(time)
    wrong = np.flatnonzero(np.abs(steps - CONTROL_PERIOD) > _JITTER)
    if wrong.size:
        row = int(wrong[0])
        raise MeasuredLogError(
            f"{steps[row]:g} s after the previous row; rows must be {CONTROL_PERIOD:g} s apart",
            line=line_of[row + 1],
            column=TIME,
        )


def _check_currents(
    values: Floats, places: dict[Quantity, dict[str, int]], line_of: Sequence[int]
) -> None:
    for channel, column in places[Quantity.CURRENT].items():
        negative = np.flatnonzero(values[:, column] < 0.0)
        if negative.size:
            raise MeasuredLogError(
                f"{values[negative[0], column]:g} A is negative; currents must be absolute values",
                line=line_of[negative[0]],
                column=heading(Quantity.CURRENT, channel),
            )


LARGEST: Final = 1 << 30
"""Largest unpacked size of an npz file [B]."""


def parse_npz(content: bytes, robot: Robot) -> MeasuredLog:
    metadata: dict[str, str] = {}
    columns: dict[str, Floats] = {}
    whole = {
        f"{quantity} [{quantity.unit}]": [heading(quantity, channel) for channel in channels]
        for quantity, channels in expected_channels(robot).items()
    }
    for name, values in _arrays(content):
        if values.ndim == 0 and values.dtype.kind == "U":
            metadata[name] = str(values)
        elif values.dtype.kind not in "fiu":
            raise MeasuredLogError(f"{values.dtype} is not a type of numbers", column=name)
        elif name in whole:
            names = whole[name]
            if values.ndim != 2 or values.shape[1] != len(names):
                raise MeasuredLogError(
                    f"shape {values.shape} is not (rows, {len(names)})", column=name
                )
            columns |= dict(zip(names, values.T.astype(np.float64), strict=True))
        elif values.ndim != 1:
            raise MeasuredLogError(f"shape {values.shape} is not (rows,)", column=name)
        else:
            columns[name] = values.astype(np.float64)
    lengths = {name: len(column) for name, column in columns.items()}
    for name, length in lengths.items():
        if length != lengths.get(TIME, length):
            raise MeasuredLogError(f"{length} rows; {TIME!r} has {lengths[TIME]}", column=name)
    return log_of_columns(columns, metadata, robot)


def _arrays(content: bytes) -> Iterator[tuple[str, NDArray[Any]]]:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            if sum(entry.file_size for entry in packed.infolist()) > LARGEST:
                raise MeasuredLogError(f"larger than {LARGEST >> 20} MiB when unpacked")
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            yield from file.items()
    except (zipfile.BadZipFile, ValueError, EOFError) as error:
        raise MeasuredLogError(f"not an npz file of plain arrays: {error}") from error


def parse_mcap(content: bytes, robot: Robot) -> MeasuredLog:
    mcap = _mcap()
    metadata: dict[str, str] = {}
    rows: dict[int, dict[str, float]] = {}
    try:
        reader = mcap.reader.make_reader(io.BytesIO(content), validate_crcs=True)
        for record in reader.iter_metadata():
            metadata |= record.metadata
        for _, channel, message in reader.iter_messages():
            if channel.message_encoding == "json":
                row = rows.setdefault(message.log_time, {})
                row |= _numbers(message.data, len(rows))
    except (mcap.exceptions.McapError, ValueError) as error:
        raise MeasuredLogError(f"not an MCAP file of JSON messages: {error}") from error
    headings = {name: None for row in rows.values() for name in row}
    for number, row in enumerate(rows.values(), start=1):
        for name in headings:
            if name not in row:
                raise MeasuredLogError("is missing", row=number, column=name)
    columns = {name: np.array([row[name] for row in rows.values()]) for name in headings}
    if rows and TIME not in columns:
        columns[TIME] = np.array(list(rows)) * 1e-9
    return log_of_columns(columns, metadata, robot)


def _numbers(data: bytes, row: int) -> Mapping[str, float]:
    fields = json.loads(data)
    if not isinstance(fields, dict):
        raise MeasuredLogError("a message is not an object of numbers by heading", row=row)
    for name, value in fields.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise MeasuredLogError(f"{value!r} is not a number", row=row, column=name)
    return {name: float(value) for name, value in fields.items()}


def _mcap() -> Any:
    try:
        import mcap.exceptions  # noqa: PLC0415
        import mcap.reader  # noqa: PLC0415
    except ImportError as error:
        raise MeasuredLogError("MCAP files need `pip install 'gaitswarm[mcap]'`") from error
    return mcap
