"""Preferences whose optima are robust, and even over the scenarios (thesis 4.5, 4.6)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypeAlias

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.stats import rankdata

import gaitswarm
from gaitswarm import (
    CONTROLLERS,
    PREFERENCES,
    CertificateSpec,
    InvalidRequest,
    Preference,
    job_spec,
    robustness,
    simulate,
)
from gaitswarm.plugins import Axis, Space, create_search
from gaitswarm_research import options

Floats = NDArray[np.float64]
Optimum: TypeAlias = dict[str, Any]

NEUTRAL: Final = Preference(bias=(0.0,) * 5, exponent=(0.2,) * 5)
"""Geometric mean of f1 to f5, by which all optima are judged in held-out worlds."""

CRITERIA: Final = ("index", "failed", "risk", "unevenness")
"""Values of `Study.judged` that candidates are ranked by; none depends on a preference."""

_HEADS: Final = ("rank", "index", "failed", "risk", "uneven", "f1", "f2", "f3", "f4", "f5", "cm/s")
_START: Final = 5
_SIGMA: Final = 0.15
"""Standard deviation of the first refined exponents, the largest of which is 1."""


def ratios_and_unevenness(objectives: Floats, published: Floats) -> tuple[Floats, float]:
    """Return geometric means (5,) over scenarios of (K, 5) objectives relative to published ones.

    Unevenness is the geometric standard deviation over the scenarios, root mean square over the
    objectives: 1 if every ratio is the same in all scenarios.
    """
    logarithms = np.log(objectives / published)
    deviation = math.sqrt(float(logarithms.var(axis=0).mean()))
    return np.exp(logarithms.mean(axis=0)), math.exp(deviation)


def mean_ranks(optima: Sequence[Optimum]) -> list[float]:
    """Mean of each optimum's ranks by `CRITERIA`; None ranks last, equals share their mean rank."""
    values = [[math.inf if o[name] is None else o[name] for o in optima] for name in CRITERIA]
    ranks: list[float] = np.mean([rankdata(row) for row in values], axis=0).tolist()
    return ranks


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """Searches for the optima of preferences, and their judgement.

    Attributes:
        common: Fields that all jobs share.
        pool: Job whose best designs under a preference begin the search for its optimum.
        published: (K, 5) objectives of published A.
        runner: Where to run and store jobs: db, cpus and ray_address.
    """

    common: Mapping[str, Any]
    iterations: int
    samples: int
    worlds: int
    pool: str
    published: Floats
    runner: Mapping[str, Any]

    def optimum(self, candidate: str, preference: Preference) -> Optimum:
        """Search for the optimum of a preference and judge it."""
        with gaitswarm.open(self.runner["db"]) as jobs:
            start = [row.design for row in jobs.ranking(self.pool, preference, top=_START).top]
        fields = {**self.common, "iterations": self.iterations, "start": start}
        spec = job_spec(**fields, preference=preference, name="study of preferences: search")
        result = options.run_job(spec, **self.runner)
        fields = {"preference": preference.model_dump(), "job": result.job.id}
        return {"candidate": candidate, **fields, **self.judged(result.best.design)}

    def judged(self, design: Mapping[str, float | str]) -> Optimum:
        """Judge a design by objectives, sensitivity to its variables, and held-out worlds."""
        spec = job_spec(**self.common, preference=NEUTRAL)
        walks: dict[str, Any] = {"robot": spec.robot, "scenarios": spec.scenarios}
        walks |= {"controller": spec.controller, "cpus": self.runner["cpus"]}
        objectives = simulate([design], **walks).objectives[0, :, :5]
        ratios, unevenness = ratios_and_unevenness(objectives, self.published)
        index = robustness(
            design, **walks, precision=spec.precision, samples=self.samples, seed=spec.seed
        ).index
        return {
            "design": dict(design),
            "ratios": ratios.tolist(),
            "speed": 1.0 / float(objectives[:, 4].max()),
            "index": None if index is None else index.value,
            "unevenness": unevenness,
            **self.in_worlds(design, spec.seed),
        }

    def in_worlds(self, design: Mapping[str, float | str], seed: int) -> Optimum:
        """Share of worlds with failures, and CVaR relative to the nominal world."""
        spec = job_spec(**self.common, preference=NEUTRAL)
        name = "study of preferences: certificate"
        plan = CertificateSpec.of_job(spec, design, name=name, worlds=self.worlds, seed=seed)
        plan = plan.model_copy(update={"precision": spec.precision})
        job = options.run_job(plan, **self.runner).job
        with gaitswarm.open(self.runner["db"]) as jobs:
            view = jobs.certificate(job.id)
        nominal, cvar = view.fitness.nominal, view.fitness.cvar
        risk = None if nominal is None or cvar is None else cvar / nominal
        return {"failed": view.failed.share, "risk": risk}


def candidates(pool: str, drawn: int, db: str | None, seed: int) -> dict[str, Preference]:
    """Return A, B and C, and preferences under which other designs of a job win."""
    named = {name: PREFERENCES[name] for name in ("A", "B", "C")}
    with gaitswarm.open(db) as jobs:
        winners = jobs.preferences(pool, candidates=3 + drawn, seed=seed).candidates
    others = [winner.preference for winner in winners if not winner.named][:drawn]
    return named | {f"drawn {k}": preference for k, preference in enumerate(others, start=1)}


