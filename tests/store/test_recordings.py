"""Recordings: stored once, never changed, and passed to runners of jobs that need them."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.kinds.calibration import IdentificationSpec
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.identification import RecordedWalk
from gaitswarm.sim.robot import load_robot
from tests.examples.walks import PUBLISHED_A, SHORT_WALK
from tests.store.examples import Clock


def recording(**changes: object) -> RecordedWalk:
    rng = np.random.default_rng(1)
    document = {
        "scenario": SHORT_WALK,
        "controller": "fuzzy-pi",
        "design": PUBLISHED_A,
        "first_tick": 20,
        "joints": load_robot("szabadka2").joint_names,
        "current": rng.uniform(0.0, 0.3, (10, 18)).tolist(),
    }
    return RecordedWalk.model_validate(document | changes)


def spec(*recordings: str) -> IdentificationSpec:
    return IdentificationSpec(
        kind="identification", recordings=recordings, variables=("body_mass",), iterations=2
    )


def test_a_recording_comes_back_to_the_last_bit(store: Store) -> None:
    walk = recording()
    name = store.add_recording(walk)
    assert store.recordings([name])[name] == walk


def test_the_same_walk_is_the_same_recording_and_another_is_another(store: Store) -> None:
    first = store.add_recording(recording())
    assert store.add_recording(recording()) == first
    assert store.add_recording(recording(first_tick=21)) != first


def test_an_unknown_recording_is_not_found(store: Store) -> None:
    with pytest.raises(NotFound, match="there is no recording '0000"):
        store.recordings(["0" * 32])


def test_recordings_are_listed_by_pages_and_searched(store: Store, clock: Clock) -> None:
    walks = [recording(first_tick=20 + k) for k in range(3)]
    walks.append(recording(scenario=SHORT_WALK | {"name": "Slope_4"}, synthetic=True))
    ids = []
    for walk in walks:
        ids.append(store.add_recording(walk))
        clock.advance(1.0)
    page = store.recording_list(limit=3)
    assert [entry.id for entry in page.items] == ids[:0:-1]
    newest = page.items[0]
    assert (newest.scenario, newest.controller) == ("Slope_4", "fuzzy-pi")
    assert (newest.joints, newest.rows, newest.synthetic) == (18, 10, True)
    assert newest.size > 18 * 10 * len("0.1")
    # What is stored meanwhile shifts no page.
    store.add_recording(recording(first_tick=30))
    rest = store.recording_list(after=page.next, limit=3)
    assert ([entry.id for entry in rest.items], rest.next) == ([ids[0]], None)
    assert not rest.items[0].synthetic

    def found(text: str) -> set[str]:
        return {entry.id for entry in store.recording_list(search=text).items}

    assert found("SLOPE_") == found(ids[3][:12]) == {ids[3]}
    assert found("%") == found("e_w") == found("fuzzy-pi\0") == set()
    assert len(found("Fuzzy-PI")) == 5
    with pytest.raises(InvalidRequest, match="not a cursor") as refused:
        store.recording_list(after="yesterday")
    assert refused.value.field == "after"


def test_a_claim_brings_the_recordings_that_the_job_names(store: Store) -> None:
    wanted, other = store.add_recording(recording()), store.add_recording(recording(first_tick=21))
    store.create_job(spec(wanted))
    claim = store.claim("runner", lease_seconds=10.0)
    assert claim is not None
    assert dict(claim.recordings) == {wanted: recording()}
    assert other not in claim.recordings


def test_a_job_keeps_its_kind(store: Store) -> None:
    wanted = store.add_recording(recording())
    job, _ = store.create_job(spec(wanted))
    assert store.job(job.id).spec == spec(wanted).resolved()


def test_a_job_for_a_recording_that_is_missing_is_refused(store: Store) -> None:
    with pytest.raises(InvalidRequest, match="there is no recording") as refused:
        JobService(store).submit(spec("0" * 32))
    assert refused.value.field == "recordings.0"
    assert store.jobs().items == ()


def test_a_job_for_a_recording_of_other_joints_is_refused(store: Store) -> None:
    other = recording(joints=load_robot("szabadka2").joint_names[::-1])
    with pytest.raises(InvalidRequest, match="joints differ from the robot") as refused:
        JobService(store).submit(spec(store.add_recording(other)))
    assert refused.value.field == "recordings.0"
