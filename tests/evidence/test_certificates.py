"""Evidence of a job holds the certificates of its designs, and they are checked with it."""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import pytest

import gaitswarm
from gaitswarm import VerificationView
from gaitswarm.evidence.archive import unzipped
from tests.evidence.conftest import (
    EVALUATIONS,
    Certified,
    Change,
    Proved,
    tampered,
    with_cells,
)

pytestmark = pytest.mark.slow

ALL = 1000
"""More worlds than there are."""

CHECKS = ["contents", "robot", "fitness", "best", "designs", "search", "chain", "summary"]


def failed(found: VerificationView) -> list[tuple[str | None, str]]:
    return [(check.certificate, check.name) for check in found.checks if check.passed is False]


def next_up(value: float) -> float:
    (bits,) = struct.unpack("<Q", struct.pack("<d", value))
    (changed,) = struct.unpack("<d", struct.pack("<Q", bits ^ 1))
    return float(changed)


def changed(document: dict[str, Any]) -> Change:
    """A JSON member with other fields."""
    return lambda content: json.dumps(json.loads(content) | document).encode()


def test_finished_certificates_of_the_jobs_designs_are_in_it_with_their_history(
    certified: Certified,
) -> None:
    members = unzipped(certified.content)
    folders = {name.split("/")[1] for name in members if name.startswith("certificates/")}
    assert folders == {certified.of_best, certified.of_another}
    with gaitswarm.open(certified.db) as jobs:
        for job_id in folders:
            exported = b"".join(jobs.export(job_id, "parquet"))
            assert members[f"certificates/{job_id}/{EVALUATIONS}"] == exported
            shown = json.loads(members[f"certificates/{job_id}/certificate.json"])
            assert shown == json.loads(jobs.certificate(job_id, most=20).model_dump_json())
        assert jobs.evidence(certified.id) == certified.content


def test_they_are_verified_with_the_job(certified: Certified) -> None:
    found = gaitswarm.verify(certified.content, replay=2, seed=3)
    assert found.verified
    for job_id in (certified.of_best, certified.of_another):
        checks = {c.name: c for c in found.checks if c.certificate == job_id}
        assert list(checks) == [*CHECKS, "replay", "design"]
        assert all(check.passed for check in checks.values())
        is_best = job_id == certified.of_best
        assert checks["design"].detail.endswith(", the best") == is_best
    (last,) = [check for check in found.checks if check.name == "certificates"]
    assert (last.passed, last.detail) == (True, "2 of designs of this job")
    # Two evaluations and the best one of each of three runs.
    assert 6 <= found.replayed <= 9


def test_one_bit_of_a_world_is_caught_by_the_replay(certified: Certified) -> None:
    def change(columns: dict[str, list[Any]]) -> None:
        columns["short.height_loss"][3] = next_up(columns["short.height_loss"][3])

    folder = f"certificates/{certified.of_best}"
    changes = {f"{folder}/{EVALUATIONS}": with_cells(change)}
    content = tampered(certified.content, changes)
    assert failed(gaitswarm.verify(content, replay=0)) == [(certified.of_best, "chain")]
    found = gaitswarm.verify(content, replay=ALL)
    assert failed(found) == [(certified.of_best, "chain"), (certified.of_best, "replay")]
    (difference,) = found.differences
    assert (difference.certificate, difference.what) == (certified.of_best, "height_loss")


def test_another_summary_another_world_and_another_design_are_caught(
    certified: Certified,
) -> None:
    folder = f"certificates/{certified.of_best}"

    def of(name: str, change: Change) -> list[str]:
        found = gaitswarm.verify(
            tampered(certified.content, {f"{folder}/{name}": change}), replay=0
        )
        assert {job_id for job_id, _ in failed(found)} == {certified.of_best}
        return [check for _, check in failed(found)]

    def kinder(columns: dict[str, list[Any]]) -> None:
        columns["design.friction_factor"][2] = 1.0

    assert of("certificate.json", changed({"worlds": 6})) == ["summary"]
    assert "design" in of("spec.json", changed({"design": {"P": 0.9, "I": 0.0}}))
    assert "designs" in of(EVALUATIONS, with_cells(kinder))
    assert of("spec.json", changed({"seed": 99})) == ["search", "chain", "summary"]
    assert of("spec.json", lambda _: b"{}") == ["contents"]
    assert of("job.json", changed({"id": certified.of_another})) == ["summary", "design"]


def test_the_last_digits_of_a_summary_may_be_those_of_another_library(
    certified: Certified,
) -> None:
    name = f"certificates/{certified.of_best}/certificate.json"

    def nudged(content: bytes) -> bytes:
        document = json.loads(content)
        document["failed"]["high"] = math.nextafter(document["failed"]["high"], 1.0)
        return json.dumps(document).encode()

    assert gaitswarm.verify(tampered(certified.content, {name: nudged}), replay=0).verified


def test_without_a_certificate_evidence_is_whole_and_says_how_to_make_one(proved: Proved) -> None:
    found = gaitswarm.verify(proved.content, replay=0)
    (check,) = [check for check in found.checks if check.name == "certificates"]
    assert found.verified and check.passed is None
    assert f"`gaitswarm certify {proved.id}` makes one" in check.detail
    page = unzipped(proved.content)["index.html"].decode()
    assert f"<code>gaitswarm certify {proved.id}</code> makes one" in page


def test_the_page_shows_their_numbers_and_worst_worlds(certified: Certified) -> None:
    page = unzipped(certified.content)["index.html"].decode()
    with gaitswarm.open(certified.db) as jobs:
        view = jobs.certificate(certified.of_best)
    assert page.count("<h2>Certificate: 5 worlds</h2>") == 2
    assert page.index(certified.of_best) < page.index(certified.of_another)
    assert f"{view.fitness.cvar:.6g}" in page and f"{view.fitness.worst:.6g}" in page
    for world in view.worst:
        assert world.replay in page
    assert "makes one" not in page


def test_a_certificates_own_evidence_shows_and_checks_what_it_says(certified: Certified) -> None:
    with gaitswarm.open(certified.db) as jobs:
        content = jobs.evidence(certified.of_best)
    found = gaitswarm.verify(content, replay=1)
    assert found.verified
    assert [c.name for c in found.checks][2:] == [*CHECKS, "replay"]
    assert "<h2>Certificate: 5 worlds</h2>" in unzipped(content)["index.html"].decode()
    content = tampered(content, {"certificate.json": changed({"worlds": 6})})
    assert failed(gaitswarm.verify(content, replay=0)) == [(None, "summary")]


def test_an_unfinished_certificate_is_left_out(certified: Certified) -> None:
    with gaitswarm.open(certified.db) as jobs:
        queued = next(jobs.jobs(state="queued"))
    assert queued.kind == "certificate" and queued.id.encode() not in certified.content
