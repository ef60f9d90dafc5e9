"""The part of the port that is about what jobs have found."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.analysis.front import FrontView
    from gaitswarm.services.optimizer.analysis.preferences import (
        PreferenceForView,
        RobustPreferencesView,
    )
    from gaitswarm.services.optimizer.analysis.targets import LeaveOut
    from gaitswarm.sim.kernel.walk import Precision
    from gaitswarm.specs import PreferenceInput
    from gaitswarm.tables import EvaluationTable, TableFormat
    from gaitswarm.views import BestView, HistoryIterationView, IterationView, RankingView
    from gaitswarm.views.analysis import ImportanceView, ScenarioFamiliesView
    from gaitswarm.views.calibration import TargetsView
    from gaitswarm.views.certificate import CertificateView
    from gaitswarm.views.comparison import JobComparisonView
    from gaitswarm.views.identification import IdentifiabilityView
    from gaitswarm.views.verification import HistoryVerificationView


class Findings(ABC):
    """What jobs have committed, and what follows from it; nothing is changed."""

    @abstractmethod
    def best(self, job_id: str) -> BestView:
        """Take the best design that a job has found so far.

        Args:
            job_id: Identifier of the job.

        Returns:
            The design of least fitness, with its result in every case.

        Raises:
            NotFound: No design has walked in every scenario yet.
        """

    @abstractmethod
    def iterations(self, job_id: str, *, after: int | None = None) -> Iterator[IterationView]:
        """List the committed iterations of a job.

        Args:
            job_id: Identifier of the job.
            after: Only iterations with a greater index.

        Returns:
            Fitness of the designs, iteration by iteration, in order.
        """

    @abstractmethod
    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """List the committed iterations of a job with every design.

        Args:
            job_id: Identifier of the job.

        Returns:
            Iterations in order, each with its evaluations.
        """

    @abstractmethod
    def evaluations(self, job_id: str) -> EvaluationTable:
        """Take every evaluation of a job at once, as arrays.

        Args:
            job_id: Identifier of the job.

        Returns:
            One row an evaluation: design, fitness, and status, utility and objectives by case.
        """

    @abstractmethod
    def ranking(self, job_id: str, preference: PreferenceInput, *, top: int = 20) -> RankingView:
        """Judge all designs of a job by another preference; no walk is run.

        Args:
            job_id: Identifier of a job that tunes a drive.
            preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
                `Preference`.
            top: How many of the best designs to list, 1 to 1000.

        Returns:
            The best designs beside their places before, and how far the rankings agree.

        Raises:
            InvalidRequest: The job has no preference, or an argument makes no sense.
            Conflict: The job is too large to be held in memory.
        """

    @abstractmethod
    def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """See which scenarios of a job matter, from what is stored.

        Args:
            job_id: Identifier of a job that tunes a drive.
            tolerance: Largest regret of the smallest family of scenarios, as a share.

        Returns:
            What the job would have taken for its best without each scenario, and with few.

        Raises:
            InvalidRequest: The job tunes no drive, or the tolerance makes no sense.
            Conflict: No design of it walks in all scenarios, or it is too large to be held in
                memory.
        """

    @abstractmethod
    def importance(self, job_id: str) -> ImportanceView:
        """See which variables of a job matter, from what is stored.

        Args:
            job_id: Identifier of a job that tunes a drive or fits parameters.

        Returns:
            First-order Sobol' indices of every variable for the fitness, for each objective and for
            failing, with intervals; and whether the winner lies at a bound.

        Raises:
            InvalidRequest: The job is of another kind.
            Conflict: It has no design yet, or is too large to be held in memory.
        """

    @abstractmethod
    def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Set jobs beside each other, from what is stored.

        Args:
            job_ids: One at least, 12 at most, each once.

        Returns:
            How they converged by iterations, evaluations and time, how the fitness of their designs
            is distributed, and how their specs differ.

        Raises:
            InvalidRequest: There are none, too many, or one is named twice.
            Conflict: One of them is too large to be held in memory.
        """

    @abstractmethod
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
        """Find the preference whose winner among a job's designs is the most robust.

        The designs are ranked anew, from what is stored. The winners' robustness index is estimated
        on request, by walks where the jobs are; see `gaitswarm.robust_preferences` for walks here.

        Args:
            job_id: Identifier of a job that tunes a drive.
            drawn: Preferences to draw beside A, B and C (table 4.5), 1 to 100000.
            candidates: Winners to list: those of A, B and C, and of the others those that win under
                most preferences.
            samples: Designs that walk beside each of them; 0 for no walk and no index.
            radius: How far they are from it at most, as a share of each variable's bounds.
            seed: Of preferences and samples.
            precision: Of the walks' physics.

        Returns:
            The candidates, the most robust first; without walks those of most preferences first.

        Raises:
            InvalidRequest: The job tunes no drive, an argument makes no sense, or it takes more
                than the server allows.
            Conflict: No design of it walks in all scenarios, or it is too large to be held in
                memory.
        """

    @abstractmethod
    def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """See what designs of a job trade: its Pareto front over f1 to f5, from what is stored.

        Args:
            job_id: Identifier of a job that tunes a drive.
            most: Designs of the front to list, 1 to 10 000; of more, those with a mark and others
                that cover the front evenly.

        Returns:
            The front with its knees, extremes and winners, and its hypervolume over the iterations.

        Raises:
            InvalidRequest: The job tunes no drive, or the number makes no sense.
            Conflict: No design of it walks in all scenarios, or it is too large to be held in
                memory.
        """

    @abstractmethod
    def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find the preference under which a design wins its job, from what is stored.

        Args:
            job_id: Identifier of a job that tunes a drive.
            iteration: Iteration of the design, from 0.
            particle: Number of the design in its iteration, from 0.

        Returns:
            The best preference for each set of biases, with the design's place under it.

        Raises:
            InvalidRequest: The job tunes no drive, or a number makes no sense.
            NotFound: The job has no such design.
            Conflict: The design fails in a scenario, or the job is too large to be held in memory.
        """

    @abstractmethod
    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """See which parameters runs of one problem agree on, so that they can be trusted.

        Args:
            job_ids: Jobs that differ in name, seed, optimizer and iterations alone; at least one.

        Returns:
            Intervals of every variable among designs close to the best.

        Raises:
            InvalidRequest: The jobs are of different problems, or have one seed.
            Conflict: One of them has no design yet that did not fail.
        """

    @abstractmethod
    def targets(self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None) -> TargetsView:
        """See how near runs of a calibration come to their targets.

        Args:
            job_ids: Calibrations that differ in name, seed, optimizer and iterations alone; at
                least one.
            leave_out: "target" to predict every target by the design that is best without it,
                "walk" for without all targets of its walk; nothing is simulated.

        Returns:
            What the best design of all runs comes to, and what was left out.

        Raises:
            InvalidRequest: A job of another kind, jobs of different problems, or of one seed.
            Conflict: One of them has no design yet that did not fail.
        """

    @abstractmethod
    def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """See what a design comes to in many worlds.

        Args:
            job_id: Identifier of a certificate.
            worlds: Worlds to take, the first ones; None for all that have walked.
            most: Worst worlds to name, 0 to 1000.

        Returns:
            Chances of failure, spreads by scenario, the worst worlds, and what goes with them.

        Raises:
            InvalidRequest: The job is of another kind, or an argument makes no sense.
            Conflict: No drawn world has walked yet, or the job is too large to be held in memory.
        """

    @abstractmethod
    def export(self, job_id: str, file_format: TableFormat = "parquet") -> Iterator[bytes]:
        """Write every evaluation of a job as a file.

        Args:
            job_id: Identifier of the job.
            file_format: "parquet" or "csv".

        Returns:
            The file in parts, to be written one after the other.
        """

    @abstractmethod
    def evidence(self, job_id: str) -> bytes:
        """Write one file that proves a job's run, for `gaitswarm.verify`.

        Args:
            job_id: Identifier of the job.

        Returns:
            A zip archive, as docs/evidence.md has it: spec, robot, provenance, all evaluations,
            finished certificates of its designs, pictures and a page; the same bytes for the same
            stored jobs.

        Raises:
            Conflict: The job has committed no iteration yet, or is too large to be held in memory.
        """

    @abstractmethod
    def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView:
        """Check that what is stored of a job is what was committed.

        Args:
            job_id: Identifier of the job.
            replay: Evaluations to draw and simulate anew, besides the best one; 0 for no walk.
            seed: By which they are drawn; None for one that nobody can foresee.
            head: Digest of an iteration that was noted down earlier, as `JobView.head`, to be
                looked for.

        Returns:
            How far its iterations are those that their digests are of, and what differs first.

        Raises:
            InvalidRequest: An argument makes no sense, or the walks are more than a server allows.
            EvaluatorUnavailable: Walks cannot be run there.
        """
