"""Hostile evidence files: checking ends in a finding."""

from __future__ import annotations

import inspect
import io
import json
import random
import sys
import zipfile
from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gaitswarm
from gaitswarm.evidence import archive
from gaitswarm.evidence.archive import MANIFEST, archived, parsed_json, unzipped
from gaitswarm.sim.errors import ProcessEnded
from gaitswarm.sim.robot import check
from tests.evidence.conftest import CHAIN, EVALUATIONS, Change, Proved, tampered, with_manifest
from tests.examples.hostile import TOML, URDF, chain

pytestmark = pytest.mark.slow


def refusal(content: bytes) -> str:
    """Why a file is not even read."""
    found = gaitswarm.verify(content, replay=1)
    assert not found.verified
    assert found.checks[-1].passed is False
    assert found.replayed == 0
    return found.checks[-1].detail


def zipped(members: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


def test_a_file_that_is_cut_off_is_no_whole_archive(proved: Proved) -> None:
    length = len(proved.content)
    for end in (0, 1, 30, 1000, length // 2, length - 200, length - 1):
        assert refusal(proved.content[:end]).startswith("it is not a complete zip archive")
    assert "not a complete zip archive" in refusal(b"PK" * 1000)


def test_an_archive_that_would_unpack_to_more_than_it_is_is_not_unpacked() -> None:
    bomb = zipped({MANIFEST: b"0" * 5_000_000}, zipfile.ZIP_DEFLATED)
    assert len(bomb) < 10_000
    assert "compressed" in refusal(bomb)


def test_members_that_overlap_are_not_read() -> None:
    """As in a bomb whose members share their bytes: one member under many names."""
    content = zipped({"a": b"0" * 100_000})
    (end,) = [content.rfind(b"PK\x05\x06")]
    (start,) = [content.rfind(b"PK\x01\x02")]
    entry, tail = content[start:end], bytearray(content[end:])
    names = [bytes([code]) for code in range(ord("a"), ord("z"))]
    directory = b"".join(entry[:46] + name + entry[47:] for name in names)
    tail[8:12] = len(names).to_bytes(2, "little") * 2
    tail[12:16] = len(directory).to_bytes(4, "little")
    assert "longer than it is" in refusal(content[:start] + directory + bytes(tail))


@pytest.mark.parametrize("name", ["../x", "/etc/passwd", "a/../b", "a\\b", "C:x", "a//b", "a\nb"])
def test_a_name_that_leads_out_of_it_is_refused(name: str) -> None:
    assert "leads out of it" in refusal(zipped({name: b""}))


def test_names_that_occur_twice_are_refused() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a", b"1")
        with pytest.warns(UserWarning, match="Duplicate"):
            archive.writestr("a", b"2")
    assert "twice" in refusal(file.getvalue())


def test_every_member_that_counts_is_missed(proved: Proved) -> None:
    members = unzipped(proved.content)
    assert f"it has no {MANIFEST}" in refusal(zipped({"a": b""}))
    for name in ("job.json", "spec.json", CHAIN, EVALUATIONS, "history/asks.parquet"):
        kept = {n: c for n, c in members.items() if n not in (name, MANIFEST)}
        assert refusal(archived(kept)) == f"it has no {name}"


DOCUMENTS: dict[str, bytes] = {
    "not a number": b'{"seed": NaN}',
    "infinite": b'{"seed": 1e999}',
    "endless nesting": b"[" * 100_000,
    "no text": b"\xff\xfe",
    "a list": b"[]",
    "an integer of a million digits": b'{"seed": ' + b"9" * 1_000_000 + b"}",
}


@pytest.mark.parametrize("document", DOCUMENTS.values(), ids=DOCUMENTS)
def test_documents_that_are_none_are_refused(proved: Proved, document: bytes) -> None:
    for name in ("spec.json", "job.json", CHAIN):
        assert name in refusal(tampered(proved.content, {name: lambda _: document}))


def test_nesting_takes_none_of_the_stack_that_cleaning_up_needs() -> None:
    nested = b"[" * 150 + b"]" * 150
    most = sys.getrecursionlimit()
    sys.setrecursionlimit(len(inspect.stack()) + 60)
    try:
        document = parsed_json(nested, "nested.json")
    finally:
        sys.setrecursionlimit(most)
    assert json.dumps(document).encode() == nested


def test_a_manifest_that_is_invalid_is_refused(proved: Proved) -> None:
    members = unzipped(proved.content)
    for document, why in (
        (b"[]", "cannot be read"),
        (b"{}", "files"),
        (json.dumps({"format": "another", "files": {}}).encode(), "format"),
        (json.dumps({"version": 2, "files": {}}).encode(), "version"),
    ):
        assert why in refusal(zipped(members | {MANIFEST: document}))


def test_a_manifest_cannot_vouch_for_itself(proved: Proved) -> None:
    manifest = json.loads(unzipped(proved.content)[MANIFEST])
    manifest["files"][MANIFEST] = "0" * 64
    found = gaitswarm.verify(with_manifest(proved.content, manifest), replay=0)
    assert [check.detail for check in found.checks if check.passed is False] == [
        f"{MANIFEST} has another SHA-256"
    ]


def with_robot(toml: str, urdf: str) -> Change:
    """A document that names a robot of its own."""

    def change(content: bytes) -> bytes:
        return json.dumps(json.loads(content) | {"robot": {"toml": toml, "urdf": urdf}}).encode()

    return change


@pytest.mark.parametrize("name", ["spec.json", CHAIN, "certificates/of-best/spec.json"])
def test_a_robot_that_ends_a_parser_ends_another_process_than_this(
    proved: Proved, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def ended(_: object) -> dict[str, object]:
        raise ProcessEnded("was ended by SIGSEGV")

    def parsed_here(*_: str) -> None:
        raise AssertionError("the robot was read in this process")

    monkeypatch.setattr(check.PROCESSES, "ask", ended)
    monkeypatch.setattr("gaitswarm.sim.robot.robot.parse_robot", parsed_here)
    members = {n: m for n, m in unzipped(proved.content).items() if n != MANIFEST}
    members["certificates/of-best/spec.json"] = members["spec.json"]
    members[name] = with_robot(f"# {name}\n{TOML}", URDF)(members[name])
    why = refusal(archived(members))
    assert why.startswith(f"{name} cannot be read: ") and "was ended by SIGSEGV" in why


def test_a_robot_that_breaks_a_bound_is_refused_as_text(
    proved: Proved, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check.PROCESSES, "ask", None)
    for robot in (with_robot(TOML, chain(4500)), with_robot("a." * 8000 + "a = 1", URDF)):
        assert "spec.json cannot be read: robot." in refusal(
            tampered(proved.content, {"spec.json": robot})
        )


def test_more_robots_than_a_job_has_are_not_tried(
    proved: Proved, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check.PROCESSES, "ask", None)

    def crowded(content: bytes) -> bytes:
        robots = [{"toml": f"# {number}", "urdf": URDF} for number in range(check.MOST_ROBOTS + 1)]
        return json.dumps(json.loads(content) | {"robot": robots}).encode()

    why = refusal(tampered(proved.content, {"spec.json": crowded}))
    assert why == f"spec.json: it has more than {check.MOST_ROBOTS} robots"


def parquet(table: pa.Table, **options: object) -> bytes:
    sink = io.BytesIO()
    pq.write_table(table, sink, **options)
    return sink.getvalue()


def test_a_table_that_claims_to_be_enormous_is_not_read(
    proved: Proved, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive, "_LARGEST_TABLE", 8_000_000)
    # Megabytes of zeros are some kilobytes of Parquet.
    bomb = parquet(pa.table({"iteration": np.zeros(1_000_001, dtype=np.int64)}))
    assert len(bomb) < 20_000
    assert "claims more" in refusal(tampered(proved.content, {EVALUATIONS: lambda _: bomb}))


TABLES: dict[str, Callable[[pa.Table], pa.Table]] = {
    "no columns": lambda table: table.select([]),
    "no rows": lambda table: table.slice(0, 0),
    "a row less": lambda table: table.slice(1),
    "a column less": lambda table: table.drop_columns(["short.torque"]),
    "words for numbers": lambda table: table.set_column(2, "fitness", pa.array(["x"] * len(table))),
    "an unknown status": lambda table: table.set_column(
        table.column_names.index("short.status"), "short.status", pa.array(["flew"] * len(table))
    ),
    "no design": lambda table: table.set_column(
        3, table.column_names[3], pa.nulls(len(table), pa.float64())
    ),
    "backwards": lambda table: table.take(list(range(len(table)))[::-1]),
}


@pytest.mark.parametrize("change", TABLES.values(), ids=TABLES)
def test_tables_that_are_not_of_the_job_are_refused(
    proved: Proved, change: Callable[[pa.Table], pa.Table]
) -> None:
    def written(content: bytes) -> bytes:
        return parquet(change(pq.read_table(pa.BufferReader(content))))

    assert EVALUATIONS in refusal(tampered(proved.content, {EVALUATIONS: written}))


def test_flipped_bits_anywhere_never_end_in_anything_but_a_finding(proved: Proved) -> None:
    draw = random.Random(1)
    members = unzipped(proved.content)
    names = [n for n in members if n.startswith(("job", "spec", "history"))]

    def flipped(content: bytes) -> bytes:
        damaged = bytearray(content)
        for _ in range(draw.randint(1, 4)):
            damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
        return bytes(damaged)

    for _ in range(60):
        gaitswarm.verify(tampered(proved.content, {draw.choice(names): flipped}), replay=0)
