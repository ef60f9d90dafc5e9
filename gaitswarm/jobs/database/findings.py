"""What jobs of a database found, read from what is stored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gaitswarm.errors import NotFound
from gaitswarm.jobs.database.news import PAGE
from gaitswarm.jobs.findings import Findings
from gaitswarm.requests import arguments
from gaitswarm.requests.analysis import (
    run_certificate,
    run_importance,
    run_scenario_families,
)
from gaitswarm.requests.comparison import run_comparison
from gaitswarm.requests.identification import run_targets
from gaitswarm.services.optimizer.analysis.front import FRONT_DESIGNS, FrontView
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferenceForView,
    RobustPreferencesView,
)
from gaitswarm.services.optimizer.analysis.targets import LeaveOut
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.specs import PreferenceInput
from gaitswarm.tables import EvaluationTable, TableFormat, encoded_table
from gaitswarm.views import (
    BestView,
    HistoryIterationView,
    IterationView,
    RankingView,
)
from gaitswarm.views.analysis import ImportanceView, ScenarioFamiliesView
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.comparison import JobComparisonView
from gaitswarm.views.identification import IdentifiabilityView
from gaitswarm.views.verification import HistoryVerificationView


class DatabaseFindings(Findings):
    """Findings, read from the database."""

    _service: JobService

    def best(self, job_id: str) -> BestView:
        """Read the best design of a job."""
        job, best = self._service.job(job_id), self._service.best(job_id)
        if best is None:
            raise NotFound(
                f"job {job_id} has no design yet that walks in every scenario; ask again after its"
                " next iteration, or see why designs fail in its evaluations"
            )
        return BestView.from_evaluation(best, job.spec)

    def iterations(self, job_id: str, *, after: int | None = None) -> Iterator[IterationView]:
        """Read committed iterations by pages."""
        while True:
            page = self._service.iterations(job_id, after=after, limit=PAGE)
            yield from map(IterationView.from_iteration, page.items)
            if page.next is None or not page.items:
                return
            after = page.items[-1].index

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """Read committed iterations with their designs, by pieces."""
        spec = self._service.job(job_id).spec
        for iteration, evaluations in self._service.history(job_id):
            yield HistoryIterationView.from_iteration_and_evaluations(iteration, evaluations, spec)

    def evaluations(self, job_id: str) -> EvaluationTable:
        """Read every evaluation."""
        job = self._service.job(job_id)
        return EvaluationTable.from_pieces(job.spec, self._service.column_pieces(job))

    def ranking(self, job_id: str, preference: PreferenceInput, *, top: int = 20) -> RankingView:
        """Rank a job's designs from what is stored."""
        request = arguments.ranking(preference, top)
        job = self._service.job(job_id)
        ranked = self._service.rank(job, request.resolved_preference(), top=request.top)
        return RankingView.from_ranked_job(request, ranked)

    def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Judge a job's designs by fewer scenarios, from what is stored."""
        return run_scenario_families(self._service, job_id, tolerance)

    def importance(self, job_id: str) -> ImportanceView:
        """Estimate indices from what is stored."""
        return run_importance(self._service, job_id)

    def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Compare jobs from what is stored."""
        return run_comparison(self._service, arguments.runs(job_ids))

    def preferences(
        self,
        job_id: str,
        *,
        drawn: int = 512,
        candidates: int = 8,
        samples: int = 0,
        radius: float = 0.02,
        seed: int = 1,
        precision: Precision = "double",
    ) -> RobustPreferencesView:
        """Rank a job's designs under many preferences, from what is stored."""
        request = arguments.preferences(
            drawn=drawn,
            candidates=candidates,
            samples=samples,
            radius=radius,
            seed=seed,
            precision=precision,
        )
        from gaitswarm.requests.robustness import sampled_indices

        return self._service.preferences(job_id, request, sampled_indices)

    def front(self, job_id: str, *, most: int = FRONT_DESIGNS) -> FrontView:
        """Find a job's front from what is stored."""
        return self._service.front(job_id, most=most)

    def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find a design's preference from what is stored."""
        return self._service.preference_for(job_id, iteration, particle)

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Compare runs from what is stored."""
        jobs = [self._service.job(job_id) for job_id in arguments.runs(job_ids)]
        return IdentifiabilityView.from_identifiability(
            list(job_ids), self._service.identifiability(jobs)
        )

    def targets(self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None) -> TargetsView:
        """Compare runs with their targets, from what is stored."""
        return run_targets(self._service, arguments.runs(job_ids), arguments.leave_out(leave_out))

    def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Say what a certificate comes to, from what is stored."""
        arguments.certificate(worlds, most)
        return run_certificate(self._service, job_id, worlds=worlds, most=most)

    def export(self, job_id: str, file_format: TableFormat = "parquet") -> Iterator[bytes]:
        """Write every evaluation as a file, in parts as they are read."""
        chosen = arguments.table_format(file_format)
        job = self._service.job(job_id)
        return encoded_table(chosen, job.spec, self._service.column_pieces(job))

    def evidence(self, job_id: str) -> bytes:
        """Write evidence from what is stored."""
        from gaitswarm.evidence.contents import evidence

        return evidence(self._service, job_id)

    def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView:
        """Compute a job's chain again from what is stored, and walk here."""
        from gaitswarm.evidence.history import run_verification

        request = arguments.verification(replay, seed, head)
        return run_verification(self._service, job_id, request)
