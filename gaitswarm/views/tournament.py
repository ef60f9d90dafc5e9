"""Tournaments between search methods: which there are, and what they come to."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime

from pydantic import Field

from gaitswarm.services.optimizer.analysis.interval import Interval
from gaitswarm.services.optimizer.analysis.tournaments.entrants import Entrant, Tournament
from gaitswarm.services.optimizer.analysis.tournaments.standings import Profile, Standing, Standings
from gaitswarm.services.optimizer.analysis.tournaments.tournament import Runs
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.race_case import SEED
from gaitswarm.views.base import View, finite


class EntrantView(View):
    """A method's part in a tournament: one job, whose designs are runs."""

    label: str = Field(
        description="What the method is called in this tournament: the job's name without"
        " `tournament: `, or the method; with the job's id where two are alike.",
        examples=["pso"],
    )
    method: str = Field(description="Search method, or rival of another library.", examples=["pso"])
    job: str = Field(description="Identifier of its job.", examples=["k2q7zr5dm9xw"])
    state: JobState = Field(description="State of its job.", examples=["succeeded"])
    runs: int = Field(description="Runs on every problem that have ended [1].", examples=[20])
    runs_planned: int = Field(description="Runs that its job is to have [1].", examples=[20])
    drawn: list[str] = Field(
        description="Settings that are drawn anew for every run; empty if all runs have the same.",
        examples=[["inertia_start"]],
    )

    @classmethod
    def from_entrant(cls, entrant: Entrant) -> EntrantView:
        """Make a view of a method's part."""
        spec, job = entrant.spec, entrant.job
        variables = spec.design_space().variables
        return cls(
            label=entrant.label,
            method=spec.method.name,
            job=job.id,
            state=job.state,
            runs=job.progress.evaluations,
            runs_planned=spec.budget,
            drawn=[variable.name for variable in variables if variable.name != SEED.name],
        )


class TournamentView(View):
    """A tournament: jobs of the kind `tournament` whose runs can be compared.

    They have the same problems, budget and checkpoints, and depend on the same code.
    """

    id: str = Field(
        description="Identifier of its first job; any other of its jobs stands for it, too.",
        examples=["k2q7zr5dm9xw"],
    )
    problems: list[str] = Field(
        description="Test functions, and names of jobs that tune a drive.", examples=[["D7C0R0I1"]]
    )
    evaluations: int = Field(description="Budget of each run [1].", examples=[625])
    entrants: list[EntrantView] = Field(description="Methods, in the order of their submission.")
    created_at: datetime = Field(description="When its first job was submitted, UTC.")

    @classmethod
    def from_tournament(cls, tournament: Tournament) -> TournamentView:
        """Make a view of a tournament.

        Args:
            tournament: with its jobs, as they were read.
        """
        return cls(
            id=tournament.id,
            problems=list(tournament.spec.case_names),
            evaluations=tournament.spec.evaluations,
            entrants=[EntrantView.from_entrant(entrant) for entrant in tournament.entrants],
            created_at=tournament.entrants[0].job.created_at,
        )


class TournamentsView(View):
    """All tournaments."""

    items: list[TournamentView] = Field(description="The tournaments, newest first.")


class ResampledView(View):
    """An estimate with the interval that holds 95 % of 500 resamples of the runs."""

    value: float | None = Field(
        description="Of all runs; null if it is infinite or undefined.", examples=[2.4]
    )
    low: float | None = Field(description="Quantile 0.025; null as above.", examples=[2.1])
    high: float | None = Field(description="Quantile 0.975; null as above.", examples=[2.9])

    @classmethod
    def from_interval(cls, interval: Interval) -> ResampledView:
        """Make a view of an estimate."""
        return cls(
            value=finite(interval.value), low=finite(interval.low), high=finite(interval.high)
        )


class CorrelationView(ResampledView):
    """Spearman's correlation of mean ranks with those of another tournament."""

    methods: list[str] = Field(
        description="Labels of the methods in both; with fewer than three there is no correlation.",
        examples=[["de", "pso", "random"]],
    )


class StandingView(View):
    """How a method did on a problem."""

    rank: float = Field(
        description="Among the methods, from 1, the best; equal ones share it [1].", examples=[2.0]
    )
    runs: int = Field(description="Runs that have ended [1].", examples=[20])
    solved: int = Field(description="Runs of them that reached the target [1].", examples=[17])
    expected_running_time: ResampledView = Field(
        description="Evaluations until the target is reached, if runs are repeated until one is"
        " successful (Hansen et al. 2021) [1]; null if none was."
    )
    median_best: dict[str, float | None] = Field(
        description="Median of the best fitness so far, by evaluations [1].",
        examples=[{"100": 11.14, "250": 10.77, "625": 10.63}],
    )
    least: float | None = Field(
        description="Least fitness of all runs [1]; null if all failed.", examples=[10.53]
    )

    @classmethod
    def from_standing(cls, standing: Standing, looked_at: tuple[int, ...]) -> StandingView:
        """Make a view of a standing."""
        medians = zip(looked_at, standing.medians, strict=True)
        return cls(
            rank=standing.rank,
            runs=standing.runs,
            solved=standing.solved,
            expected_running_time=ResampledView.from_interval(standing.running_time),
            median_best={str(count): finite(value) for count, value in medians},
            least=finite(standing.least),
        )


class ProblemStandingsView(View):
    """How the methods did on a problem."""

    target: float | None = Field(
        description="Fitness that counts as solved: that of the problem, or else 1 % above the"
        " least of all runs [1]; null if all failed.",
        examples=[0.001],
    )
    methods: dict[str, StandingView] = Field(description="By label, best first.")


