"""Measured logs as npz and MCAP, with the headings of the CSV format.

npz: arrays by heading, `I_M.left_rear_tibia [A]` (T,), or `I_M [A]` (T, channels) in the robot's
order; arrays of one string are metadata. MCAP: messages of channels with the encoding `json` are
objects of numbers by heading; those logged at the same time are a row. Without `time [s]`, a row's
time is that of the log.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.measurement.measured_csv import TIME, expected_channels, heading, log_of_columns
from gaitswarm.sim.measurement.measured_log import MeasuredLog
from gaitswarm.sim.robot.robot import Robot

LARGEST: Final = 1 << 30
"""Largest unpacked size of an npz file [B]."""


def parse_npz(content: bytes, robot: Robot) -> MeasuredLog:
    metadata: dict[str, str] = {}
    columns: dict[str, Floats] = {}
    whole = {
        f"{quantity} [{quantity.unit}]": [heading(quantity, channel) for channel in channels]
        for quantity, channels in expected_channels(robot).items()
    }
    for name, array in _arrays(content):
        if array.ndim == 0 and array.dtype.kind == "U":
            metadata[name] = str(array)
        elif array.dtype.kind not in "fiu":
            raise MeasuredLogError(f"{array.dtype} is not a type of numbers", column=name)
        elif name in whole:
            names = whole[name]
            if array.ndim != 2 or array.shape[1] != len(names):
                raise MeasuredLogError(
                    f"shape {array.shape} is not (rows, {len(names)})", column=name
                )
            columns |= dict(zip(names, array.T.astype(np.float64), strict=True))
        elif array.ndim != 1:
            raise MeasuredLogError(f"shape {array.shape} is not (rows,)", column=name)
        else:
            columns[name] = array.astype(np.float64)
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
