"""Searches with and without worlds, and what their best designs come to in held-out worlds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.services.optimizer.analysis.statistics import (
    MedianInterval,
    median_interval,
    median_ratio,
)
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.held_out import certificate_walks
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.optimizer_choice import with_settings
from gaitswarm.sim.catalogue import design_numbers

if TYPE_CHECKING:
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.views.certificate import CertificateView, ProportionView


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Worlds that no search has seen.

    Attributes:
        worlds: How many are drawn.
        seed: Of these worlds.
    """

    worlds: int
    seed: int


@dataclass(frozen=True, slots=True)
class Run:
    """The best design of one search.

    Attributes:
        seed: Of the search, and of its worlds if it has any.
        job: Identifier of the search.
        certificate: What its best comes to in the held-out worlds.
    """

    seed: int
    job: str
    certificate: CertificateView


@dataclass(frozen=True, slots=True)
class Contestant:
    """One way to search, from several seeds.

    Attributes:
        title: What it is called.
        worlds: In which it judges designs, without their seed; None for the model alone.
        specs: Of the jobs, one by seed.
        runs: Those that found a design that walks; none before they were run.
    """

    title: str
    worlds: Mapping[str, Any] | None
    specs: tuple[JobSpec, ...]
    runs: tuple[Run, ...] = ()

    def values(self, quantity: str) -> list[float] | None:
        """One of `QUANTITIES` by run; None if a run has no such number, or there is no run."""
        found = [QUANTITIES[quantity](run.certificate) for run in self.runs]
        numbers = [value for value in found if value is not None]
        return numbers if numbers and len(numbers) == len(found) else None


QUANTITIES: Final[Mapping[str, Callable[[CertificateView], float | None]]] = {
    "nominal": lambda view: view.fitness.nominal,
    "median": lambda view: view.fitness.quantiles[2],
    "cvar": lambda view: view.fitness.cvar,
    "failed": lambda view: view.failed.count,
    "fell": lambda view: view.fell.count,
}
"""What runs are compared by: fitness where nothing is wrong, its median and its conditional value
at risk over the held-out worlds, and in how many of these a walk failed or the robot fell."""

_HEADS: Final = {
    "nominal": "in the model",
    "median": "median",
    "cvar": "CVaR 95 %",
    "failed": "failed",
    "fell": "fell",
}

_RATIOS: Final = ("nominal", "median", "cvar")
"""Quantities that are never zero."""


def contestants(
    common: Mapping[str, Any],
    *,
    counts: Sequence[int],
    aggregates: Sequence[str],
    level: float,
    seeds: int,
) -> list[Contestant]:
    """The study's searches, none of them run yet."""
    found = [_contestant("without worlds", None, common, seeds)]
    for count in counts:
        for aggregate in aggregates:
            worlds = {"count": count, "aggregate": aggregate, "level": level}
            found.append(_contestant(f"{aggregate} of {count}", worlds, common, seeds))
    return found


def _contestant(
    title: str, worlds: Mapping[str, Any] | None, common: Mapping[str, Any], seeds: int
) -> Contestant:
    from pydantic import ValidationError

    from gaitswarm.errors import invalid_request

    document = {name: value for name, value in common.items() if name != "particles"}
    document["optimizer"] = with_settings(common["optimizer"], {"particles": common["particles"]})
    specs = []
    for seed in range(1, seeds + 1):
        own = None if worlds is None else {**worlds, "seed": seed}
        name = f"study of worlds: {title}, seed {seed}"
        try:
            spec = {**document, "worlds": own, "seed": seed, "name": name}
            specs.append(JobSpec.model_validate(spec))
        except ValidationError as error:
            raise invalid_request(error) from error
    return Contestant(title, worlds, tuple(specs))


def check_held_out(held_out: HeldOut, seeds: int) -> None:
    """Check that no search sees the worlds on which it is judged."""
    if 1 <= held_out.seed <= seeds:
        raise InvalidRequest(
            f"{held_out.seed} is the seed of a search's worlds; take 0, or one above {seeds}",
            field="held-out-seed",
        )


