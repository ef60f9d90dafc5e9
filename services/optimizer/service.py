"""The service: every operation on jobs, independent of transport"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.certificate import CertificateView, certificate
from gaitswarm.services.optimizer.analysis.comparison import (
    MOST_JOBS,
    POINTS,
    ConvergencesView,
    ConvergenceView,
    JobComparisonView,
    comparison,
    convergence,
)
from gaitswarm.services.optimizer.analysis.distribution import (
    DistributionView,
    distribution,
)
from gaitswarm.services.optimizer.analysis.failures import FailuresView, failures
from gaitswarm.services.optimizer.analysis.fork import (
    Parent,
    check_begun,
    forked,
    with_start_designs,
)
from gaitswarm.services.optimizer.analysis.front import (
    FRONT_DESIGNS,
    MOST_FRONT_DESIGNS,
    FrontView,
    pareto_front,
)
from gaitswarm.services.optimizer.analysis.history import (
    PIECE,
    HistoryCache,
    read_columns,
    read_history,
)
from gaitswarm.services.optimizer.analysis.identifiability import (
    IdentifiabilityView,
    check_comparable,
    identifiability,
)
from gaitswarm.services.optimizer.analysis.importance import ImportanceView, importance
from gaitswarm.services.optimizer.analysis.particles import encoded_particles
from gaitswarm.services.optimizer.analysis.preferences import (
    Index,
    PreferenceForView,
    PreferencesRequest,
    RobustPreferencesView,
    preference_for,
    robust_preferences,
)
from gaitswarm.services.optimizer.analysis.ranking import RankingRequest, RankingView, rank
from gaitswarm.services.optimizer.analysis.reference import (
    JobReferenceView,
    ReferenceView,
    with_reference,
)
from gaitswarm.services.optimizer.analysis.scenario_families import (
    TOLERANCE,
    ScenarioFamiliesView,
    scenario_families,
)
from gaitswarm.services.optimizer.analysis.targets import LeaveOut, TargetsView, target_results
from gaitswarm.services.optimizer.analysis.utilities import (
    log_utilities,
    objective_vectors,
    require_success,
    tuning_spec,
)
from gaitswarm.services.optimizer.errors import (
    Conflict,
    InvalidRequest,
    NotFound,
    ProvenanceChanged,
)
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.estimate import (
    Estimate,
    MeasuredRates,
    checked_length,
    estimate,
)
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, EvaluationColumns, Iteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, Quota, check_priority, refusal
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.run.embedded import EMBEDDED_LEASE_SECONDS
from gaitswarm.services.optimizer.run.runner import runner_name
from gaitswarm.sim.identification.recorded_walk import RecordedWalk

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

_PAGE: Final = 5000
"""Iterations read at a time."""

_RECENT_JOBS: Final = 50
"""Newest jobs among which the estimate looks for similar ones."""


class JobService:
    """Submit, control, read and analyze jobs. Thread-safe, as the store is.

    Args:
        store: closed by its owner.
        provenance: provenance of what this process computes for a spec.
        longest_job: limit on the simulated time of all of a job's simulations [s]; if finite, the
            simulations per iteration are limited as well.
        longest_fork: limit on the time to restore a search for a fork [s].
    """

    def __init__(
        self,
        store: Store,
        provenance: Callable[[Spec], JobProvenance] = job_provenance,
        longest_job: float = math.inf,
        longest_fork: float = math.inf,
    ) -> None:
        self.store = store
        self.provenance = provenance
        self.longest_job = longest_job
        self.longest_fork = longest_fork
        self._rates = MeasuredRates()
        self._histories = HistoryCache(store)

    def submit(
        self,
        spec: Spec,
        *,
        idempotency_key: str | None = None,
        request: Any = None,
        owner: str | None = None,
        notify_url: str | None = None,
        quota: Quota | None = None,
        priority: int = 0,
    ) -> tuple[Job, bool]:
        """Validate a job, check that it can be simulated, and queue it."""
        check_priority(priority)
        seconds = self._check(spec)
        if request is None:
            request = spec.model_dump(mode="json", exclude_unset=True)
        return self.store.create_job(
            with_start_designs(spec, self.job, self.columns),
            provenance=self.provenance(spec),
            idempotency_key=idempotency_key,
            request=request,
            owner=owner,
            notify_url=notify_url,
            seconds=seconds,
            quota=quota,
            priority=priority,
        )

    def fork(
        self,
        job_id: str,
        request: ForkRequest,
        *,
        idempotency_key: str | None = None,
        sent: Any = None,
        owner: str | None = None,
        notify_url: str | None = None,
        quota: Quota | None = None,
        priority: int = 0,
    ) -> tuple[Job, bool]:
        """Queue a job that begins with iterations of another one."""
        check_priority(priority)
        job = self.job(job_id)
        check_begun(job, request.from_iteration)
        columns = self.columns(job)
        rows = slice(int(np.searchsorted(columns.iteration, request.from_iteration)))
        (last,) = self.store.links(job_id, request.from_iteration - 1, request.from_iteration)
        parent = Parent(
            job,
            columns.rows(rows),
            lambda: self.asked_positions(job, request.from_iteration),
            last.digest,
        )
        spec, fork = forked(parent, request, self.provenance, longest=self.longest_fork)
        seconds = self._check(spec)
        if sent is None:
            sent = request.model_dump(mode="json", exclude_unset=True)
        return self.store.create_job(
            spec,
            provenance=self.provenance(spec),
            idempotency_key=idempotency_key,
            request={"fork": job_id, "request": sent},
            fork=fork,
            owner=owner,
            notify_url=notify_url,
            seconds=seconds,
            quota=quota,
            priority=priority,
        )

    def submit_embedded(self, spec: Spec) -> Claim:
        """Validate a job and store it claimed by this process."""
        self._check(spec)
        return self.store.create_claimed_job(
            with_start_designs(spec, self.job, self.columns),
            runner_name(),
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            provenance=self.provenance(spec),
        )

    def recording(self, recording_id: str) -> RecordedWalk:
        return self.store.recordings([recording_id])[recording_id]

    def estimate(self, spec: Spec) -> Estimate:
        """Estimate a job's cost from similar jobs or a measured simulation."""
        self._check(spec)
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        others = [job for job in self.store.jobs(limit=_RECENT_JOBS).items if job.readable]
        return estimate(
            with_start_designs(spec, self.job, self.columns), cases, others, self._rates
        )

    def job(self, job_id: str) -> Job:
        return self.store.job(job_id)

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
        """Change a job's budget."""
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
        if math.isinf(self.longest_job):
            return None
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        return checked_length(spec, cases, self.longest_job)

    def prioritize(self, job_id: str, priority: int, *, actor: str = LOCAL) -> Job:
        check_priority(priority)
        return self.store.prioritize(job_id, priority, actor=actor)

    def columns(self, job: Job) -> EvaluationColumns:
        """Return every committed evaluation."""
        return self._histories.columns(job)

    def column_pieces(self, job: Job, *, rows: int = PIECE) -> Iterator[EvaluationColumns]:
        """Yield the columns piece by piece, for histories of any length."""
        return read_columns(self.store, job, rows=rows)

    def history(
        self, job_id: str, *, after: int | None = None
    ) -> Iterator[tuple[Iteration, tuple[Evaluation, ...]]]:
        """Yield every committed iteration with its evaluations.

        Read piece by piece: no transaction stays open, and iterations committed meanwhile are
        included.
        """
        return read_history(self.store, job_id, after=after)

    def reference(self, job_id: str) -> JobReferenceView:
        """Compare a job's best design with its reference, which is simulated if needed."""
        job, reason = with_reference(self.store, self.job(job_id))
        return JobReferenceView(
            id=job.id,
            reference=ReferenceView.from_reference(job.reference),
            best_fitness=job.progress.best_fitness,
            gain=job.gain,
            reason=reason,
        )

    def asked_positions(
        self, job: Job, iterations: int | None = None
    ) -> tuple[NDArray[np.float64], ...]:
        """Return the (n, d) positions that the search asked for, by iteration."""
        end = job.progress.iterations if iterations is None else iterations
        return self.store.asked(job.id, 0, end)

    def distribution(
        self, job_id: str, *, after: int | None = None, limit: int
    ) -> DistributionView:
        """Return the spread of designs by iteration."""
        job = self.job(job_id)
        columns = self.columns(job).after(after)
        return distribution(columns, job.spec.design_space(), limit=limit)

    def particles(
        self, job_id: str, *, after: int | None = None, most: int, objectives: bool = False
    ) -> bytes:
        """Encode evaluations as columns: a `ParticlesHeaderView`, then float32 numbers."""
        job = self.job(job_id)
        columns = self.columns(job).after(after)
        return encoded_particles(job, columns, most=most, objectives=objectives)

    def scenarios(self, job_id: str, *, tolerance: float = TOLERANCE) -> ScenarioFamiliesView:
        """Judge a tuning job's designs by fewer scenarios."""
        if not 0.0 <= tolerance < math.inf:
            raise InvalidRequest("must be at least 0", field="tolerance")
        spec, columns = self._tuning(job_id, "scenarios")
        judged = log_utilities(columns, spec.resolved_preference())
        if spec.worlds is not None:
            judged = spec.worlds.aggregated(judged)
        require_success(job_id, judged)
        names = [scenario.name for scenario in spec.resolved_scenarios()]
        return scenario_families(columns, judged, names, tolerance=tolerance)

    def failures(self, job_id: str) -> FailuresView:
        """Count a job's failed designs by case and status."""
        job = self.job(job_id)
        return failures(self.columns(job), job.spec.case_names)

    def importance(self, job_id: str) -> ImportanceView:
        """Estimate which variables of a job matter."""
        job = self.job(job_id)
        if job.spec.kind == "certificate":
            raise InvalidRequest(
                f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive or fits"
                " parameters has variables that may matter",
                field="job_id",
            )
        columns = self.columns(job)
        if not len(columns):
            raise Conflict(f"job {job_id} has no design yet; try again after its first iteration")
        return importance(job.spec, columns, self.store.best(job_id))

    def front(self, job_id: str, *, most: int = FRONT_DESIGNS) -> FrontView:
        """Find the Pareto front of a tuning job over f1 to f5; `most` designs of it are listed."""
        if not 1 <= most <= MOST_FRONT_DESIGNS:
            raise InvalidRequest(f"must be 1 to {MOST_FRONT_DESIGNS}", field="most")
        spec, columns = self._tuning(job_id, "objectives to trade")
        vectors = objective_vectors(columns, worlds=spec.worlds)
        require_success(job_id, vectors)
        return pareto_front(columns, vectors, spec, most=most)

    def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find preferences under which a design wins its job."""
        for name, number in (("iteration", iteration), ("particle", particle)):
            if number < 0:
                raise InvalidRequest("must be at least 0", field=name)
        spec, columns = self._tuning(job_id, "objectives to trade")
        rows = np.flatnonzero((columns.iteration == iteration) & (columns.particle == particle))
        if not len(rows):
            raise NotFound(f"job {job_id} has no design {iteration}.{particle}")
        if not np.isfinite(objective_vectors(columns.rows(rows), worlds=spec.worlds)).all():
            raise Conflict(
                f"design {iteration}.{particle} fails in a scenario, so it wins under no preference"
            )
        return preference_for(columns, int(rows[0]), spec)

    def preferences(
        self, job_id: str, request: PreferencesRequest, index: Index
    ) -> RobustPreferencesView:
        """Find the preference whose winner among a job's designs is the most robust."""
        job = self.job(job_id)
        tuning_spec(job_id, job.spec, "a preference")
        return robust_preferences(job_id, job.spec, self.columns(job), request, index)

    def _tuning(self, job_id: str, has: str) -> tuple[JobSpec, EvaluationColumns]:
        job = self.job(job_id)
        return tuning_spec(job_id, job.spec, has), self.columns(job)

    def ranking(self, job_id: str, request: RankingRequest) -> RankingView:
        """Rank all designs of a tuning job by another preference, from stored objectives."""
        job = self.job(job_id)
        if not isinstance(job.spec, JobSpec):
            raise InvalidRequest(
                f"job {job_id} is of kind {job.spec.kind}; only tuning jobs are judged by a"
                " preference",
                field="preference",
            )
        return rank(self.columns(job), job.spec, request)

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Determine the parameters on which several runs of one problem agree."""
        jobs = [self.job(job_id) for job_id in job_ids]
        check_comparable(jobs)
        runs, spec = [self.columns(job) for job in jobs], jobs[0].spec
        return identifiability(job_ids, spec.design_space().variables, runs, spec.as_good_as)

    def targets(self, job_ids: Sequence[str], leave_out: LeaveOut | None = None) -> TargetsView:
        """Compare the best design of several runs of a calibration with their targets."""
        jobs = [self.job(job_id) for job_id in job_ids]
        spec = jobs[0].spec
        if not isinstance(spec, CalibrationSpec):
            raise InvalidRequest(
                f"job {jobs[0].id} is of kind {spec.kind}; only a calibration has targets",
                field="job_id",
            )
        check_comparable(jobs)
        bests = None
        if spec.precision != "double":
            bests = [best for job in jobs if (best := self.store.best(job.id)) is not None]
        runs = [self.columns(job) for job in jobs]
        return target_results(job_ids, spec, runs, leave_out, bests=bests)

    def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Summarize a certificate, from its first `worlds` worlds; list the `most` worst."""
        job = self.job(job_id)
        if not isinstance(job.spec, CertificateSpec):
            raise InvalidRequest(
                f"job {job_id} is of kind {job.spec.kind}; only a certificate has worlds",
                field="job_id",
            )
        return certificate(job_id, job.spec, self.columns(job), worlds=worlds, most=most)

    def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Compare jobs by convergence, distribution of fitness, and spec."""
        if len(set(job_ids)) < len(job_ids) or len(job_ids) > MOST_JOBS:
            raise InvalidRequest(f"must be at most {MOST_JOBS} jobs, each once", field="job_ids")
        jobs = [self.job(job_id) for job_id in job_ids]
        fitness = [
            self.columns(job).fitness if job.progress.iterations else np.empty(0) for job in jobs
        ]
        return comparison(jobs, fitness, [self._convergence(job.id, POINTS) for job in jobs])

    def convergences(self, job_ids: Sequence[str], points: int) -> ConvergencesView:
        """List the convergence of jobs that were not deleted, thinned to some points."""
        views = []
        for job_id in job_ids:
            with suppress(NotFound):
                views.append(self._convergence(job_id, points))
        return ConvergencesView(items=views)

    def _convergence(self, job_id: str, points: int) -> ConvergenceView:
        iterations: list[Iteration] = []
        after: int | None = None
        while True:
            page = self.store.iterations(job_id, after=after, limit=_PAGE)
            iterations += page.items
            if page.next is None or not page.items:
                return convergence(job_id, iterations, points)
            after = page.items[-1].index
