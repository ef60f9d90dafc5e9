"""The service: every operation on jobs, independent of transport"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, Unpack

import numpy as np

from gaitswarm.services.optimizer.analysis.bounds import ClosestView, closest
from gaitswarm.services.optimizer.analysis.fork import (
    Parent,
    check_begun,
    forked,
    with_start_designs,
)
from gaitswarm.services.optimizer.analysis.history import HistoryCache
from gaitswarm.services.optimizer.errors import ProvenanceChanged, within
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.documents import checked_spec
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import (
    DEFAULT_PRIORITY,
    Claim,
    Job,
    Quota,
    Submission,
    check_priority,
    refusal,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import other_measure
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.jobs.spec import Spec

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.jobs.estimate import MeasuredRates
    from gaitswarm.services.optimizer.jobs.time_left import EstimateView
    from gaitswarm.services.optimizer.store import Store
    from gaitswarm.sim.identification import RecordedWalk

S = TypeVar("S", bound=Spec)


@dataclass(eq=False)
class JobService:
    """Submit, control, read and analyze jobs. Thread-safe, as the store, which its owner closes.

    Limits are simulated time of all of a job's simulations, time to restore a search for a fork,
    and simulated time of the references of constraints [s].
    """

    store: Store
    provenance: Callable[[Spec], JobProvenance] = job_provenance
    longest_job: float = math.inf
    longest_fork: float = math.inf
    longest_reference: float = math.inf

    def __post_init__(self) -> None:
        self._histories = HistoryCache(self.store)

    def submit(
        self,
        spec: Spec,
        *,
        request: Any = None,
        **submission: Unpack[Submission],
    ) -> tuple[Job, bool]:
        """Validate a job, check that it can be simulated, and queue it."""
        check_priority(submission.get("priority", DEFAULT_PRIORITY))
        seconds = self._check(spec)
        if request is None:
            request = spec.model_dump(mode="json", exclude_unset=True)
        return self.store.create_job(
            self._resolved(spec),
            provenance=self.provenance(spec),
            request=request,
            seconds=seconds,
            **submission,
        )

    def fork(
        self,
        job_id: str,
        request: ForkRequest,
        *,
        sent: Any = None,
        **submission: Unpack[Submission],
    ) -> tuple[Job, bool]:
        """Queue a job that begins with iterations of another one."""
        check_priority(submission.get("priority", DEFAULT_PRIORITY))
        job = self.job(job_id)
        check_begun(job, request.from_iteration)
        columns = self.columns(job)
        rows = slice(int(np.searchsorted(columns.iteration, request.from_iteration)))
        (last,) = self.store.links(job_id, request.from_iteration - 1, request.from_iteration)
        parent = Parent(
            job,
            columns.rows(rows),
            lambda: tuple(
                link.positions for link in self.store.links(job_id, 0, request.from_iteration)
            ),
            last.digest,
        )
        spec, fork = forked(
            parent, request, self.provenance, self._referenced, longest=self.longest_fork
        )
        seconds = self._check(spec)
        if sent is None:
            sent = request.model_dump(mode="json", exclude_unset=True)
        return self.store.create_job(
            spec,
            provenance=self.provenance(spec),
            request={"fork": job_id, "request": sent},
            fork=fork,
            seconds=seconds,
            **submission,
        )

    def submit_embedded(self, spec: Spec) -> Claim:
        """Validate a job and store it claimed by this process."""
        # Slow to import.
        from gaitswarm.services.optimizer.run.runner import EMBEDDED_LEASE_SECONDS, runner_name

        self._check(spec)
        return self.store.create_claimed_job(
            self._resolved(spec),
            runner_name(),
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            provenance=self.provenance(spec),
        )

    def _resolved(self, spec: Spec) -> Spec:
        """Look up start designs and the references of constraints, once."""
        from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec

        if isinstance(spec, PreferencesSpec):
            with within("tuning"):
                spec = spec.model_copy(update={"tuning": self._resolved(spec.tuning)})
        started = with_start_designs(spec, self.job, self.columns)
        return self._referenced(started, starts=True)

    def _referenced(self, spec: S, *, starts: bool = False) -> S:
        from gaitswarm.services.optimizer.analysis.reference import with_references

        longest = self.longest_reference
        return with_references(spec, self.job, self.store.best, starts=starts, longest=longest)

    def recording(self, recording_id: str) -> RecordedWalk:
        return self.store.recordings([recording_id])[recording_id]

    @cached_property
    def _rates(self) -> MeasuredRates:
        from gaitswarm.services.optimizer.jobs.estimate import MeasuredRates

        return MeasuredRates()

    def estimate(self, spec: Spec) -> EstimateView:
        """Estimate a job's cost from a measured simulation."""
        from gaitswarm.services.optimizer.jobs.estimate import estimate

        self._check(spec)
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        return estimate(self._resolved(spec), cases, self._rates)

    def job(self, job_id: str) -> Job:
        return self.store.job(job_id)

    def under(self, spec: JobSpec, **measure: Any) -> JobSpec:
        """Return a job's spec with other fields by which it is judged; None keeps one."""
        changes = other_measure(measure)
        changed = checked_spec(spec, changes) if changes else spec
        assert isinstance(changed, JobSpec), "the kind does not change"  # noqa: S101
        return self._referenced(changed) if "constraints" in changes else changed

    def closest(self, job: Job) -> ClosestView | None:
        """Return the design of least violation; None without constraints or with a best design."""
        progress = job.progress
        if progress.least_violation is None or progress.best_fitness is not None:
            return None
        return closest(job.spec, self.store.closest(job.id), ended=job.state.terminal)

    def check_unchanged(self, job: Job) -> None:
        """Check that results computed here have the provenance of the job's earlier ones."""
        refused = refusal(job, self.provenance(job.spec))
        if refused is not None:
            raise ProvenanceChanged(f"job {job.id} cannot continue: {refused}")

    def extend(
        self,
        job_id: str,
        iterations: int,
        *,
        actor: str = LOCAL,
        quota: Quota | None = None,
    ) -> Job:
        job = self.job(job_id)
        extended = job.spec.with_budget(iterations) if job.readable else None
        seconds = None if extended is None else self._check_length(extended)
        return self.store.extend(job_id, iterations, actor=actor, seconds=seconds, quota=quota)

    def _check(self, spec: Spec) -> float | None:
        """Return the simulated time of all simulations [s]. Raises InvalidRequest."""
        spec.check_can_be_simulated()
        spec.check_recordings(self.recording)
        return self._check_length(spec)

    def _check_length(self, spec: Spec) -> float | None:
        """Return the simulated time of all simulations [s], None if unlimited."""
        from gaitswarm.services.optimizer.jobs.estimate import checked_length

        if math.isinf(self.longest_job):
            return None
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        return checked_length(spec, cases, self.longest_job)

    def columns(self, job: Job) -> EvaluationColumns:
        """Return every committed evaluation."""
        return self._histories.columns(job)
