"""Report of the reconstruction: a folder of Markdown and figures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitswarm_research.reconstruction.deviations import deviations
from gaitswarm_research.reconstruction.evidence import PRINTED, Assessment, Evidence
from gaitswarm_research.reconstruction.optimality import OPTIMA
from gaitswarm_research.reconstruction.pictures import draw_choices, draw_exclusion, draw_targets

REPORT: Final = "report.md"

INTERVALS: Final = 5
"""Number of equal parts of a continuous convention's range."""

_BEST_SHARE: Final = 0.05
"""Share of the best random designs that an optimum should belong to."""


def write_report(folder: Path, evidence: Evidence) -> Path:
    """Write `report.md` and its figures."""
    for name, draw in (
        ("targets", draw_targets),
        ("choices", draw_choices),
        ("exclusion", draw_exclusion),
    ):
        # Without a date the same figure is the same file.
        draw(evidence).savefig(folder / f"{name}.svg", metadata={"Date": None})
    path = folder / REPORT
    path.write_text("\n".join([*_lines(evidence), ""]), encoding="utf-8")
    return path


def _lines(evidence: Evidence) -> Iterator[str]:
    for section in (
        _head,
        _summary,
        _deviations,
        _targets,
        _optima,
        _choices,
        _intervals,
        _one_at_a_time,
        _rows_left_out,
        _predictions,
        _exclusion,
    ):
        yield from section(evidence)
        yield ""


def _head(evidence: Evidence) -> Iterator[str]:
    size, evaluated = evidence.size, sum(len(run) for run in evidence.runs)
    yield "# Reconstruction"
    yield ""
    yield (
        f"{len(evidence.runs)} calibrations of {size.particles} designs an iteration, {evaluated}"
        f" choices of conventions in all; {size.samples} random designs under the default and under"
        f" the best of each calibration, {size.samples_each} under every other choice. Written by"
        " `gaitswarm-research reconstruction`; research/docs/reconstruction.md explains it."
    )


def _summary(evidence: Evidence) -> Iterator[str]:
    winner = evidence.winner
    yield "## Summary"
    yield ""
    misfits = ", ".join(f"{best.fitness:.2f}" for best in evidence.best)
    yield (
        f"- Misfit (root mean square over the fitted rows, in tolerances): default"
        f" {evidence.default.fitness:.2f}; best of each calibration {misfits}."
    )
    for label, one in (("the default", evidence.default), (f"the {winner.label}", winner)):
        shares = ", ".join(f"{o} {_share(one, o)}" for o in OPTIMA)
        yield f"- Random designs that beat the optimum of a preference, under {label}: {shares}."
    yield f"- The evidence decides: {_names(evidence, 'trusted')}."
    yield f"- It narrows: {_names(evidence, 'rough')}."
    yield f"- It cannot tell: {_names(evidence, 'unknown')}."
    yield f"- {_verdict(evidence)}"


def _deviations(_: Evidence) -> Iterator[str]:
    yield "## Deviations from print"
    yield ""
    yield "Every published optimum on the default model, fitted or held out: print → simulated."
    yield ""
    yield deviations()


def _names(evidence: Evidence, trust: str) -> str:
    """Conventions of one degree of trust, with what remains of each."""
    names = []
    for column, parameter in enumerate(evidence.parameters.parameters):
        if _trust(evidence, column) != trust:
            continue
        name = f"`{parameter.name}`"
        if trust == "unknown":
            names.append(name)
        elif parameter.choices:
            names.append(f"{name} ({', '.join(evidence.remaining(column))})")
        else:
            names.append(f"{name} (best {parameter.best:.3g})")
    return ", ".join(names) or "nothing"


def _targets(evidence: Evidence) -> Iterator[str]:
    yield "## Printed against simulated"
    yield ""
    yield "Off is in tolerances: 1 is a factor of 1 + tolerance too much, -1 as much too little."
    yield ""
    yield "![Every target's difference, in tolerances](targets.svg)"
    yield ""
    winner, spec = evidence.winner, evidence.spec
    off = [spec.differences(one.simulated[None, :])[0] for one in (evidence.default, winner)]
    rows = [
        [
            t.label,
            t.unit,
            f"{t.value:.4g}",
            _tolerance(t.tolerance, absolute=t.quantity == "height_loss"),
            *_reached(evidence.default.simulated[k], off[0][k]),
            *_reached(winner.simulated[k], off[1][k]),
            "" if t.use == "fit" else "not fitted",
        ]
        for k, t in enumerate(spec.targets)
    ]
    head = ["row", "unit", "printed", "tolerance", "default", "off", winner.label, "off", ""]
    yield from _table(head, rows)
    yield ""
    yield f"Conventions of the {winner.label}, and of the default:"
    yield ""
    shown = spec.design_space().shown(list(winner.choice.values()))
    yield from _table(
        ["convention", "default", winner.label],
        [[f"`{n}`", _value(evidence.defaults[n]), _value(v)] for n, v in shown.items()],
    )


