"""Jobs under another provenance: they continue only with consent"""

from __future__ import annotations

import inspect
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.services.optimizer.errors import ProvenanceChanged
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.calibration import (
    CalibrationSpec,
    IdentificationSpec,
    root_mean_square,
)
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.services.optimizer.jobs.provenance import (
    JobProvenance,
    job_provenance,
    optimizer_files,
)
from gaitswarm.services.optimizer.jobs.spec import EarlierJobs, Spec, optimizer_settings
from gaitswarm.services.optimizer.run.coordinator import (
    Begin,
    Claimed,
    Coordination,
    Evaluate,
    Record,
    Release,
    handle,
)
from gaitswarm.services.optimizer.run.execution import OnCommit, RunContext, run_claim
from gaitswarm.services.optimizer.search.registry import create_search
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.errors import RobotFileError
from tests.optimizer.formula import HERE, SPEC, FormulaEvaluator, job


def simulated(**fields: object) -> JobProvenance:
    return HERE.model_copy(update={"simulation": HERE.simulation.model_copy(update=fields)})


OTHER_CODE = simulated(code_digest="other")

CHANGES = [
    (OTHER_CODE, "changed simulation code"),
    (simulated(robot_digest="other"), "the robot szabadka2 has changed"),
    (simulated(robot="hexapod", robot_digest="x"), "the robot hexapod instead of szabadka2"),
    (simulated(backend="reference"), "no C compiler: backend reference instead of native"),
    (simulated(precision="single"), "precision single instead of double"),
    (simulated(libraries={"numpy": "2.1"}), "numpy 2.1 instead of 2.0"),
    (simulated(libraries={}), "numpy none instead of 2.0"),
    (
        HERE.model_copy(update={"optimizer_digest": "other"}),
        "other code of search and judgement",
    ),
    (HERE.model_copy(update={"search_libraries": {"cmaes": "0.13"}}), "cmaes 0.13 instead of none"),
]


def run(
    store: Store, provenance: JobProvenance, on_commit: OnCommit | None = None, **given: Any
) -> Job:
    claim = store.claim("runner", lease_seconds=30.0)
    assert claim is not None
    around = RunContext(
        store, FormulaEvaluator(), on_commit=on_commit, provenance=lambda _: provenance, **given
    )
    return run_claim(claim, around)


