"""Which jobs take part in the same tournament, and their runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from gaitswarm.services.optimizer.analysis.tournaments.tournament import Runs, runs_of
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec

NAME_PREFIX: Final = "tournament: "
"""What the names of jobs begin with that `gaitswarm tournament` submits; then comes the label."""

_TERMS: Final = {"problems", "evaluations", "checkpoints", "stops_at_target"}
"""Fields in which the jobs of a tournament are alike."""


@dataclass(frozen=True, slots=True)
class Entrant:
    """A method's part in a tournament.

    Attributes:
        label: What the method is called in it, which no other one is.
        job: Its job.
        spec: Of the job.
    """

    label: str
    job: Job
    spec: TournamentSpec


@dataclass(frozen=True, slots=True)
class Tournament:
    """Jobs whose runs can be compared.

    Attributes:
        entrants: At least one, in the order in which they were submitted.
    """

    entrants: tuple[Entrant, ...]

    @property
    def id(self) -> str:
        """That of its first job; any of its jobs stands for it."""
        return self.entrants[0].job.id

    @property
    def spec(self) -> TournamentSpec:
        """Of its first job: problems, budget and checkpoints are those of all."""
        return self.entrants[0].spec

    def results(self, columns: Callable[[Job], EvaluationColumns]) -> dict[str, dict[str, Runs]]:
        """Runs by problem, then by method."""
        found = {
            entrant.label: runs_of(entrant.spec, columns(entrant.job))
            for entrant in self.entrants
            if entrant.job.progress.evaluations
        }
        return by_problem(found)


def by_problem(found: Mapping[str, Mapping[str, Runs]]) -> dict[str, dict[str, Runs]]:
    """Turn runs by method, then by problem, into runs by problem, then by method."""
    turned: dict[str, dict[str, Runs]] = {}
    for label, of_method in found.items():
        for problem, runs in of_method.items():
            turned.setdefault(problem, {})[label] = runs
    return turned


def tournaments_of(jobs: Iterable[Job]) -> tuple[Tournament, ...]:
    """Put jobs together that can be compared.

    Runs are compared that were given the same problems, budget and checkpoints, and whose numbers
    depend on the same code, robots and precision.
    """
    groups: dict[str, list[tuple[Job, TournamentSpec]]] = {}
    for job in sorted(jobs, key=lambda job: (job.created_at, job.id)):
        spec = job.stored_spec
        if isinstance(spec, TournamentSpec) and job.state is not JobState.CANCELLED:
            groups.setdefault(_terms(job, spec), []).append((job, spec))
    return tuple(Tournament(_labelled(group)) for group in reversed(groups.values()))


def _terms(job: Job, spec: TournamentSpec) -> str:
    """Equal for jobs whose runs can be compared."""
    code = ""
    if job.provenance:
        last = job.provenance[-1].provenance
        code = last.model_dump_json(include={"optimizer_digest", "simulation"})
    return spec.model_dump_json(include=_TERMS) + code


def _labelled(group: list[tuple[Job, TournamentSpec]]) -> tuple[Entrant, ...]:
    """By the jobs' names, or else their methods'; by their ids, too, where these are alike."""
    labels = [
        job.spec.name.removeprefix(NAME_PREFIX).strip() or spec.method.name for job, spec in group
    ]
    return tuple(
        Entrant(label if labels.count(label) == 1 else f"{label} ({job.id})", job, spec)
        for label, (job, spec) in zip(labels, group, strict=True)
    )
