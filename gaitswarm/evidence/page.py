"""The page in a file of evidence: needs no network, and nothing beside it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any, Final

from gaitswarm.evidence.archive import FORMAT, MANIFEST, VERSION
from gaitswarm.views import BestView
from services.optimizer.jobs.job import Job

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


def page(
    job: Job,
    best: BestView | None,
    provenance: Mapping[str, Any],
    pictures: Mapping[str, str],
    files: Sequence[str],
) -> str:
    """Write the page.

    Args:
        job: As it was read.
        best: Its best design; None while there is none.
        provenance: As `provenance_document` has it.
        pictures: SVG by name, "convergence" among them.
        files: Names of the other members of the archive.

    Returns:
        HTML.
    """
    title = job.spec.name or job.id
    body = "\n".join(
        [
            f"<h1>{escape(title)}</h1>",
            *_result(job, best),
            *(f"<figure>{picture}</figure>" for picture in pictures.values()),
            *([] if best is None else _scenarios(job, best)),
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
        f"{best.fitness!r}, minimized, of particle {best.particle} of iteration {best.iteration}"
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