def paused(store: Store, provenance: JobProvenance | None = HERE) -> Job:
    """A job of two committed iterations."""
    made, _ = store.create_job(SPEC, provenance=provenance)

    def pause(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 0:
            store.command(made.id, Command.PAUSE)

    found = run(store, HERE, pause)
    assert (found.state, found.progress.iterations) == (JobState.PAUSED, 2)
    return found


def recorded(store: Store, job_id: str) -> list[tuple[int, JobProvenance]]:
    return [(r.from_iteration, r.provenance) for r in store.job(job_id).provenance]


@pytest.mark.parametrize(("now", "said"), CHANGES)
def test_a_change_is_described(now: JobProvenance, said: str) -> None:
    assert HERE.changes(now) == (said,)
    assert HERE.changes(HERE) == ()


def test_a_job_does_not_continue_with_another_provenance_and_says_how_it_would(
    store: Store,
) -> None:
    job_id = paused(store).id
    store.command(job_id, Command.RESUME)
    refused = run(store, OTHER_CODE)
    assert (refused.state, refused.progress.iterations) == (JobState.FAILED, 2)
    assert refused.error is not None and "changed simulation code" in refused.error
    assert f"gaitswarm resume {job_id} --accept-changes" in refused.error
    assert recorded(store, job_id) == [(0, HERE)]
    store.command(job_id, Command.RESUME)
    assert run(store, HERE).state is JobState.SUCCEEDED
    assert recorded(store, job_id) == [(0, HERE)]


def test_another_version_of_the_same_code_is_no_change(store: Store) -> None:
    newer = HERE.model_copy(update={"gaitswarm": "2.0"})
    job_id = paused(store).id
    store.command(job_id, Command.RESUME)
    assert run(store, newer).state is JobState.SUCCEEDED
    assert "gaitswarm 2.0 instead of 1.0" in HERE.changes(
        newer.model_copy(update={"optimizer_digest": "other"})
    )


def test_changes_that_are_accepted_are_recorded_since_their_iteration_and_accepted_once(
    store: Store,
) -> None:
    job_id = paused(store).id
    store.command(job_id, Command.RESUME, accept_changes=True)

    def crash(done: CompletedIteration, state: JobState) -> None:
        raise InterruptedError

    with suppress(InterruptedError):
        run(store, OTHER_CODE, crash)
    assert recorded(store, job_id) == [(0, HERE), (2, OTHER_CODE)]
    assert store.job(job_id).progress.iterations == 3
    # The consent was to that change: going back is another one.
    refused = run(store, HERE)
    assert (refused.state, refused.progress.iterations) == (JobState.FAILED, 3)
    store.command(job_id, Command.RESUME)
    assert run(store, OTHER_CODE).state is JobState.SUCCEEDED
    assert recorded(store, job_id) == [(0, HERE), (2, OTHER_CODE)]


def test_unneeded_consent_is_not_stored(store: Store) -> None:
    job_id = paused(store).id
    store.command(job_id, Command.RESUME, accept_changes=True)

    def pause(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 2:
            store.command(job_id, Command.PAUSE)

    assert run(store, HERE, pause).state is JobState.PAUSED
    store.command(job_id, Command.RESUME)
    assert run(store, OTHER_CODE).state is JobState.FAILED


def test_consent_is_withdrawn_by_resuming_without_it(store: Store) -> None:
    job_id = paused(store).id
    store.command(job_id, Command.RESUME, accept_changes=True)
    store.command(job_id, Command.PAUSE)
    store.command(job_id, Command.RESUME)
    assert run(store, OTHER_CODE).state is JobState.FAILED


def test_a_new_job_does_not_begin_with_another_provenance(store: Store) -> None:
    made, _ = store.create_job(SPEC, provenance=HERE)
    assert run(store, OTHER_CODE).state is JobState.FAILED
    assert store.job(made.id).progress.iterations == 0


def test_an_extended_job_does_not_continue_with_another_provenance(store: Store) -> None:
    made, _ = store.create_job(SPEC, provenance=HERE)
    run(store, HERE)
    store.extend(made.id, SPEC.iterations + 1)
    refused = run(store, OTHER_CODE)
    assert (refused.state, refused.progress.iterations) == (JobState.FAILED, SPEC.iterations)


def test_a_job_is_not_taken_over_by_a_runner_with_another_provenance(store: Store) -> None:
    made, _ = store.create_job(SPEC, provenance=HERE)
    assert store.claim("killed", lease_seconds=0.0) is not None
    assert run(store, OTHER_CODE).state is JobState.FAILED
    assert store.job(made.id).progress.iterations == 0


def test_a_submitted_job_has_the_provenance_of_the_process_that_submits_it(store: Store) -> None:
    submitted, _ = JobService(store).submit(SPEC)
    cloned, _ = JobService(store).submit(store.job(submitted.id).spec)
    for made in (submitted, cloned):
        assert recorded(store, made.id) == [(0, job_provenance(SPEC))]


def test_a_resume_can_be_checked_before_the_job_is_queued(store: Store) -> None:
    found = paused(store)
    JobService(store, provenance=lambda _: HERE).check_unchanged(found)
    with pytest.raises(ProvenanceChanged, match="changed simulation code"):
        JobService(store, provenance=lambda _: OTHER_CODE).check_unchanged(found)
    assert store.job(found.id).state is JobState.PAUSED


def test_a_job_whose_robot_cannot_be_read_fails_with_the_reason(store: Store) -> None:
    store.create_job(SPEC, provenance=HERE)

    def unreadable(_: Spec) -> JobProvenance:
        raise RobotFileError("robot.toml: motors: Field required")

    claim = store.claim("runner", lease_seconds=30.0)
    assert claim is not None
    failed = run_claim(claim, RunContext(store, FormulaEvaluator(), provenance=unreadable))
    assert failed.state is JobState.FAILED
    assert failed.error is not None and "robot.toml: motors: Field required" in failed.error


def test_a_worker_with_another_provenance_fails_the_job_with_its_reason(store: Store) -> None:
    store.create_job(SPEC, provenance=HERE)
    claim = store.claim("runner", lease_seconds=30.0)
    assert claim is not None
    unlike = ProvenanceChanged("a worker on node-7: no C compiler")
    around = RunContext(store, FormulaEvaluator([None, unlike]), provenance=lambda _: HERE)
    failed = run_claim(claim, around)
    assert (failed.state, failed.error) == (JobState.FAILED, str(unlike))
    assert failed.progress.iterations == 1


def test_requests_have_the_provenance_of_the_runner_that_claimed_the_job() -> None:
    going_on = Claimed(Claim(job(), "runner", 1, None), OTHER_CODE, accepts_changes=True)
    _, actions = handle(Coordination(), going_on)
    assert [type(action) for action in actions] == [Record, Begin, Evaluate]
    sent = actions[-1]
    assert isinstance(sent, Evaluate) and sent.request.provenance == OTHER_CODE.simulation


def test_a_refused_claim_sends_nothing() -> None:
    _, actions = handle(Coordination(), Claimed(Claim(job(), "runner", 1, None), OTHER_CODE))
    assert [type(action) for action in actions] == [Release]


def test_all_code_of_search_and_judgement_is_in_the_digest() -> None:
    kinds = (JobSpec, IdentificationSpec, CalibrationSpec, CertificateSpec)
    specs = (*kinds, Spec)
    used = (*specs, optimizer_settings, DesignSpace, Preference, root_mean_square, EarlierJobs)
    runs = (TuningWorlds,)
    files = {Path(inspect.getfile(thing)) for thing in (*used, *runs)}
    for room in (Path(inspect.getfile(thing)).parent for thing in (JobSpec, create_search)):
        files |= set(room.rglob("*.py"))
    assert files == set(optimizer_files())
