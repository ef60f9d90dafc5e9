"""The self-contained HTML page in an evidence file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.evidence.archive import FORMAT, MANIFEST, VERSION
from gaitswarm.evidence.certificates import Certified, how_to_make_one
from gaitswarm.services.optimizer.analysis.certificate import (
    CertificateView,
    ProportionView,
    SpreadView,
    WorldView,
)
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.settings import place_of
from gaitswarm.sim.robot import load_robot
from gaitswarm.views.history import BestView, IterationView

Floats = NDArray[np.float64]

_WIDTH: Final = 720.0
_LEFT: Final = 78.0
_RIGHT: Final = 16.0
_TOP: Final = 30.0
_BOTTOM: Final = 46.0
_BLUE: Final = "#3a6ea5"
_RED: Final = "#d1495b"
"""Significant digits of numbers."""

Scale = Callable[[float], float]
"""Maps a value to a coordinate of the picture."""


def convergence(iterations: Sequence[IterationView]) -> str:
    """Draw fitness over iterations: best so far, median, and the band from best to worst."""
    height, index = 340.0, [float(i.index) for i in iterations]
    drawn = [v for i in iterations for v in (i.best_so_far, i.best, i.median) if v is not None]
    if not drawn:
        return _figure(height, "Convergence: no design has succeeded in every scenario", [])
    across = _linear(index[0], max(index[-1], index[0] + 1.0), _LEFT, _WIDTH - _RIGHT)
    up, ticks = _up(drawn, height)
    bottom = height - _BOTTOM
    parts = list(_rows(ticks, up))
    band = [(i, i.best, i.worst) for i in iterations if i.best is not None and i.worst is not None]
    if len(band) > 1:
        lower = [(across(i.index), up(best)) for i, best, _ in band]
        upper = [(across(i.index), max(up(worst), _TOP)) for i, _, worst in reversed(band)]
        parts.append(
            f'<polygon points="{_points([*lower, *upper])}" fill="{_BLUE}" fill-opacity="0.15"/>'
        )
    median = [(across(i.index), up(i.median)) for i in iterations if i.median is not None]
    median = [(x, max(y, _TOP)) for x, y in median]
    parts.append(_line(median, _BLUE, 1.2))
    steps: list[tuple[float, float]] = []
    for i in iterations:
        if i.best_so_far is not None:
            here = (across(i.index), up(i.best_so_far))
            steps += [(here[0], steps[-1][1]), here] if steps else [here]
    parts.append(_line(steps, _RED, 2.2))
    parts += _columns(index, across, bottom)
    parts.append(_text(_LEFT + 8, _TOP - 12, "best so far", colour=_RED))
    parts.append(_text(_LEFT + 90, _TOP - 12, "median and range of an iteration", colour=_BLUE))
    parts.append(_text(_WIDTH / 2, height - 8, "iteration", anchor="middle"))
    parts.append(_upright(height, "fitness, minimized [1]"))
    return _figure(height, "Convergence: fitness over iterations", parts)


def bars(names: Sequence[str], values: Sequence[float | None], *, label: str, title: str) -> str:
    """Draw one bar a name."""
    left, row = 170.0, 30.0
    height = _TOP + row * len(names) + _BOTTOM
    most = max([v for v in values if v is not None], default=1.0) or 1.0
    across = _linear(0.0, most, left, _WIDTH - 90.0)
    parts = []
    for k, (name, value) in enumerate(zip(names, values, strict=True)):
        y = _TOP + row * k
        parts.append(_text(left - 10, y + 19, name, anchor="end"))
        if value is None:
            parts.append(_text(left + 6, y + 19, "failed", colour=_RED))
            continue
        width = across(value) - left
        parts.append(
            f'<rect x="{left:.2f}" y="{y + 5:.2f}" width="{width:.2f}" height="{row - 10:.2f}"'
            f' fill="{_BLUE}"/>'
        )
        parts.append(_text(left + width + 6, y + 19, _number(value)))
    parts.append(_text((left + _WIDTH) / 2, height - 14, label, anchor="middle"))
    return _figure(height, title, parts)


def heat_map(values: Floats, *, across: str, up: str, title: str) -> str:
    """Draw a table of numbers as colours, red above zero and blue below."""
    height = 380.0
    n, m = values.shape
    largest = float(np.abs(values).max()) or 1.0
    width = (_WIDTH - _LEFT - _RIGHT) / n
    tall = (height - _TOP - _BOTTOM) / m
    parts = [
        f'<rect x="{_LEFT + i * width:.2f}" y="{height - _BOTTOM - (j + 1) * tall:.2f}"'
        f' width="{width + 0.5:.2f}" height="{tall + 0.5:.2f}"'
        f' fill="{_colour(float(values[i, j]) / largest)}"/>'
        for i in range(n)
        for j in range(m)
    ]
    parts.append(_text(_WIDTH / 2, height - 12, across, anchor="middle"))
    parts.append(_upright(height, up))
    parts.append(_text(_WIDTH - _RIGHT, _TOP - 10, f"±{_number(largest)}", anchor="end"))
    return _figure(height, title, parts)


def _figure(height: float, title: str, parts: Sequence[str]) -> str:
    body = "\n".join(part for part in parts if part)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:.0f} {height:.0f}"'
        f' role="img" font-family="system-ui, sans-serif" font-size="13" color="#777">\n'
        f"<title>{escape(title)}</title>\n{body}\n</svg>\n"
    )


def _linear(low: float, high: float, first: float, last: float) -> Scale:
    return lambda value: first + (value - low) / (high - low) * (last - first)


def _up(values: Sequence[float], height: float) -> tuple[Scale, list[float]]:
    """Vertical scale, logarithmic where values differ by much, and its ticks."""
    low, high = min(values), max(values)
    if high == low:
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    bottom = height - _BOTTOM
    if low > 0.0 and high / low > 3.0:
        log = _linear(math.log10(low), math.log10(high), bottom, _TOP)
        first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
        ticks = [f * 10.0**e for e in range(first, last + 1) for f in (1.0, 2.0, 5.0)]
        return lambda value: log(math.log10(value)), [t for t in ticks if low <= t <= high]
    return _linear(low, high, bottom, _TOP), _ticks(low, high)


def _ticks(low: float, high: float) -> list[float]:
    """About five round numbers."""
    rough = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= rough)
    first = math.ceil(low / step)
    return [k * step for k in range(first, math.floor(high / step) + 1)]


def _rows(ticks: Sequence[float], up: Scale) -> Iterator[str]:
    for value in ticks:
        y = up(value)
        yield (
            f'<line x1="{_LEFT:.2f}" x2="{_WIDTH - _RIGHT:.2f}" y1="{y:.2f}" y2="{y:.2f}"'
            ' stroke="currentColor" stroke-opacity="0.25"/>'
        )
        yield _text(_LEFT - 8, y + 4, _number(value), anchor="end")


def _columns(index: Sequence[float], across: Scale, bottom: float) -> Iterator[str]:
    whole = sorted({round(t) for t in _ticks(index[0], max(index[-1], index[0] + 1.0))})
    for value in whole:
        yield _text(across(float(value)), bottom + 18, str(value), anchor="middle")


def _line(points: Sequence[tuple[float, float]], colour: str, width: float) -> str:
    if not points:
        return ""
    return (
        f'<polyline points="{_points(points)}" fill="none" stroke="{colour}"'
        f' stroke-width="{width}"/>'
    )


def _points(points: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def _text(x: float, y: float, text: str, *, anchor: str = "start", colour: str = "") -> str:
    return (
        f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}"'
        f' fill="{colour or "currentColor"}">{escape(text)}</text>'
    )


def _upright(height: float, text: str) -> str:
    y = (height - _BOTTOM + _TOP) / 2
    return (
        f'<text transform="translate(16 {y:.2f}) rotate(-90)" text-anchor="middle"'
        f' fill="currentColor">{escape(text)}</text>'
    )


def _colour(share: float) -> str:
    """White at 0, towards red at 1 and blue at -1."""
    strong = (209, 73, 91) if share > 0.0 else (58, 110, 165)
    mixed = [round(255 + (channel - 255) * min(abs(share), 1.0)) for channel in strong]
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


def _number(value: float) -> str:
    return f"{value:.4g}"


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
"""Worst worlds of a certificate that the page lists."""


@dataclass(frozen=True, slots=True)
class CertificateOnPage:
    """A certificate as the page shows it.

    Attributes:
        view: Its results.
        certified: The certified design of the job; None for the job's own page.
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
        facts["Best"] = "no design has succeeded in every scenario"
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
        yield f"<p>No design of this job has a certificate. {_code(how_to_make_one(job.id))}.</p>"


