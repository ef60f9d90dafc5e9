"""Writers of measured logs: CSV, npz and MCAP, as `gaitswarm.sim.measurement` reads them."""

from __future__ import annotations

import io
import json
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.measurement.measured_files import TIME, heading
from gaitswarm.sim.measurement.measured_log import MeasuredLog, Quantity

Floats = NDArray[np.float64]

TITLE: Final = "gaitswarm measured log 1"
"""First line; 1 is the version of the format."""

_MCAP_NAME: Final = "gaitswarm"
"""Of the topic, the schema and the metadata record."""


def columns_of_log(log: MeasuredLog) -> dict[str, Floats]:
    """Return the columns (T,) of a log by heading."""
    return {TIME: log.time} | {
        heading(quantity, channel): column
        for quantity in Quantity
        for channel, column in zip(log.channels(quantity), log.values(quantity).T, strict=True)
    }


def format_measured_log(log: MeasuredLog) -> str:
    """Format a log; parsing the text gives bit-identical numbers."""
    for key, value in log.metadata.items():
        if not _is_remark(key, value):
            raise MeasuredLogError(f"metadata {key!r}: {value!r} is not one printable line")
    columns = columns_of_log(log)
    rows = np.column_stack(list(columns.values())).tolist()
    return "\n".join(
        [
            f"# {TITLE}",
            *(f"# {key}: {value}" for key, value in log.metadata.items()),
            ",".join(columns),
            *(",".join(map(repr, row)) for row in rows),
            "",
        ]
    )


def _is_remark(key: str, value: str) -> bool:
    line = f"{key}: {value}"
    return (
        len(line.splitlines()) == 1
        and line.isprintable()
        and ":" not in key
        and key == key.strip() != ""
        and value == value.strip() != ""
    )


def format_npz(log: MeasuredLog) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **{**columns_of_log(log), **log.metadata})  # type: ignore[arg-type]
    return file.getvalue()


def format_mcap(log: MeasuredLog) -> bytes:
    from mcap.writer import Writer  # noqa: PLC0415 - an extra

    file = io.BytesIO()
    writer = Writer(file)
    writer.start(library=_MCAP_NAME)
    columns = columns_of_log(log)
    fields = {"type": "object", "additionalProperties": {"type": "number"}}
    schema = writer.register_schema(_MCAP_NAME, "jsonschema", json.dumps(fields).encode())
    channel = writer.register_channel(_MCAP_NAME, "json", schema)
    for row in np.column_stack(list(columns.values())).tolist():
        data = json.dumps(dict(zip(columns, row, strict=True))).encode()
        nanoseconds = round(row[0] * 1e9)
        writer.add_message(channel, nanoseconds, data, nanoseconds)
    writer.add_metadata(_MCAP_NAME, dict(log.metadata))
    writer.finish()
    return file.getvalue()
