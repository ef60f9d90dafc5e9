"""Questions about all that jobs have evaluated, answered from what is stored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.distribution import (
    Distribution,
    distribution,
    iteration_starts,
)
from gaitswarm.services.optimizer.analysis.fits.identifiability import (
    Identifiability,
    check_comparable,
    identifiability,
)
from gaitswarm.services.optimizer.analysis.history import PIECE, read_columns, read_history
from gaitswarm.services.optimizer.analysis.history_cache import HistoryCache
from gaitswarm.services.optimizer.analysis.ranking import RankedJob, rank, tuning_of
from gaitswarm.services.optimizer.analysis.reference import with_reference
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration, Reevaluation
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.services.optimizer.store.port.base import Store


@dataclass(frozen=True, slots=True)
class Questions:
    """Histories of jobs as a whole. Thread-safe, as the store is.

    Attributes:
        store: where jobs are kept.
    """

    store: Store
    _histories: HistoryCache = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_histories", HistoryCache(self.store))

    def columns(self, job: Job) -> EvaluationColumns:
        """Read every committed evaluation at once."""
        return self._histories.columns(job)

    def column_pieces(self, job: Job, *, rows: int = PIECE) -> Iterator[EvaluationColumns]:
        """As `columns`, piece by piece as they are consumed: for histories of any length."""
        return read_columns(self.store, job, rows=rows)

    def history(
        self, job_id: str, *, after: int | None = None
    ) -> Iterator[tuple[Iteration, tuple[Evaluation, ...]]]:
        """Read every committed iteration with its particles.

        Read by pieces as it is consumed: however long it takes, no transaction stays open, and
        what is committed meanwhile comes too.
        """
        return read_history(self.store, job_id, after=after)

    def reference(self, job_id: str) -> tuple[Job, str | None]:
        """Compare a job's best with the published design, which walks where that is not known."""
        return with_reference(self.store, self.store.job(job_id))

    def asked(self, job: Job, iterations: int | None = None) -> tuple[NDArray[np.float64], ...]:
        """Read what the search asked for.

        Returns:
            (n, d) positions of each iteration, in the variables' units.
        """
        end = job.progress.iterations if iterations is None else iterations
        return self.store.asked(job.id, 0, end)

    def reevaluations(self, job: Job) -> tuple[tuple[int, Reevaluation], ...]:
        """Read what designs came to that were evaluated anew in double precision."""
        return self.store.reevaluations(job.id)

    def distribution(
        self, job: Job, *, after: int | None = None, limit: int
    ) -> tuple[Distribution, bool]:
        """Say how designs are spread, iteration by iteration."""
        columns = self.columns(job).after(after)
        following = iteration_starts(columns)[limit:]
        page = columns.rows(slice(int(following[0]) if len(following) else None))
        return distribution(page, job.spec.design_space()), len(following) > 0

    def rank(self, job: Job, preference: Preference, *, top: int) -> RankedJob:
        """Judge all designs by another preference, from what is stored."""
        spec, columns = tuning_of(job), self.columns(job)
        return RankedJob(spec, columns, rank(columns, preference, top=top, worlds=spec.worlds))

    def identifiability(self, jobs: Sequence[Job]) -> Identifiability:
        """Say which parameters several runs of one problem agree on."""
        check_comparable(jobs)
        runs = [self.columns(job) for job in jobs]
        spec = jobs[0].spec
        return identifiability(spec.design_space().variables, runs, spec.as_good_as)