def certificate_of(
    spec: JobSpec, design: Mapping[str, float | str], held_out: HeldOut
) -> CertificateSpec:
    """The certificate of a job's best design."""
    return CertificateSpec(
        kind="certificate",
        name=f"certificate of {spec.name}",
        robot=spec.robot,
        controller=spec.controller,
        design=dict(design),
        **certificate_walks(
            spec.resolved_scenarios(), spec.robot, design_numbers(spec.controller, design)
        ),
        preference=spec.preference,
        worlds=held_out.worlds,
        seed=held_out.seed,
    )


def study_document(found: Sequence[Contestant], held_out: HeldOut) -> dict[str, Any]:
    """The study as JSON has it."""
    return {
        "held_out": asdict(held_out),
        "searches": [
            {
                "search": contestant.title,
                "worlds": contestant.worlds,
                "runs": [_run_document(run) for run in contestant.runs],
                "quantities": {
                    quantity: {
                        "of_runs": _as_document(_median(contestant, quantity)),
                        "ratio": _as_document(_ratio(contestant, found[0], quantity)),
                    }
                    for quantity in QUANTITIES
                },
            }
            for contestant in found
        ],
    }


def _run_document(run: Run) -> dict[str, Any]:
    view = run.certificate
    return {
        "seed": run.seed,
        "job": run.job,
        "certificate": view.job,
        "fitness": view.fitness.model_dump(mode="json"),
        "failed": view.failed.model_dump(mode="json"),
        "fell": view.fell.model_dump(mode="json"),
    }


def _as_document(interval: MedianInterval | None) -> dict[str, Any] | None:
    return None if interval is None else asdict(interval)


def _median(contestant: Contestant, quantity: str) -> MedianInterval | None:
    values = contestant.values(quantity)
    return None if values is None else median_interval(values)


def _ratio(contestant: Contestant, plain: Contestant, quantity: str) -> MedianInterval | None:
    """How many times that of the search without worlds it is."""
    values, reference = contestant.values(quantity), plain.values(quantity)
    if contestant is plain or quantity not in _RATIOS or values is None or reference is None:
        return None
    return median_ratio(values, reference)


def study_table(found: Sequence[Contestant]) -> Table:
    """A row for every search and quantity: the runs' median, and how it differs from the first's"""
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import interval_cells, number, relative_change

    table = Table(
        title="Medians over the runs", title_justify="left", box=None, padding=(0, 1, 0, 0)
    )
    table.add_column("search", no_wrap=True)
    table.add_column("")
    for column in ("median", "interval", "change", "interval"):
        table.add_column(column, justify="right")
    for contestant in found:
        title = contestant.title
        for quantity, head in _HEADS.items():
            median, interval = interval_cells(_median(contestant, quantity), number)
            if quantity == "cvar" and any(
                r.certificate.fitness.tail_failed for r in contestant.runs
            ):
                median = f"> {median}"
            ratio = interval_cells(_ratio(contestant, found[0], quantity), relative_change)
            table.add_row(title, head, median, interval, *ratio)
            title = ""
    return table


def runs_table(found: Sequence[Contestant]) -> Table:
    """A row for every run, with the exact intervals of how often it fails."""
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import number

    table = Table(title="Runs", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("search", no_wrap=True)
    for column in ("seed", "model", "median", "CVaR", "failed", "fell"):
        table.add_column(column, justify="right")
    for contestant in found:
        for run in contestant.runs:
            fitness = run.certificate.fitness
            cvar = number(fitness.cvar)
            table.add_row(
                contestant.title,
                str(run.seed),
                number(fitness.nominal),
                number(fitness.quantiles[2]),
                f"> {cvar}" if fitness.tail_failed else cvar,
                _chance(run.certificate.failed),
                _chance(run.certificate.fell),
            )
    return table


def _chance(found: ProportionView) -> str:
    return f"{found.count} ({100.0 * found.low:.2g} to {100.0 * found.high:.2g} %)"
