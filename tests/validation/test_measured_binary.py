"""Measured logs as npz and MCAP files."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.measurement import measured_files
from gaitswarm.sim.measurement.measured_files import parse_mcap, parse_npz
from gaitswarm.sim.measurement.measured_log import MeasuredLog
from scripts.measured_logs import columns_of_log, format_mcap, format_npz
from tests.validation.test_measured_csv import assert_same, small_log
from tests.validation.walks import szabadka, without_supplements

ROBOT = szabadka()
LOG = replace(small_log(ROBOT), metadata={"robot": "szabadka2", "origin": "synthetic"})
ANGLE = "q.right_front_femur [rad]"


def packed(arrays: Mapping[str, Any]) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


@pytest.mark.parametrize("change", [lambda log: log, without_supplements], ids=["all", "needed"])
def test_an_npz_log_is_read_back_to_the_bit(change: Callable[[MeasuredLog], MeasuredLog]) -> None:
    log = change(LOG)
    assert_same(parse_npz(format_npz(log), ROBOT), log)


def test_an_npz_array_may_have_all_channels_of_a_quantity_in_the_robots_order() -> None:
    log = without_supplements(LOG)
    arrays = {
        "time [s]": log.time,
        "q_D [rad]": log.desired_angle,
        "U_P [V]": log.control_voltage,
        "q [rad]": log.joint_angle,
        "I_M [A]": log.current,
        "U_S [V]": log.supply,
        "robot": "szabadka2",
        "origin": "synthetic",
    }
    assert_same(parse_npz(packed(arrays), ROBOT), log)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({ANGLE: LOG.joint_angle[1:, 1]}, f"column '{ANGLE}': 119 rows; 'time [s]' has 120"),
        ({ANGLE: np.full(120, np.nan)}, f"row 1, column '{ANGLE}': nan is not a finite"),
        ({ANGLE: np.full(120, "x")}, f"column '{ANGLE}': <U1 is not a type of numbers"),
        ({ANGLE: np.zeros((120, 2))}, f"column '{ANGLE}': shape (120, 2) is not (rows,)"),
        ({"q [rad]": np.zeros((120, 2))}, "column 'q [rad]': shape (120, 2) is not (rows, 18)"),
        ({"q.tail [rad]": LOG.time}, "column 'q.tail [rad]': unknown"),
        ({ANGLE: np.array([{}], dtype=object)}, "not an npz file of plain arrays"),
    ],
)
def test_a_wrong_npz_file_is_refused_with_its_array_and_row(
    change: Mapping[str, Any], problem: str
) -> None:
    with pytest.raises(MeasuredLogError) as caught:
        parse_npz(packed({**columns_of_log(LOG), **change}), ROBOT)
    assert problem in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"time [s]\n0\n", format_npz(LOG)[:2000]])
def test_another_file_is_no_npz_log(content: bytes) -> None:
    with pytest.raises(MeasuredLogError, match="not an npz file"):
        parse_npz(content, ROBOT)


def test_an_npz_file_is_not_unpacked_without_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measured_files, "LARGEST", 1 << 16)
    with pytest.raises(MeasuredLogError, match="MiB when unpacked"):
        parse_npz(format_npz(LOG), ROBOT)


def test_an_mcap_log_is_read_back_to_the_bit() -> None:
    pytest.importorskip("mcap")
    assert_same(parse_mcap(format_mcap(LOG), ROBOT), LOG)
    with pytest.raises(MeasuredLogError, match="not an MCAP file"):
        parse_mcap(b"time [s]\n", ROBOT)
    with pytest.raises(MeasuredLogError, match="not an MCAP file"):
        parse_mcap(format_mcap(LOG)[:3000], ROBOT)


def written(messages: list[tuple[str, int, Any]]) -> bytes:
    """MCAP messages of topics at times [ns]; camera's are not JSON."""
    writing = pytest.importorskip("mcap.writer")
    file = io.BytesIO()
    writer = writing.Writer(file)
    writer.start()
    topics = {
        topic: writer.register_channel(topic, "ros1" if topic == "camera" else "json", 0)
        for topic in {topic for topic, _, _ in messages}
    }
    for topic, time, fields in messages:
        writer.add_message(topics[topic], time, json.dumps(fields).encode(), time)
    writer.finish()
    return file.getvalue()


def test_an_mcap_row_is_what_was_logged_at_one_time_on_any_topic() -> None:
    log = without_supplements(
        replace(LOG, time=np.arange(120, dtype=np.float64) * 0.002, metadata={})
    )
    columns = columns_of_log(log)
    messages: list[tuple[str, int, Any]] = [("camera", 0, [1, 2])]
    for row in range(120):
        fields = {name: float(column[row]) for name, column in columns.items()}
        by_topic: dict[str, dict[str, float]] = {}
        for name, value in fields.items():
            by_topic.setdefault(name.split(".")[0], {})[name] = value
        del by_topic["time [s]"]
        messages += [(topic, 2_000_000 * row, part) for topic, part in by_topic.items()]
    read = parse_mcap(written(messages), ROBOT)
    np.testing.assert_allclose(read.time, log.time, atol=1e-12)
    assert_same(replace(read, time=log.time), log)
    last = messages.pop()
    with pytest.raises(MeasuredLogError, match=r"row 120, column 'U_S.right_front \[V\]': is miss"):
        parse_mcap(written(messages), ROBOT)
    for wrong, problem in (([1], "not an object"), ({ANGLE: "x"}, "row 120, column .*'x' is not")):
        with pytest.raises(MeasuredLogError, match=problem):
            parse_mcap(written([*messages, (last[0], last[1], wrong)]), ROBOT)
