"""Certificates whose nominal world walks in other engines, too."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import gaitswarm
from gaitswarm.services.optimizer.analysis.certificate import certificate
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from gaitswarm.sim.outcome import Status
from tests.certificate.examples import DOCUMENT, columns, small
from tests.examples.commands import run_command
from tests.examples.jobs import history
from tests.examples.processes import python
from tests.examples.walks import SHORT_WALK

ENGINES = ["mujoco", "mujoco-contacts"]
PRODUCT = {"bias": [0.0] * 5, "exponent": [0.2] * 5}
"""By which a walk whose objectives are all x is worth x."""


def asked(spec: CertificateSpec) -> list[dict[str, float | str]]:
    """All that it evaluates, in order, as people read it."""
    search, space, found = spec.create_search(), spec.design_space(), []
    while search.evaluations < spec.budget:
        positions = search.ask(spec.budget - search.evaluations)
        found += [space.shown(design) for design in space.designs(positions).tolist()]
        search.tell(np.ones(len(positions)))
    return found


def test_the_nominal_world_is_asked_for_once_in_each_engine_before_the_others() -> None:
    spec, plain = small(engines=ENGINES), small()
    rows = asked(spec)
    assert [row.pop("engine") for row in rows] == ["gaitswarm", *ENGINES, *["gaitswarm"] * 10]
    assert rows[0] == rows[1] == rows[2]
    assert rows[2:] == asked(plain)
    assert spec.world(3) == plain.world(3) and "engine" not in spec.world(3)


def test_iterations_follow_from_worlds_and_engines() -> None:
    assert [small(worlds=10, engines=ENGINES[:n]).iterations for n in (0, 1, 2)] == [3, 3, 4]
    spec = small(worlds=10, engines=ENGINES)
    assert (spec.budget, spec.with_budget(5).worlds) == (13, 17)
    by_iterations = {**DOCUMENT, "engines": ENGINES, "iterations": 5}
    del by_iterations["worlds"]
    assert SPECS.validate_python(by_iterations).budget == 20


def test_a_certificate_is_stored_with_its_engines() -> None:
    spec = small(engines=["mujoco"]).resolved()
    assert SPECS.validate_json(spec.model_dump_json()) == spec
    assert list(spec.world_space().names) == DOCUMENT["variables"]
    assert list(spec.design_space().names) == [*DOCUMENT["variables"], "engine"]
    before = json.loads(small().resolved().model_dump_json())
    del before["engines"]
    assert SPECS.validate_python(before) == small().resolved()


@pytest.mark.parametrize(
    ("engines", "words"),
    [(["ode"], "'mujoco' or 'mujoco-contacts'"), (["mujoco"] * 2, "'mujoco' is named twice")],
)
def test_invalid_engines_are_refused(engines: list[str], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        small(engines=engines)


def test_the_version_of_the_library_is_part_of_the_provenance() -> None:
    with_engine, without = (job_provenance(small(engines=e)).simulation for e in (["mujoco"], []))
    assert with_engine.libraries.keys() - without.libraries.keys() == {"mujoco-core"}
    other = {"libraries": with_engine.libraries | {"mujoco-core": "3.0"}}
    changed = with_engine.model_copy(update=other).changes(with_engine)
    assert changed == (f"mujoco-core {with_engine.libraries['mujoco-core']} instead of 3.0",)


def test_differences_are_shares_of_ours_by_scenario_and_objective() -> None:
    spec = small(engines=ENGINES, preference=PRODUCT, worlds=2)
    made = columns(spec, np.arange(1.0, 11.0).reshape(5, 2))
    made.objectives[:3, 0] = np.array([10.0, 11.0, 8.0])[:, np.newaxis]
    made.objectives[:2, 0, 5] = -0.5, 0.25
    found = certificate("job", spec, made)
    assert list(found.engines) == ENGINES
    first, second = (engine.scenarios["short"] for engine in found.engines.values())
    assert (first.utility.ours, first.utility.theirs) == pytest.approx((10.0, 11.0))
    assert first.utility.difference == pytest.approx(0.1)
    assert second.objectives["energy"].difference == pytest.approx(-0.2)
    # The loss of height counts by its size.
    assert first.objectives["height_loss"].difference == pytest.approx(-0.5)
    # Of the other scenario 2, 4, 6: over both the geometric mean.
    assert found.engines[ENGINES[0]].fitness.difference == pytest.approx(math.sqrt(1.1 * 2.0) - 1.0)
    # Worlds and spreads are those of our engine alone.
    assert found.worlds == 2
    assert found.scenarios["uphill"].utility.nominal == pytest.approx(2.0)
    assert found.scenarios["uphill"].utility.worst == pytest.approx(10.0)
    assert [world.world for world in found.worst] == [1, 0]
    assert all("engine" not in world.values for world in found.worst)


def test_a_walk_that_fails_in_one_engine_has_no_difference() -> None:
    spec = small(engines=["mujoco"], preference=PRODUCT, worlds=2)
    statuses = np.zeros((4, 2))
    statuses[1, 0] = Status.FELL
    made = columns(spec, np.ones((4, 2)), statuses)
    found = certificate("job", spec, made)
    short, uphill = found.engines["mujoco"].scenarios.values()
    assert (short.ours, short.theirs) == ("ok", "fell")
    assert short.utility.ours == pytest.approx(1.0)
    assert (short.utility.theirs, short.utility.difference) == (None, None)
    assert uphill.utility.difference == pytest.approx(0.0)
    # It is no failure of the design in a world.
    assert found.failed.count == 0


@pytest.fixture(scope="module")
def evaluator() -> Iterator[Evaluator]:
    opened = open_evaluator("in-process", cpus=2)
    yield opened
    opened.close()


@pytest.mark.slow
def test_under_the_runner_our_rows_have_the_bits_of_a_certificate_without_engines(
    store: Store, evaluator: Evaluator
) -> None:
    service, rows, walked = JobService(store), [], []
    plain, spec = (small(engines=e, scenarios=[SHORT_WALK], worlds=3) for e in ([], ["mujoco"]))
    for asked_for in (plain, spec, spec):
        job, _ = service.submit(asked_for)
        ended = run_embedded(store, evaluator, job.id)
        assert ended.state is JobState.SUCCEEDED, ended.error
        rows.append([row[3:] for row in history(store, job.id)])
        walked.append(service.columns(ended))
    without, first, second = rows
    assert first == second
    assert [*first[:1], *first[2:]] == without
    assert first[1] != first[0]
    found = certificate("job", spec, walked[-1])
    objectives = found.engines["mujoco"].scenarios["short"].objectives
    objectives.pop("height_loss")
    assert max(abs(compared.difference or 0.0) for compared in objectives.values()) < 0.03


@pytest.mark.thorough("test_they_are_verified_with_the_job")
@pytest.mark.slow
def test_evidence_is_verified_without_the_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with gaitswarm.open(tmp_path / "jobs.db") as jobs:
        spec = small(engines=["mujoco"], scenarios=[SHORT_WALK], worlds=4)
        content = jobs.evidence(jobs.run(jobs.submit(spec).id).id)
    monkeypatch.setattr("gaitswarm.sim.mujoco.engines.find_spec", lambda name: None)
    found = gaitswarm.verify(content, replay=50)
    assert found.verified, found
    # The nominal world and the drawn ones; that of MuJoCo has its bits on one machine alone.
    assert found.replayed == 5


@pytest.fixture
def without_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a machine without the extra."""
    monkeypatch.setattr("gaitswarm.sim.mujoco.engines.find_spec", lambda name: None)


