"""What can be asked of the service, in the words of its users."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any, Final

from services.optimizer.analysis.distribution import Distribution, distribution
from services.optimizer.analysis.history_cache import HistoryCache
from services.optimizer.analysis.identifiability import Identifiability, identifiability
from services.optimizer.analysis.ranking import Ranking, rank
from services.optimizer.errors import Conflict, InvalidRequest, NotFound, ProvenanceChanged
from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.estimate import Estimate, MeasuredRates, estimate
from services.optimizer.jobs.job import (
    Command,
    Evaluation,
    Iteration,
    Job,
    JobOrder,
    JobState,
    refusal,
)
from services.optimizer.jobs.preference import Preference
from services.optimizer.jobs.provenance import JobProvenance, job_provenance
from services.optimizer.jobs.spec import Spec
from services.optimizer.jobs.tuning import JobSpec
from services.optimizer.search.pso import PsoSettings
from services.optimizer.store.base import Page, Store
from sim.errors import SimulationInputError
from sim.identification.recorded_walk import RecordedWalk
from sim.robot import load_robot

_PIECE: Final = 16

_PIECE_ROWS: Final = 2000

_EARLIER: Final = 50
"""Newest jobs among which one like a new job is looked for."""


@dataclass(frozen=True, slots=True, eq=False)
class RankedJob:
    """A job's designs by another preference. columns: those that the ranking's rows refer to."""

    spec: JobSpec
    columns: EvaluationColumns
    ranking: Ranking


@dataclass(frozen=True, slots=True)
class JobService:
    """Jobs as their users see them. Thread-safe, as the store is.

    provenance: of what is computed from here for a spec.
    """

    store: Store
    provenance: Callable[[Spec], JobProvenance] = job_provenance
    _histories: HistoryCache = field(init=False, repr=False, compare=False)
    _rates: MeasuredRates = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_rates", MeasuredRates())
        object.__setattr__(self, "_histories", HistoryCache(self.store))

    def submit(
        self, spec: Spec, *, idempotency_key: str | None = None, request: Any = None
    ) -> tuple[Job, bool]:
        """Check that the job can be simulated and queue it.

        Its numbers are to depend on what they would depend on if they were computed here.

        Args:
            spec: What the job is to do.
            idempotency_key: A key by which a repeated request is recognized.
            request: The JSON document that asked for the job, as it was sent; None: the fields
                that were given to the spec.

        Returns:
            The job, and whether it is new.

        Raises:
            InvalidRequest: It cannot be simulated; names the field.
            IdempotencyConflict: The key was used before, for another job.
        """
        self._check(spec)
        return self.store.create_job(
            spec,
            provenance=self.provenance(spec),
            idempotency_key=idempotency_key,
            request=request,
        )

    def record(self, walk: RecordedWalk) -> str:
        """Keep a recorded walk, to which jobs can fit; its id."""
        return self.store.add_recording(walk)

    def recording(self, recording_id: str) -> RecordedWalk:
        """Raises NotFound."""
        return self.store.recordings([recording_id])[recording_id]

    def estimate(self, spec: Spec) -> Estimate:
        """What a job would cost, by the rate of jobs like it or a walk that is measured here.

        Raises InvalidRequest as `submit` does.
        """
        self._check(spec)
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        return estimate(spec, cases, self.store.jobs(limit=_EARLIER).items, self._rates)

    def job(self, job_id: str) -> Job:
        """Raises NotFound."""
        return self.store.job(job_id)

    def jobs(
        self,
        *,
        state: JobState | None = None,
        search: str = "",
        order: JobOrder = JobOrder.CREATED,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[Job]:
        """See `Store.jobs`."""
        return self.store.jobs(state=state, search=search, order=order, after=after, limit=limit)

    def command(self, job_id: str, command: Command, *, accept_changes: bool = False) -> Job:
        """Pause, resume or cancel. Raises NotFound, Conflict.

        Args:
            job_id: id of the job.
            command: what to do with it.
            accept_changes: for a job that is resumed, whether whoever takes it up may go on
                although what its numbers depend on has changed.

        Returns:
            The job as it is then.
        """
        return self.store.command(job_id, command, accept_changes=accept_changes)

    def check_unchanged(self, job: Job) -> None:
        """Raise ProvenanceChanged for a job whose next numbers, computed here, would not depend on
        what those that it has depend on.
        """
        refused = refusal(job, self.provenance(job.spec))
        if refused is not None:
            raise ProvenanceChanged(f"job {job.id} cannot go on: {refused}")

    def extend(self, job_id: str, iterations: int) -> Job:
        """Give a job another budget, of `iterations` in all. Raises NotFound, Conflict,
        InvalidRequest.
        """
        return self.store.extend(job_id, iterations)

    def iterations(
        self, job_id: str, *, after: int | None = None, limit: int = 100
    ) -> Page[Iteration]:
        """Committed iterations with index > after."""
        return self.store.iterations(job_id, after=after, limit=limit)

    def evaluations(self, job_id: str, iteration: int) -> tuple[Evaluation, ...]:
        """Every particle of a committed iteration."""
        return self.store.evaluations(job_id, iteration)

    def best(self, job_id: str) -> Evaluation | None:
        """The best design so far."""
        return self.store.best(job_id)

    def history(
        self, job_id: str, *, after: int | None = None
    ) -> Iterator[tuple[Iteration, tuple[Evaluation, ...]]]:
        """Every committed iteration with index > after, with its particles, in order.

        Read by pieces as it is consumed: however long it takes, no transaction stays open, and a
        job that runs meanwhile is followed to its end. Raises NotFound at the first item.
        """
        while True:
            page = self.store.iterations(job_id, after=after, limit=_PIECE)
            if page.items:
                first, last = page.items[0].index, page.items[-1].index
                found = self.store.evaluations_between(job_id, first, last + 1)
                by_iteration = {k: tuple(g) for k, g in groupby(found, key=_iteration_of)}
                for iteration in page.items:
                    yield iteration, by_iteration.get(iteration.index, ())
                after = last
            if page.next is None:
                return

    def columns(self, job: Job) -> EvaluationColumns:
        """Every committed evaluation. Raises Conflict for a job too large to be held in memory."""
        return self._histories.columns(job)

    def column_pieces(self, job: Job, *, rows: int = _PIECE_ROWS) -> Iterator[EvaluationColumns]:
        """As `columns`, piece by piece as they are consumed: for histories of any length.

        Args:
            job: As it was read; iterations committed later are left out.
            rows: Evaluations in a piece at most, but one iteration at least.

        Yields:
            Whole iterations, in order.
        """
        step = max(1, rows // job.spec.optimizer.particles)
        for first in range(0, job.progress.iterations, step):
            last = min(first + step, job.progress.iterations)
            piece = self.store.evaluation_columns(job.id, first, last)
            if piece is not None:
                yield piece

    def distribution(
        self, job: Job, *, after: int | None = None, limit: int
    ) -> tuple[Distribution, bool]:
        """Spread of the swarm in up to `limit` iterations with index > after; whether more follow.

        Raises as `columns`.
        """
        particles = job.spec.optimizer.particles
        columns = self.columns(job).after(after)
        page = columns.rows(slice(limit * particles))
        spread = distribution(page, job.spec.design_space(), particles)
        return spread, len(page) < len(columns)

    def rank(self, job: Job, preference: Preference, *, top: int) -> RankedJob:
        """All designs judged by another preference, from what is stored.

        Raises InvalidRequest for a job that has no preference, and as `columns`.
        """
        if not isinstance(job.spec, JobSpec):
            raise InvalidRequest(
                f"job {job.id} fits parameters to recorded walks; only the designs of a job that"
                " tunes a drive are judged by a preference",
                field="preference",
            )
        columns = self.columns(job)
        return RankedJob(job.spec, columns, rank(columns, preference, top=top))

    def identifiability(self, jobs: Sequence[Job]) -> Identifiability:
        """Which parameters jobs that differ in seed and budget alone agree on.

        Raises InvalidRequest for jobs of different problems, Conflict while one of them has no
        design that did not fail, and as `columns`.
        """
        first, *others = jobs
        seeds = {first.spec.seed: first.id}
        for other in others:
            if other.spec.seed in seeds:
                raise InvalidRequest(
                    f"job {other.id} has the seed of job {seeds[other.spec.seed]}, so that they"
                    " agree whatever the walks say; compare runs of different seeds",
                    field="also",
                )
            seeds[other.spec.seed] = other.id
            if _problem(other.spec) != _problem(first.spec):
                raise InvalidRequest(
                    f"job {other.id} is of another problem than job {first.id}; runs that are"
                    " compared differ in name, seed, optimizer and iterations alone",
                    field="also",
                )
        for job in jobs:
            if job.progress.best_fitness is None:
                raise Conflict(
                    f"job {job.id} has no design yet that did not fail; ask again after its next"
                    " iteration, or leave it out"
                )
        runs = [self.columns(job) for job in jobs]
        return identifiability(first.spec.design_space().variables, runs)

    def _check(self, spec: Spec) -> None:
        """Raise InvalidRequest for a job that cannot be run."""
        spec.check_can_be_simulated()
        self._check_recordings(spec)

    def _check_recordings(self, spec: Spec) -> None:
        """Each is there, of the robot's joints, and of a gait within the legs' reach."""
        joints = load_robot(spec.robot).joint_names
        for index, name in enumerate(spec.recording_ids):
            field = f"recordings.{index}"
            try:
                walk = self.recording(name)
                if walk.joints != joints:
                    raise InvalidRequest("recorded on other joints than the robot's", field=field)
                walk.check_reach(spec.robot)
            except (NotFound, SimulationInputError) as error:
                raise InvalidRequest(str(error), field=field) from error


def _problem(spec: Spec) -> Spec:
    """The spec without what may differ between runs of one problem."""
    return spec.model_copy(
        update={"name": "", "seed": 0, "iterations": 1, "optimizer": PsoSettings()}
    )


def _iteration_of(evaluation: Evaluation) -> int:
    return evaluation.iteration
