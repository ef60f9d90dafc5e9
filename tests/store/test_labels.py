"""Labels of jobs, and filters by them."""

from __future__ import annotations

import pytest

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.job import Command, Job, JobOrder
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.labels import JobFilter, LabelsChange, robot_name
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.robot.variant import RobotFiles
from tests.examples.walks import quadruped_files
from tests.store.examples import Clock


def submitted(store: Store, **changes: object) -> Job:
    return store.create_job(JobSpec.model_validate({"iterations": 2} | changes))[0]


def ids(store: Store, **asked: object) -> list[str]:
    return [job.id for job in store.jobs(**asked).items]  # type: ignore[arg-type]


def test_a_job_is_labelled_bit_by_bit_and_its_spec_stays(store: Store) -> None:
    job = submitted(store, name="first")
    labelled = store.label(job.id, LabelsChange(name="better", tags=("b", "a", "b")))
    assert (labelled.name, labelled.labels.tags, labelled.archived) == ("better", ("b", "a"), False)
    labelled = store.label(job.id, LabelsChange(note="why\nnot", archived=True))
    assert (labelled.name, labelled.labels.note, labelled.archived) == ("better", "why\nnot", True)
    assert store.job(job.id) == labelled
    assert labelled.spec == job.spec
    assert store.label(job.id, LabelsChange(name=" ")).name == "first"
    assert [entry.action for entry in store.audit().items] == ["label"] * 3 + ["submit"]
    with pytest.raises(NotFound):
        store.label("nowhere", LabelsChange(note="x"))


def test_what_is_written_is_searched_and_sorted_by(store: Store, clock: Clock) -> None:
    jobs = [submitted(store, name=name) for name in ("alpha", "beta", "gamma")]
    store.label(jobs[0].id, LabelsChange(name="Zeta"))
    store.label(jobs[1].id, LabelsChange(note="see GAMMA"))
    store.label(jobs[2].id, LabelsChange(tags=("thesis",)))
    assert ids(store, search="zeta") == [jobs[0].id]
    assert ids(store, search="alpha") == []
    assert set(ids(store, search="gamma")) == {jobs[1].id, jobs[2].id}
    assert ids(store, search="thesis") == [jobs[2].id]
    assert ids(store, order=JobOrder.NAME) == [jobs[k].id for k in (1, 2, 0)]


def test_jobs_are_found_by_what_they_are(store: Store) -> None:
    plain = submitted(store)
    other = submitted(store, controller="pi", preference="B", robot="szabadka2")
    own = submitted(store, preference={"bias": [0.1] * 5, "exponent": [1.0] * 5})
    store.label(own.id, LabelsChange(tags=("mine",), archived=True))
    for where, wanted in (
        (JobFilter(controller="pi"), [other]),
        (JobFilter(preference="B"), [other]),
        (JobFilter(preference="own"), [own]),
        (JobFilter(robot="szabadka2"), [other]),
        (JobFilter(robot="szabadka2", preference="A"), []),
        (JobFilter(tag="mine"), [own]),
        (JobFilter(archived=True), [own]),
        (JobFilter(archived=False), [other, plain]),
        (JobFilter(archived=False, tag="mine"), []),
    ):
        assert set(ids(store, where=where)) == {job.id for job in wanted}, where

    counts = store.facets()
    assert (counts.total, counts.states, counts.tags) == (3, {"queued": 3}, {"mine": 1})
    assert counts.controllers["pi"] == 1
    assert counts.preferences == {"A": 1, "B": 1, "own": 1}
    assert store.facets(archived=True).total == 1


def test_a_robot_of_ones_own_is_found_by_its_name_and_as_one_of_all(store: Store) -> None:
    files = quadruped_files()
    shipped = submitted(store, robot="szabadka2")
    dog = submitted(store, robot=files)
    toml = files.toml.replace('name = "quadruped"', 'name = "szabadka2"', 1)
    named_as_shipped = submitted(store, robot=files.model_copy(update={"toml": toml}))
    for where, wanted in (
        (JobFilter(robot="quadruped"), [dog]),
        (JobFilter(robot="own"), [dog, named_as_shipped]),
        (JobFilter(robot="szabadka2"), [shipped]),
    ):
        assert set(ids(store, where=where)) == {job.id for job in wanted}, where
    assert store.facets().robots == {"szabadka2": 1, "quadruped": 1, "own": 1}


@pytest.mark.parametrize("name", ["name = ", "name = 3", "x = 1", 'name = ""', "x = " + "[" * 5000])
def test_a_robot_without_a_name_is_called_own(name: str) -> None:
    assert robot_name(RobotFiles.model_construct(toml=name, urdf="")) == "own"


def test_every_job_is_reached_page_by_page_in_every_order(store: Store) -> None:
    jobs = [submitted(store, name=f"job {k % 3}") for k in range(7)]
    store.command(jobs[3].id, Command.CANCEL)
    store.label(jobs[5].id, LabelsChange(archived=True))
    for order in JobOrder:
        where, found, after = JobFilter(archived=False), [], None
        while True:
            page = store.jobs(where=where, order=order, after=after, limit=2)
            found += [job.id for job in page.items]
            after = page.next
            if after is None:
                break
        assert sorted(found) == sorted(job.id for job in jobs if job is not jobs[5]), order
        if order is JobOrder.STATE:
            assert found[-1] == jobs[3].id