def _optima(evidence: Evidence) -> Iterator[str]:
    yield "## Optima among random designs"
    yield ""
    yield (
        "f_G of the published optima by their own preference, the share of random designs of table"
        " 4.4's bounds that beat them (in brackets the optimum's place among A, B and C), and the"
        f" share that fails. Printed: A {PRINTED['A']:.4g}, C {PRINTED['C']:.4g}."
    )
    yield ""
    yield from _table(
        ["conventions", "misfit", *_optima_head(), "fail"],
        [_optima_row(one) for one in (evidence.default, *evidence.best)],
    )
    yield ""
    yield "Fitness of every optimum by every preference under the default:"
    yield ""
    fitness = evidence.default.designs.optimality.fitness
    yield from _table(
        ["preference", *OPTIMA],
        [[p, *(_number(fitness[p][o]) for o in OPTIMA)] for p in OPTIMA],
    )


def _choices(evidence: Evidence) -> Iterator[str]:
    yield "## Misfit by choice"
    yield ""
    limit = evidence.spec.as_good_as(evidence.winner.fitness)
    yield (
        "Least misfit of all designs with a choice, over all calibrations and of each. A choice"
        " remains if a calibration has it among designs as good as its best, or if the default or"
        f" one change of it comes with it to {limit:.3f}, as"
        " good as the best of all."
    )
    yield ""
    yield "![Least misfit by choice](choices.svg)"
    yield ""
    rows = [
        [
            f"`{p.name}`",
            choice.name,
            _number(choice.fitness),
            *map(_number, choice.by_run),
            "yes" if choice.name in evidence.remaining(column) else "no",
            _trust(evidence, column),
        ]
        for column, p in enumerate(evidence.parameters.parameters)
        for choice in p.choices
    ]
    yield from _table(["convention", "choice", *_runs_head(evidence), "remains", "evidence"], rows)


def _intervals(evidence: Evidence) -> Iterator[str]:
    yield "## Misfit by interval"
    yield ""
    yield "The same of conventions that are numbers, in equal parts of what was searched."
    yield ""
    rows = []
    for column, p in enumerate(evidence.parameters.parameters):
        if p.choices:
            continue
        edges = np.linspace(p.low, p.high, INTERVALS + 1)
        for k, (low, high) in enumerate(pairwise(edges.tolist())):
            least = []
            for run in evidence.runs:
                values = run.designs[:, column]
                last = k + 1 == INTERVALS
                inside = (values >= low) & ((values <= high) if last else (values < high))
                least.append(float(np.fmin.reduce(run.fitness[inside], initial=np.inf)))
            part = f"{low:.3g} to {high:.3g}"
            numbers = map(_number, (min(least), *least))
            rows.append([f"`{p.name}`", part, *numbers, _trust(evidence, column)])
    yield from _table(["convention", "interval", *_runs_head(evidence), "evidence"], rows)


def _one_at_a_time(evidence: Evidence) -> Iterator[str]:
    yield "## One convention at a time"
    yield ""
    yield "What one change of the default does; the first row is the default itself."
    yield ""
    rows = [["default", "", *_optima_row(evidence.default)[1:]]]
    rows += [
        [f"`{a.variable.name}`", a.shown, *_optima_row(one)[1:]] for a, one in evidence.changed
    ]
    yield from _table(["convention", "value", "misfit", *_optima_head(), "fail"], rows)


def _rows_left_out(evidence: Evidence) -> Iterator[str]:
    yield "## Rows predicted from the others"
    yield ""
    yield (
        "Every fitted row by the choice that is best without it, and without all rows of its walk,"
        " from what the calibrations have evaluated."
    )
    yield ""
    rows = [
        [
            target.label,
            f"{target.value:.4g}",
            *_reached(one.simulated, one.difference),
            *_left_out(one.left_out),
            *_left_out(whole.left_out),
        ]
        for target, one, whole in zip(
            evidence.spec.targets,
            evidence.by_target.targets,
            evidence.by_walk.targets,
            strict=True,
        )
        if target.use == "fit"
    ]
    head = ["row", "printed", "fitted", "off", "without row", "off", "without walk", "off"]
    yield from _table(head, rows)


def _predictions(evidence: Evidence) -> Iterator[str]:
    yield "## Published results that no row has"
    yield ""
    yield "Predicted: the other two optima of table 3.6, and f_G of B. None of them was fitted."
    yield ""
    for name, results in evidence.predictions["default"].items():
        yield f"{name}:"
        yield ""
        rows = [
            [label, *(_number(value) for value in predictions[name].values())]
            for label, predictions in evidence.predictions.items()
        ]
        yield from _table(["conventions", *results], rows)
        yield ""
    rows = [
        [one.label, _number(one.designs.optimality.fitness["B"]["B"])]
        for one in (evidence.default, *evidence.best)
    ]
    yield from _table(["conventions", "f_G of B"], rows)


