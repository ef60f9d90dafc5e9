"""Evidence is believed only as far as it can be checked."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import pytest

import gaitswarm
from gaitswarm import VerificationView
from gaitswarm.evidence.archive import MANIFEST, unzipped
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.sim.controllers import CONTROLLERS
from tests.evidence.conftest import (
    ASKS,
    EVALUATIONS,
    JOB,
    Change,
    Proved,
    tampered,
    with_cells,
    with_manifest,
)
from tests.examples.processes import COMMAND_LINE, python

pytestmark = pytest.mark.slow

ALL = 1000
"""More evaluations than there are."""

CHECKS = [
    *("archive", "hashes", "contents", "robot"),
    *("fitness", "best", "designs", "search", "chain", "replay"),
]

Columns = dict[str, list[Any]]


def failed(found: VerificationView) -> list[str]:
    return [check.name for check in found.checks if check.passed is False]


def next_up(value: float) -> float:
    """The same number with its last bit changed."""
    (bits,) = struct.unpack("<Q", struct.pack("<d", value))
    (changed,) = struct.unpack("<d", struct.pack("<Q", bits ^ 1))
    return float(changed)


def walked(columns: Columns) -> int:
    """A row that succeeded, and is not the best."""
    order = sorted(range(len(columns["fitness"])), key=lambda k: columns["fitness"][k] or math.inf)
    return order[1]


def changed(name: str, document: dict[str, Any]) -> dict[str, Change]:
    """Fields of a JSON member with other values."""
    return {name: lambda content: json.dumps(json.loads(content) | document).encode()}


def test_what_is_no_file_is_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(gaitswarm.NotFound, match=r"no such file: .*nowhere\.zip"):
        gaitswarm.verify(tmp_path / "nowhere.zip")
    with pytest.raises(gaitswarm.InvalidRequest, match=r"cannot read .*: Is a directory"):
        gaitswarm.verify(tmp_path)


def test_untouched_evidence_is_verified_in_all_it_says(proved: Proved) -> None:
    found = gaitswarm.verify(proved.content, replay=5, seed=3)
    assert found.verified
    assert {check.name: check.passed for check in found.checks} == dict.fromkeys(
        [
            "archive",
            "hashes",
            "contents",
            "robot",
            "fitness",
            "best",
            "designs",
            "search",
            "chain",
            "replay",
        ],
        True,
    ) | {"certificates": None}
    assert (found.job, found.seed, found.differences) == (proved.id, 3, [])
    assert found.replayed in (5, 6)
    assert found.provenance == []


@pytest.mark.thorough("test_untouched_evidence_is_verified_in_all_it_says, by another process")
def test_it_is_verified_by_a_process_in_another_folder_without_a_database(
    proved: Proved, tmp_path: Path
) -> None:
    file = tmp_path / "evidence.zip"
    file.write_bytes(proved.content)
    arguments = (*COMMAND_LINE, "verify", "evidence.zip", "--replay", "3", "--json")
    done = python(*arguments, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["verified"] is True
    assert [path.name for path in tmp_path.iterdir()] == ["evidence.zip"]


def test_one_bit_of_an_objective_that_nothing_follows_from_is_caught_by_the_replay(
    proved: Proved,
) -> None:
    def change(columns: Columns) -> None:
        row = walked(columns)
        columns["short.height_loss"][row] = next_up(columns["short.height_loss"][row])

    content = tampered(proved.content, {EVALUATIONS: with_cells(change)})
    assert failed(gaitswarm.verify(content, replay=0)) == ["chain"]
    found = gaitswarm.verify(content, replay=ALL)
    assert failed(found) == ["chain", "replay"]
    (difference,) = found.differences
    assert (difference.case, difference.what) == ("short", "height_loss")
    assert isinstance(difference.stored, float)
    assert next_up(difference.stored) == difference.simulated


def test_one_bit_of_an_objective_whose_fitness_was_corrected_is_caught_by_the_replay(
    proved: Proved,
) -> None:
    spec = gaitswarm.JobSpec.model_validate_json(unzipped(proved.content)["spec.json"])
    names = [objective.name for objective in spec.objectives]

    def change(columns: Columns) -> None:
        import numpy as np

        row = walked(columns)
        columns["short.torque"][row] = next_up(columns["short.torque"][row])
        values = np.array([[[columns[f"short.{name}"][row] for name in names]]])
        judged = spec.judge(values, np.zeros((1, 1), dtype=bool))
        columns["fitness"][row] = float(judged.fitness[0])

    found = gaitswarm.verify(
        tampered(proved.content, {EVALUATIONS: with_cells(change)}), replay=ALL
    )
    assert "replay" in failed(found) and "fitness" not in failed(found)
    assert [d.what for d in found.differences] == ["torque"]


def test_one_bit_of_an_objective_that_counts_is_caught_without_a_walk(proved: Proved) -> None:
    def change(columns: Columns) -> None:
        row = walked(columns)
        # The torque's last bits may not reach the fitness; a thousandth does.
        columns["short.torque"][row] *= 1.001

    found = gaitswarm.verify(tampered(proved.content, {EVALUATIONS: with_cells(change)}), replay=0)
    assert failed(found) == ["fitness", "chain"]


def test_one_bit_of_a_file_is_caught_by_its_hash(proved: Proved) -> None:
    content = bytearray(proved.content)
    place = content.find(b"<svg ")
    content[place + 1] ^= 1
    # The archive's own checksum notices first.
    assert failed(gaitswarm.verify(bytes(content), replay=0)) == ["archive"]
    members = unzipped(proved.content)
    manifest = json.loads(members[MANIFEST])
    manifest["files"]["index.html"] = "0" * 64
    found = gaitswarm.verify(with_manifest(proved.content, manifest), replay=0)
    assert failed(found) == ["hashes"]
    assert "index.html has another SHA-256" in found.checks[1].detail


def test_another_best_another_design_another_search_and_another_robot_are_caught(
    proved: Proved,
) -> None:
    def moved(columns: Columns) -> None:
        columns["design.P"][0] = next_up(columns["design.P"][0])

    def asked(columns: Columns) -> None:
        columns["position.P"][-1] = next_up(columns["position.P"][-1])

    def of(changes: dict[str, Change]) -> list[str]:
        return failed(gaitswarm.verify(tampered(proved.content, changes), replay=0))

    assert of(changed("best.json", {"iteration": 0, "particle": 0})) == ["best"]
    assert of(changed("best.json", {"design": {"P": 0.0, "I": 0.0}})) == ["best"]
    assert of({EVALUATIONS: with_cells(moved)}) == ["designs", "chain"]
    assert of({ASKS: with_cells(asked)}) == ["designs", "search", "chain"]
    assert of(changed("spec.json", {"seed": 6})) == ["search", "chain"]
    assert of({"robots/0/robot.urdf": lambda urdf: urdf + b" "}) == ["robot"]


def test_other_code_is_reported_and_equal_bits_verify_all_the_same(
    proved: Proved, monkeypatch: pytest.MonkeyPatch
) -> None:
    def other(spec: AnySpec) -> JobProvenance:
        here = job_provenance(spec)
        code = here.simulation.model_copy(update={"code_digest": "0" * 32})
        return here.model_copy(update={"simulation": code})

    monkeypatch.setattr("gaitswarm.evidence.verify.job_provenance", other)
    found = gaitswarm.verify(proved.content, replay=2, seed=1)
    assert found.verified
    assert found.provenance == ["from iteration 0 on: changed simulation code"]


def test_a_search_in_single_precision_is_verified_with_its_best_in_double(tmp_path: Path) -> None:
    run = gaitswarm.optimize(db=tmp_path / "jobs.db", precision="single", **JOB)
    with gaitswarm.open(tmp_path / "jobs.db") as jobs:
        content = jobs.evidence(run.job.id)
    assert gaitswarm.verify(content, replay=3).verified

    def better(columns: Columns) -> None:
        columns["short.height_loss"][-1] = next_up(columns["short.height_loss"][-1])

    content = tampered(content, {"history/reevaluations.parquet": with_cells(better)})
    assert failed(gaitswarm.verify(content, replay=0)) == ["best", "chain"]
    assert failed(gaitswarm.verify(content, replay=1)) == ["best", "chain", "replay"]


@pytest.mark.thorough("test_untouched_evidence_is_verified_in_all_it_says, of a fork")
def test_a_fork_that_was_judged_by_another_preference_is_verified_but_for_the_way_of_its_search(
    proved: Proved, tmp_path: Path
) -> None:
    import shutil

    db = Path(shutil.copy(proved.db, tmp_path / "jobs.db"))
    speed = {"bias": [0.0] * 5, "exponent": [0.0, 0.0, 0.0, 0.0, 1.0]}
    with gaitswarm.open(db) as jobs:
        fork = jobs.run(jobs.fork(proved.id, 2, preference=speed).id)
        assert fork.lineage is not None and fork.lineage.carried == "search"
        same = jobs.run(jobs.fork(proved.id, 2).id)
        found = [gaitswarm.verify(jobs.evidence(job.id), replay=4) for job in (fork, same)]
    assert [one.verified for one in found] == [True, True]
    (search,) = [check for check in found[0].checks if check.name == "search"]
    assert search.passed is None and "judged by another preference" in search.detail


@pytest.mark.thorough("test_untouched_evidence_is_verified_in_all_it_says")
def test_a_fuzzy_design_and_a_robot_of_ones_own_can_be_proved(tmp_path: Path) -> None:
    from tests.examples.paths import QUADRUPED

    own = {**JOB, "controller": "pi", "robot": QUADRUPED, "iterations": 1}
    crawl = json.loads((QUADRUPED / "crawl.json").read_text())
    published = dict(CONTROLLERS["fuzzy-pi"].published["A"])
    fuzzy = {**JOB, "controller": "fuzzy-pi", "iterations": 1, "start": [published]}
    for given in ({**own, "scenarios": [crawl]}, fuzzy):
        run = gaitswarm.optimize(db=tmp_path / "jobs.db", **given)
        with gaitswarm.open(tmp_path / "jobs.db") as jobs:
            content = jobs.evidence(run.job.id)
        assert gaitswarm.verify(content, replay=2).verified


def test_a_file_that_is_missing_and_a_negative_count_are_errors(tmp_path: Path) -> None:
    with pytest.raises(gaitswarm.NotFound):
        gaitswarm.verify(tmp_path / "none.zip")
    with pytest.raises(gaitswarm.InvalidRequest):
        gaitswarm.verify(b"", replay=-1)
    with pytest.raises(gaitswarm.InvalidRequest):
        gaitswarm.verify(b"", seed=-1)


def test_what_a_multi_objective_search_received_is_checked_too(tmp_path: Path) -> None:
    torque_alone = {"bias": [0.0] * 5, "exponent": [1.0, 0.0, 0.0, 0.0, 0.0]}
    optimizer = {"name": "hype", "particles": 4, "population": 4, "offspring": 4}
    given = {"optimizer": optimizer, "preference": torque_alone, "iterations": 6}
    job = {name: value for name, value in JOB.items() if name != "particles"} | given
    run = gaitswarm.optimize(db=tmp_path / "jobs.db", **job)
    with gaitswarm.open(tmp_path / "jobs.db") as jobs:
        content = jobs.evidence(run.job.id)
    assert gaitswarm.verify(content, replay=3).verified

    def change(columns: Columns) -> None:
        # The energy does not affect the fitness, but the search received it.
        for row in range(4):
            columns["short.energy"][row] = 1.0 / columns["short.energy"][row]

    found = gaitswarm.verify(tampered(content, {EVALUATIONS: with_cells(change)}), replay=0)
    assert failed(found) == ["search", "chain"]