def refine(study: Study, optima: list[Optimum], count: int, seed: int) -> None:
    """Add optima of exponents that CMA-ES proposes around the best; it sees their mean ranks."""
    best = optima[int(np.argmin(mean_ranks(optima)))]["preference"]
    centre = np.array([best["exponent"]])
    # Only ratios of exponents affect a ranking.
    box, settings = Space([Axis(0.0, 1.0)] * centre.size), {"name": "cma-es", "sigma": _SIGMA}
    search = create_search(settings, box, count + 1, seed, centre / centre.max())
    # The first proposal is the centre, which is judged already.
    search.tell(np.zeros(len(search.ask(1))))
    while search.evaluations <= count:
        first = search.evaluations
        exponents = search.ask(count + 1 - first)
        for k, row in enumerate(exponents.tolist(), start=first):
            preference = Preference(bias=best["bias"], exponent=tuple(row))
            optima.append(study.optimum(f"refined {k}", preference))
        search.tell(np.array(mean_ranks(optima)[-len(exponents) :]))


def study_table(document: Mapping[str, Any]) -> Table:
    """The reference, and candidates by mean rank; objectives as changes from it in per cent."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("preference", no_wrap=True)
    for column in _HEADS:
        table.add_column(column, justify="right", no_wrap=True)
    for row in (document["reference"], *document["candidates"]):
        table.add_row(
            row["candidate"],
            _number(row.get("mean_rank"), 1),
            _number(row["index"], 2),
            f"{100.0 * row['failed']:.0f} %",
            _number(row["risk"], 2),
            _number(row["unevenness"], 2),
            *(f"{100.0 * (ratio - 1.0):+.0f}" for ratio in row["ratios"]),
            _number(100.0 * row["speed"], 1),
        )
    return table


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def preferences(
    *,
    drawn: Annotated[int, typer.Option(min=0, max=500, help="Preferences besides A, B, C.")] = 16,
    refined: Annotated[int, typer.Option(min=0, help="Preferences near the best one.")] = 16,
    pool: Annotated[int, typer.Option(min=1, help="Iterations of hype for the first designs.")] = 8,
    particles: Annotated[int, typer.Option(help="Designs per iteration, at most.")] = 50,
    iterations: Annotated[
        int, typer.Option(min=1, help="Iterations of the search for an optimum.")
    ] = 3,
    samples: Annotated[
        int, typer.Option(min=40, help="Designs around an optimum, for its index.")
    ] = 64,
    held_out: Annotated[int, typer.Option(min=1, help="Worlds to judge an optimum in.")] = 99,
    seed: Annotated[int, typer.Option(min=0, help="Of searches, samples and worlds.")] = 1,
    precision: Annotated[
        str, typer.Option(metavar="single|double", help="Of all but objectives.")
    ] = "single",
    robot: options.Robot = None,
    db: options.Db = None,
    cpus: options.Cpus = None,
    ray_address: options.RayAddress = None,
    as_json: options.Json = False,
) -> None:
    """Find preferences whose optimum is robust, and as good in every scenario (thesis 4.5, 4.6).

    Searches and certificates are jobs of the database. Jobs that the same code ran before are
    reused, so the same command resumes an interrupted study.
    """
    common: dict[str, Any] = {"controller": "fuzzy-pi", "particles": particles}
    common |= {"precision": precision, "seed": seed}
    common |= {} if robot is None else {"robot": robot}
    runner: dict[str, Any] = {"db": db, "cpus": cpus, "ray_address": ray_address}
    design = CONTROLLERS["fuzzy-pi"].published["A"]
    fields = {**common, "optimizer": "hype", "iterations": pool, "start": [design]}
    spec = job_spec(**fields, name="study of preferences: pool")
    published = simulate(design, robot=spec.robot, scenarios=spec.scenarios, cpus=cpus)
    if published.statuses.any():
        raise InvalidRequest("published A, the reference, fails on it; take another", field="robot")
    job = options.run_job(spec, **runner).job.id
    objectives = published.objectives[0, :, :5]
    study = Study(common, iterations, samples, held_out, job, objectives, runner)
    optima = [study.optimum(*c) for c in candidates(job, drawn, db, seed).items()]
    refine(study, optima, refined, seed)
    ranked = sorted(zip(mean_ranks(optima), optima, strict=True), key=lambda pair: pair[0])
    shown = [{**optimum, "mean_rank": rank} for rank, optimum in ranked]
    for row in shown:
        # The choice of the best has seen the worlds of its seed.
        if row is shown[0] or row["candidate"] in ("A", "B", "C"):
            row["fresh_worlds"] = study.in_worlds(row["design"], seed + 1)
    reference = {"candidate": "published A", **study.judged(design)}
    document = {"reference": reference, "candidates": shown}
    if as_json:
        typer.echo(json.dumps(document, indent=2))
        return
    Console().print(study_table(document))
    for row in (row for row in shown if "fresh_worlds" in row):
        fresh, weights = row["fresh_worlds"], json.dumps(row["preference"])
        options.stderr.print(
            f"{row['candidate']}: {weights}; in worlds of another seed failed"
            f" {100.0 * fresh['failed']:.0f} %, risk {_number(fresh['risk'], 2)}"
        )
    options.stderr.print(
        f"{len(shown)} candidates; rank: mean of ranks by index, failed, risk, uneven, least best"
        "\nindex: sensitivity to the design's variables"
        f"\nfailed: share of {held_out} held-out worlds in which a scenario failed"
        "\nrisk: mean of f1 to f5 in the worst 5 % of worlds, relative to the nominal world"
        "\nuneven: spread over scenarios of objectives relative to published A"
        "\nf1 to f5: change from published A in per cent; cm/s: speed in the slowest scenario"
    )