@pytest.mark.usefixtures("without_mujoco")
def test_without_the_library_the_error_names_the_extra_and_how_to_install_it(
    store: Store,
) -> None:
    words = "mujoco-core, not installed here: pip install 'gaitswarm[mujoco]'"
    with pytest.raises(InvalidRequest) as refused:
        JobService(store).submit(small(engines=["mujoco"]))
    assert refused.value.field == "engines"
    assert words in str(refused.value)
    JobService(store).submit(small())
    for command in (["certify", "published:A", "--engine", "mujoco"], ["mjcf"]):
        result = run_command(*command)
        assert (result.code, words in result.err) == (2, True), result.err


PROGRAM = """
import sys
from gaitswarm.services.optimizer.jobs.documents import SPECS
from tests.certificate.examples import DOCUMENT
import gaitswarm.cli.main, gaitswarm.services.optimizer.analysis.certificate, gaitswarm.sim.worlds
spec = SPECS.validate_python(DOCUMENT | {"engines": ["mujoco"]})
case = spec.cases({})[0]
designs = spec.design_space().designs(spec.create_search().ask())[:1]
assert case.run(designs).statuses.tolist() == [0]
print("mujoco" in sys.modules)
"""


@pytest.mark.thorough("test_without_the_library_the_error_names_the_extra_and_how_to_install_it")
@pytest.mark.slow
def test_mujoco_is_imported_for_its_own_walks_alone() -> None:
    done = python("-W", "ignore", "-c", PROGRAM)
    assert (done.returncode, done.stdout.strip()) == (0, "False"), done.stderr
