"""The page in a file of evidence: needs no network, and nothing beside it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final

from gaitswarm.evidence.archive import FORMAT, MANIFEST, VERSION
from gaitswarm.evidence.certificates import Certified, how_to_make_one
from gaitswarm.places import place_of
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.robot import load_robot
from gaitswarm.views import BestView
from gaitswarm.views.certificate import CertificateView, ProportionView, SpreadView, WorldView

_STYLE: Final = """
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto; }
th, td { padding: 0.15rem 0.7rem; text-align: right; border-bottom: 1px solid #8884; }
th:first-child, td:first-child { text-align: left; }
figure { margin: 1rem 0; } svg { max-width: 100%; height: auto; }
code { font-size: 0.9em; overflow-wrap: anywhere; } .failed { color: #d1495b; }
"""

_DIGITS: Final = 6

_SHOWN: Final = 10
"""Worst worlds of a certificate; its member names more."""


@dataclass(frozen=True, slots=True)
class CertificateOnPage:
    """A certificate as the page shows it.

    Attributes:
        view: What it comes to.
        certified: Which design of the job it is of; None for the job that the page is of.
    """

    view: CertificateView
    certified: Certified | None


def page(
    job: Job,
    best: BestView | None,
    provenance: Mapping[str, Any],
    pictures: Mapping[str, str],
    certificates: Sequence[CertificateOnPage],
    files: Sequence[str],
) -> str:
    """Write the page."""
    title = job.spec.name or job.id
    body = "\n".join(
        [
            f"<h1>{escape(title)}</h1>",
            *_result(job, best),
            *(f"<figure>{picture}</figure>" for picture in pictures.values()),
            *([] if best is None else _scenarios(job, best)),
            *_certificates(job, certificates),
            *_provenance(provenance),
            *_contents(files),
        ]
    )
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>Evidence: {escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


def _result(job: Job, best: BestView | None) -> Iterator[str]:
    spec, progress = job.spec, job.progress
    facts = {
        "Job": job.id,
        "Kind": spec.kind,
        "State": job.state.value,
        "Search": f"{spec.optimizer.name}, {spec.optimizer.particles} designs at most an iteration,"
        f" seed {spec.seed}, {spec.precision} precision",
        "Committed": f"{progress.iterations} iterations, {progress.evaluations} evaluations",
    }
    if job.lineage is not None:
        lineage = job.lineage
        facts["Fork of"] = f"{lineage.parent}, before its iteration {lineage.from_iteration}"
    yield "<h2>Result</h2>"
    if best is None:
        facts["Best"] = "no design has walked in every scenario"
        yield from _table(["", ""], facts.items())
        return
    facts["Best fitness"] = (
        f"{best.fitness!r}, minimized, of design {place_of(best.iteration, best.particle)}"
    )
    yield from _table(["", ""], facts.items())
    units = {v.name: v.unit for v in spec.design_space().variables}
    rows = [(name, _shown(value), units.get(name, "")) for name, value in best.design.items()]
    yield from _table(["variable", "value", "unit"], rows)


def _scenarios(job: Job, best: BestView) -> Iterator[str]:
    objectives = job.spec.objectives
    yield "<h2>Best design, case by case</h2>"
    heads = ["case", "status", "utility", *(f"{o.name} [{o.unit}]" for o in objectives)]
    rows = [
        [
            name,
            result.status,
            _shown(result.utility),
            *(_shown(result.objectives[o.name]) for o in objectives),
        ]
        for name, result in best.scenarios.items()
    ]
    yield from _table(heads, rows)


def _certificates(job: Job, certificates: Sequence[CertificateOnPage]) -> Iterator[str]:
    if certificates:
        for certificate in certificates:
            yield from _certificate(certificate)
    elif isinstance(job.spec, JobSpec):
        yield "<h2>Certificates</h2>"
        yield f"<p>There is none of a design of this job. {_code(how_to_make_one(job.id))}.</p>"


def _certificate(certificate: CertificateOnPage) -> Iterator[str]:
    view, certified = certificate.view, certificate.certified
    yield f"<h2>Certificate: {view.worlds} worlds</h2>"
    facts = {"Job": view.job, "Worlds": f"{view.worlds}, drawn by seed {view.seed}"}
    if certified is not None:
        place = f"design {place_of(certified.iteration, certified.particle)}"
        facts["Design"] = f"the best, {place}" if certified.of_best else f"{place}, not the best"
    facts["Robot"] = _robot_name(view)
    facts["A walk failed in"] = _chance(view.failed)
    facts["The robot fell in"] = _chance(view.fell)
    yield from _table(["", ""], facts.items())
    yield (
        "<p>Utility by scenario, minimized; a failed walk is worse than any other. The probability"
        " of one is at most so much, at 95 %. CVaR is the mean of the worst 5 %, a lower bound"
        " where some failed. Scenarios with a star are held out: the design was not tuned in"
        " them.</p>"
    )
    heads = ["scenario", "failed", "at most", "nominal", "median", "95 %", "CVaR 95 %", "worst"]
    rows = [
        [f"{name} *" if found.held_out else name, *_spread(found.failed, found.utility)]
        for name, found in view.scenarios.items()
    ]
    yield from _table(heads, [*rows, ["all", *_spread(view.failed, view.fitness)]])
    yield "<h3>Worst worlds</h3>"
    heads = ["world", "fitness", "failed in, or worst in", "walks again by"]
    worst = view.worst[:_SHOWN]
    yield from _table(heads, map(_world, worst))
    if worst:
        yield "<details><summary>Values of these worlds</summary>"
        rows = [
            [name, *(_shown(world.values.get(name)) for world in worst)] for name in worst[0].values
        ]
        yield from _table(["perturbation", *(f"world {world.world}" for world in worst)], rows)
        yield "</details>"


def _world(world: WorldView) -> list[str]:
    failures = ", ".join(f"{name} ({status})" for name, status in world.failures.items())
    where = failures or world.scenario
    return [str(world.world), _shown(world.fitness), where, world.replay]


def _spread(failed: ProportionView, spread: SpreadView) -> list[str]:
    quantiles = ["failed" if q is None else _shown(q) for q in spread.quantiles]
    cvar = _shown(spread.cvar)
    return [
        str(failed.count),
        f"{100.0 * failed.high:.2g} %",
        _shown(spread.nominal),
        quantiles[2],
        quantiles[4],
        f"> {cvar}" if spread.tail_failed else cvar,
        _shown(spread.worst),
    ]


def _chance(found: ProportionView) -> str:
    return (
        f"{found.count} ({100.0 * found.share:.3g} %; 95 % interval {100.0 * found.low:.2g} to"
        f" {100.0 * found.high:.2g} %)"
    )


def _robot_name(view: CertificateView) -> str:
    return load_robot(view.robot).description.name


def _code(text: str) -> str:
    """Text with code between backticks."""
    parts = [escape(part) for part in text.split("`")]
    return "".join(
        f"<code>{part}</code>" if number % 2 else part for number, part in enumerate(parts)
    )


def _provenance(document: Mapping[str, Any]) -> Iterator[str]:
    yield "<h2>What the numbers depend on</h2>"
    rows = []
    for record in document["records"]:
        found, walks = record["provenance"], record["provenance"]["simulation"]
        rows.append(
            (
                f"iteration {record['from_iteration']}",
                found["gaitswarm"],
                f"{walks['backend']}, {walks['precision']}",
                f"{walks['robot']} {walks['robot_digest']}",
                walks["code_digest"],
                found["optimizer_digest"],
                ", ".join(f"{k} {v}" for k, v in walks["libraries"].items()),
            )
        )
    heads = ["from", "gaitswarm", "backend", "robot", "simulation code", "search and judgement"]
    yield from _table([*heads, "libraries"], rows)
    yield "<p>Identity of the kernel that these walks are compiled to, by robot:</p>"
    yield from _table(
        ["robot", "kernel"],
        [(f"robots/{k}", digest) for k, digest in enumerate(document["kernels"])],
    )


def _contents(files: Sequence[str]) -> Iterator[str]:
    yield "<h2>What is in this file</h2>"
    yield (
        f"<p>{FORMAT}, version {VERSION}. <code>{MANIFEST}</code> has the SHA-256 of every file."
        " <code>gaitswarm verify FILE --replay 20</code> compares them, judges all designs anew,"
        " lets the search go its way again, and simulates twenty designs and the best one to"
        " compare their bits.</p>"
    )
    yield "<ul>"
    yield from (f"<li><code>{escape(name)}</code></li>" for name in sorted(files))
    yield "</ul>"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield "<table>"
    if any(heads):
        cells = "".join(f'<th scope="col">{escape(head)}</th>' for head in heads)
        yield f"<thead><tr>{cells}</tr></thead>"
    yield "<tbody>"
    for row in rows:
        yield "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
    yield "</tbody></table>"


def _shown(value: float | str | None) -> str:
    if value is None:
        return "–"
    return value if isinstance(value, str) else f"{value:.{_DIGITS}g}"