def _exclusion(evidence: Evidence) -> Iterator[str]:
    yield "## Which published numbers exclude one another"
    yield ""
    yield "![Value of f_G of C against its rank](exclusion.svg)"
    yield ""
    choices = len(list(evidence.choices()))
    yield (
        f"Of {choices} choices of conventions, C's value is within a factor of"
        f" two of the printed one under {_count(evidence, value=True)}, C is among the best"
        f" {_BEST_SHARE:.0%} of random designs under {_count(evidence, rank=True)}, and both hold"
        f" under {_count(evidence, value=True, rank=True)}."
    )
    yield ""
    yield (
        "A bound: log f_A is convex in the logarithms of the objectives, so by Jensen's inequality"
        " a design with the geometric means g_m over the scenarios has f_A of at least the product"
        " of (b_m + g_m)^e_m, and f_C is the product of the g_m. With torque and speed as simulated"
        f" of A and f_A at most 1.1 x {PRINTED['A']:.4g}, f_C of A can be no greater than:"
    )
    yield ""
    rows = []
    for one in (evidence.default, *evidence.best):
        bound = one.product_bound()
        means = one.designs.means.get("A", [np.nan] * 5)
        less = "" if bound is None else "yes" if bound < PRINTED["C"] else "no"
        rows.append([one.label, *(f"{means[m]:.3g}" for m in (0, 4)), _number(bound), less])
    head = ["conventions", "torque of A [N m]", "1/speed of A [s/m]", "f_C of A at most"]
    yield from _table([*head, f"below {PRINTED['C']:.4g}"], rows)
    yield ""
    yield _verdict(evidence)


def _verdict(evidence: Evidence) -> str:
    bounds = [one.product_bound() for one in (evidence.default, *evidence.best)]
    known = [bound for bound in bounds if bound is not None]
    if known and max(known) < PRINTED["C"]:
        return (
            f"The printed f_G of A and of C exclude that C is the best under its own preference:"
            f" with the torques and speeds of these models, whatever their accelerations and"
            f" energy, A comes to at most {max(known):.3g} under C, less than the"
            f" {PRINTED['C']:.4g} that is printed for C."
        )
    return "The bound does not exclude that C is better than A under its own preference."


def _count(evidence: Evidence, *, value: bool = False, rank: bool = False) -> int:
    def holds(one: Assessment) -> bool:
        fitness = one.designs.optimality.fitness["C"]["C"]
        near = fitness is not None and 0.5 <= fitness / PRINTED["C"] <= 2.0
        good = fitness is not None and one.designs.optimality.beaten["C"] <= _BEST_SHARE
        return (near or not value) and (good or not rank)

    return sum(map(holds, evidence.choices()))


def _optima_head() -> list[str]:
    return [column for o in OPTIMA for column in (f"f_G of {o}", f"beat {o}")]


def _optima_row(one: Assessment) -> list[str]:
    cells = [one.label, _number(one.fitness)]
    for optimum in OPTIMA:
        place = one.designs.optimality.place(optimum)
        value = _number(one.designs.optimality.fitness[optimum][optimum])
        cells += [value, f"{_share(one, optimum)} ({_number(place)})"]
    return [*cells, f"{one.designs.optimality.failed:.1%}"]


def _share(one: Assessment, optimum: str) -> str:
    return f"{one.designs.optimality.beaten[optimum]:.1%}"


def _runs_head(evidence: Evidence) -> list[str]:
    return ["misfit", *(f"seed {number}" for number in range(1, len(evidence.runs) + 1))]


def _trust(evidence: Evidence, column: int) -> str:
    """Trust in a convention; of a categorical one the default and its changes count, too."""
    parameter = evidence.parameters.parameters[column]
    if parameter.trust is None:
        return "one calibration"
    if not parameter.choices:
        return str(parameter.trust)
    remaining = len(evidence.remaining(column))
    if remaining == len(parameter.choices):
        return "unknown"
    return "trusted" if remaining == 1 else "rough"


def _reached(simulated: float | None, off: float | None) -> tuple[str, str]:
    return _number(simulated), f"{off:+.2f}" if off is not None and np.isfinite(off) else "–"


def _left_out(view: Any) -> tuple[str, str]:
    return ("–", "–") if view is None else _reached(view.simulated, view.difference)


def _tolerance(tolerance: float, *, absolute: bool) -> str:
    return f"{tolerance:g} m" if absolute else f"{tolerance:.0%}"


def _value(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"


def _number(value: float | None) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{value:.4g}"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(headings)} |"
    yield f"|{' --- |' * len(headings)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"