class StandingsView(View):
    """What a tournament comes to."""

    mean_ranks: dict[str, ResampledView] = Field(
        description="Rank of every method, averaged over the problems, best first [1]."
    )
    problems: dict[str, ProblemStandingsView] = Field(description="By name.")
    rank_correlation: CorrelationView | None = Field(
        description="With the mean ranks of another tournament; null if none was named."
    )

    @classmethod
    def from_standings(cls, found: Standings) -> StandingsView:
        """Make a view of what a tournament comes to.

        Args:
            found: of its runs.
        """
        return cls.model_validate(_document(found))


class ProfileView(View):
    """Data profiles (Moré and Wild 2009): how many runs are solved within a budget."""

    precision: float = Field(
        description="tau: a run has solved its problem when it has come from the usual first value"
        " all but this share of the way to the least value of all runs [1].",
        examples=[0.001],
    )
    budgets: list[float] = Field(
        description="Evaluations over the number of variables plus one, ascending [1].",
        examples=[[1.0, 10.0, 100.0]],
    )
    shares: dict[str, list[float]] = Field(
        description="By label, the share of runs on all problems that are solved within each"
        " budget [1].",
        examples=[{"pso": [0.0, 0.2, 0.7]}],
    )

    @classmethod
    def from_profile(cls, profile: Profile) -> ProfileView:
        """Make a view of a profile."""
        return cls(
            precision=profile.precision,
            budgets=profile.budgets.tolist(),
            shares={label: shares.tolist() for label, shares in profile.shares.items()},
        )


class TournamentStandingsView(StandingsView):
    """What a tournament has come to so far, of all runs that have ended."""

    tournament: TournamentView = Field(description="Its problems and methods.")
    looked_at: list[int] = Field(
        description="Evaluations after which medians are told, the budget last [1].",
        examples=[[100, 250, 625]],
    )
    profiles: list[ProfileView] = Field(description="Data profiles, by precision.")

    @classmethod
    def from_tournament(
        cls, tournament: Tournament, found: Standings, profiles: tuple[Profile, ...]
    ) -> TournamentStandingsView:
        """Make a view of a tournament with what it comes to.

        Args:
            tournament: with its jobs, as they were read.
            found: of its runs.
            profiles: of its runs.
        """
        return cls.model_validate(
            {
                **_document(found),
                "tournament": TournamentView.from_tournament(tournament),
                "looked_at": list(found.looked_at),
                "profiles": [ProfileView.from_profile(profile) for profile in profiles],
            }
        )


class MethodRunsView(View):
    """Runs of a method on a problem."""

    lower: list[float | None] = Field(
        description="Lower quartile of the best fitness so far, by checkpoint [1]; null where so"
        " many runs have none."
    )
    median: list[float | None] = Field(description="Median of the same [1].")
    upper: list[float | None] = Field(description="Upper quartile of the same [1].")
    best: list[float | None] = Field(
        description="Best fitness of every run [1]; null if all its evaluations failed."
    )
    found_after: list[float | None] = Field(
        description="Evaluations of every run until it found its best [1]."
    )
    solved_after: list[float | None] = Field(
        description="Evaluations of every run until it reached the target [1]; null if it did not,"
        " or the problem has none of its own."
    )

    @classmethod
    def from_runs(cls, runs: Runs) -> MethodRunsView:
        """Make a view of runs."""
        lower, median, upper = ([finite(value) for value in row] for row in runs.quartiles())
        return cls(
            lower=lower,
            median=median,
            upper=upper,
            best=[finite(value) for value in runs.final],
            found_after=[finite(value) for value in runs.to_best],
            solved_after=[finite(value) for value in runs.to_target],
        )


class ProblemRunsView(View):
    """All runs on a problem: performance clouds, as figs. 3.1 to 3.3, and convergence."""

    problem: str = Field(description="Name of the problem.", examples=["D7C0R0I1"])
    dimension: int = Field(description="Variables of the problem [1].", examples=[7])
    target: float | None = Field(
        description="Fitness that counts as solved, the acceptance line [1]; null if the problem"
        " has none of its own.",
        examples=[0.001],
    )
    checkpoints: list[int] = Field(
        description="Evaluations at which the best so far was noted, the budget last [1].",
        examples=[[1, 2, 5, 10]],
    )
    methods: dict[str, MethodRunsView] = Field(description="By label.")

    @classmethod
    def from_runs(cls, problem: str, by_method: Mapping[str, Runs]) -> ProblemRunsView:
        """Make a view of a problem's runs.

        Args:
            problem: its name.
            by_method: runs of every method, one at least.
        """
        first = next(iter(by_method.values()))
        return cls(
            problem=problem,
            dimension=first.dimension,
            target=first.target,
            checkpoints=first.checkpoints.tolist(),
            methods={label: MethodRunsView.from_runs(runs) for label, runs in by_method.items()},
        )


def _document(found: Standings) -> dict[str, object]:
    correlation = None
    if found.correlation is not None:
        interval, methods = found.correlation
        correlation = CorrelationView(
            **ResampledView.from_interval(interval).model_dump(), methods=list(methods)
        )
    return {
        "mean_ranks": {m: ResampledView.from_interval(r) for m, r in found.mean_ranks.items()},
        "problems": {
            name: ProblemStandingsView(
                target=finite(found.targets[name]),
                methods={
                    s.method: StandingView.from_standing(s, found.looked_at) for s in standings
                },
            )
            for name, standings in found.by_problem.items()
        },
        "rank_correlation": correlation,
    }
