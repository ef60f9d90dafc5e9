"""The tournament's report: one HTML file with its pictures inside."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitswarm.cli.atomic_file import replacing
from gaitswarm.cli.tournament.pictures import draw_problem, draw_profiles, draw_ranks
from gaitswarm.services.optimizer.analysis.tournaments.standings import NEAR, Standings, profiles_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gaitswarm.cli.tournament.runs import Entry
    from gaitswarm.services.optimizer.analysis.interval import Interval

REPORT: Final = "report.html"

_STYLE: Final = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 72rem; margin: 2rem auto;
       padding: 0 1rem; }
table { border-collapse: collapse; margin: 1rem 0; }
th, td { padding: 0.15rem 0.7rem; text-align: right; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child, .text td { text-align: left; }
figure { margin: 1rem 0; } svg { max-width: 100%; height: auto; }
code { background: #f3f3f3; padding: 0 0.2rem; }
"""


def write_report(
    folder: Path, found: Standings, entries: Mapping[str, Entry], facts: Mapping[str, str]
) -> Path:
    """Write `report.html`, which needs nothing beside it."""
    body = "\n".join(_lines(found, entries, facts))
    page = (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>Tournament of search methods</title>\n<style>{_STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )
    with replacing(folder / REPORT, "output") as file:
        file.write(page.encode())
    return folder / REPORT


def _lines(
    found: Standings, entries: Mapping[str, Entry], facts: Mapping[str, str]
) -> Iterator[str]:
    yield "<h1>Tournament of search methods</h1>"
    yield from _table(["", ""], facts.items())
    yield from _mean_ranks(found)
    yield "<h2>Data profiles</h2>"
    yield (
        "<p>Share of runs that have come from the usual first value all but a share tau of the way"
        " to the least value that any run found (Moré and Wild 2009).</p>"
    )
    yield _picture(draw_profiles(profiles_of(found.results)))
    for name in found.by_problem:
        yield from _problem(found, name)
    yield from _settings(entries)


def _mean_ranks(found: Standings) -> Iterator[str]:
    yield "<h2>Mean ranks</h2>"
    yield (
        "<p>On each problem, a run is before another one if it reached the target in fewer"
        " evaluations, or alone, or if neither did and its best is less; methods are ranked by the"
        " mean place of their runs. Intervals hold 95 % of resampled runs.</p>"
    )
    rows = [[m, *_cells(r, "{:.2f}")] for m, r in found.mean_ranks.items()]
    yield from _table(["method", "mean rank", "from", "to"], rows)
    yield _picture(draw_ranks(found.mean_ranks))
    if found.correlation is not None:
        interval, methods = found.correlation
        value, low, high = _cells(interval, "{:.2f}")
        yield (
            f"<p>Spearman's correlation with the ranks of the other tournament, over"
            f" {len(methods)} methods ({escape(', '.join(methods))}): {value}, from {low} to"
            f" {high}. The interval says how sure the ranks are, not what other methods would do."
            "</p>"
        )


def _problem(found: Standings, name: str) -> Iterator[str]:
    by_method = found.results[name]
    target = next(iter(by_method.values())).target
    yield f"<h2>{escape(name)}</h2>"
    how = "" if target is not None else f", {NEAR:.0%} above the least value of all runs"
    yield (
        f"<p>Target {found.targets[name]:.6g}{how}. Expected running time: evaluations until it is"
        " reached, if runs are repeated until one does, with its interval"
        f"{'' if target is not None else '; as far as checkpoints tell'}.</p>"
    )
    rows = [
        [
            s.method,
            f"{s.rank:g}",
            f"{s.solved}/{s.runs}",
            *_cells(s.running_time, "{:.0f}"),
            *(_number(value) for value in s.medians),
            _number(s.least),
        ]
        for s in found.by_problem[name]
    ]
    medians = [f"median after {count}" for count in found.looked_at]
    head = ["method", "rank", "solved", "running time", "from", "to", *medians, "least"]
    yield from _table(head, rows)
    yield _picture(draw_problem(name, by_method))


def _settings(entries: Mapping[str, Entry]) -> Iterator[str]:
    yield "<h2>Settings</h2>"
    yield "<p>What was drawn anew for every run stands with its range.</p>"
    rows = []
    for label, entry in entries.items():
        drawn = {v.name: v for v in entry.spec.design_space().variables if v.name != "seed"}
        shown = [
            f"{key} = {value}"
            for key, value in entry.spec.method.model_dump().items()
            if key not in drawn
        ]
        shown += [
            f"{v.name}: {', '.join(v.choices)}"
            if v.choices
            else f"{v.name}: {v.low:g} to {v.high:g}"
            for v in drawn.values()
        ]
        rows.append([label, "; ".join(shown), entry.job_id])
    yield from _table(["method", "settings", "job"], rows, kind="text")


def _picture(figure: Figure) -> str:
    """An SVG element; drawn twice, it is the same text."""
    from matplotlib import rc_context

    text = io.StringIO()
    with rc_context({"svg.hashsalt": "gaitswarm"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    drawn = text.getvalue()
    return f"<figure>{drawn[drawn.index('<svg') :]}</figure>"


def _cells(interval: Interval, form: str) -> list[str]:
    values = (interval.value, interval.low, interval.high)
    return [form.format(v) if math.isfinite(v) else "–" for v in values]


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"


def _table(
    headings: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "numbers"
) -> Iterator[str]:
    yield f'<table class="{kind}">'
    if any(headings):
        yield f"<tr>{''.join(f'<th>{escape(text)}</th>' for text in headings)}</tr>"
    for row in rows:
        yield f"<tr>{''.join(f'<td>{escape(text)}</td>' for text in row)}</tr>"
    yield "</table>"