def _certificate(certificate: CertificateOnPage) -> Iterator[str]:
    view, certified = certificate.view, certificate.certified
    yield f"<h2>Certificate: {view.worlds} worlds</h2>"
    facts = {"Job": view.job, "Worlds": f"{view.worlds}, drawn by seed {view.seed}"}
    if certified is not None:
        place = f"design {place_of(certified.iteration, certified.particle)}"
        facts["Design"] = f"the best, {place}" if certified.of_best else f"{place}, not the best"
    facts["Robot"] = _robot_name(view)
    facts["Worlds with a failure"] = _chance(view.failed)
    facts["Worlds with a fall"] = _chance(view.fell)
    yield from _table(["", ""], facts.items())
    yield (
        "<p>Utility by scenario, minimized; a failure is worse than any value. The probability"
        " of a failure is at most the given one, at 95 %. CVaR is the mean of the worst 5 %, a"
        " lower bound where some failed. Scenarios with a star are held out: the design was not"
        " tuned in them.</p>"
    )
    heads = ["scenario", "failed", "at most", "nominal", "median", "95 %", "CVaR 95 %", "worst"]
    rows = [
        [f"{name} *" if found.held_out else name, *_spread(found.failed, found.utility)]
        for name, found in view.scenarios.items()
    ]
    yield from _table(heads, [*rows, ["all", *_spread(view.failed, view.fitness)]])
    yield "<h3>Worst worlds</h3>"
    heads = ["world", "fitness", "failed in, or worst in", "command to repeat"]
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
    yield "<h2>Provenance</h2>"
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
    yield "<p>Identity of the compiled kernel, by robot:</p>"
    yield from _table(
        ["robot", "kernel"],
        [(f"robots/{k}", digest) for k, digest in enumerate(document["kernels"])],
    )


def _contents(files: Sequence[str]) -> Iterator[str]:
    yield "<h2>Contents of this file</h2>"
    yield (
        f"<p>{FORMAT}, version {VERSION}. <code>{MANIFEST}</code> has the SHA-256 of every file."
        " <code>gaitswarm verify FILE --replay 20</code> compares them, judges all designs again,"
        " repeats the search, and simulates twenty designs and the best one to"
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
