"""The reconstruction's report: a folder of Markdown and pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from gaitswarm.cli.atomic_file import replacing
from gaitswarm.cli.reconstruction.evidence import PRINTED, Evidence, Found
from gaitswarm.cli.reconstruction.optimality import OPTIMA
from gaitswarm.services.optimizer.analysis.identifiability import (
    ParameterIdentifiability,
    Trust,
)
from gaitswarm.services.optimizer.analysis.targets import Reached

REPORT: Final = "report.md"

INTERVALS: Final = 5
"""Equal parts of a continuous convention's range."""

_BEST_SHARE: Final = 0.05
"""An optimum is to be among so many of the random designs."""


def write_report(folder: Path, found: Evidence) -> Path:
    """Write `report.md` and its pictures."""
    from gaitswarm.cli.pictures.plots import save
    from gaitswarm.cli.reconstruction.pictures import draw_choices, draw_exclusion, draw_targets

    save(draw_targets(found), folder / "targets.svg")
    save(draw_choices(found), folder / "choices.svg")
    save(draw_exclusion(found), folder / "exclusion.svg")
    text = "\n".join(_lines(found))
    with replacing(folder / REPORT, "output") as file:
        file.write(f"{text}\n".encode())
    return folder / REPORT


def _lines(found: Evidence) -> Iterator[str]:
    for section in (
        _head,
        _summary,
        _targets,
        _optima,
        _choices,
        _intervals,
        _one_at_a_time,
        _left_out,
        _predictions,
        _exclusion,
    ):
        yield from section(found)
        yield ""


def _head(found: Evidence) -> Iterator[str]:
    size, evaluated = found.size, sum(len(run) for run in found.runs)
    yield "# Reconstruction"
    yield ""
    yield (
        f"{len(found.runs)} calibrations of {size.particles} designs an iteration, {evaluated}"
        f" choices of conventions in all; {size.samples} random designs under the default and under"
        f" the best of each calibration, {size.samples_each} under every other choice. Written by"
        " `gaitswarm reconstruct`; how to read it is in docs/reconstruction.md of gaitswarm."
    )


def _summary(found: Evidence) -> Iterator[str]:
    winner = found.winner
    yield "## Summary"
    yield ""
    misfits = ", ".join(f"{best.fitness:.2f}" for best in found.best)
    yield (
        f"- Misfit (root mean square over the fitted rows, in tolerances): default"
        f" {found.default.fitness:.2f}; best of each calibration {misfits}."
    )
    for label, one in (("the default", found.default), (f"the {winner.label}", winner)):
        shares = ", ".join(f"{o} {_share(one, o)}" for o in OPTIMA)
        yield f"- Random designs that beat the optimum of a preference, under {label}: {shares}."
    names = {trust: _names(found, trust) for trust in Trust}
    yield f"- The evidence decides: {names[Trust.TRUSTED]}."
    yield f"- It narrows: {names[Trust.ROUGH]}."
    yield f"- It cannot tell: {names[Trust.UNKNOWN]}."
    yield f"- {_verdict(found)}"


def _names(found: Evidence, trust: Trust) -> str:
    chosen = [p for p in found.parameters.parameters if _trust(found, p) is trust]
    return ", ".join(_decided(found, p, trust) for p in chosen) or "nothing"


def _decided(found: Evidence, parameter: ParameterIdentifiability, trust: Trust) -> str:
    name = f"`{parameter.variable.name}`"
    if trust is Trust.UNKNOWN:
        return name
    if parameter.choices:
        return f"{name} ({', '.join(found.remaining(parameter))})"
    return f"{name} (best {parameter.best:.3g})"


def _targets(found: Evidence) -> Iterator[str]:
    yield "## Printed against simulated"
    yield ""
    yield "Off is in tolerances: 1 is a factor of 1 + tolerance too much, -1 as much too little."
    yield ""
    yield "![Every target's difference, in tolerances](targets.svg)"
    yield ""
    winner, spec = found.winner, found.spec
    off = [spec.differences(one.simulated[None, :])[0] for one in (found.default, winner)]
    rows = [
        [
            t.label,
            t.unit,
            f"{t.value:.4g}",
            _tolerance(t.tolerance, absolute=t.quantity == "height_loss"),
            *_reached(found.default.simulated[k], off[0][k]),
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
        [[f"`{n}`", _value(found.defaults[n]), _value(v)] for n, v in shown.items()],
    )


def _optima(found: Evidence) -> Iterator[str]:
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
        [_optima_row(one) for one in (found.default, *found.best)],
    )
    yield ""
    yield "Fitness of every optimum by every preference under the default:"
    yield ""
    fitness = found.default.walked.optimality.fitness
    yield from _table(
        ["preference", *OPTIMA],
        [[p, *(_number(fitness[p][o]) for o in OPTIMA)] for p in OPTIMA],
    )


def _choices(found: Evidence) -> Iterator[str]:
    yield "## Misfit by choice"
    yield ""
    yield (
        "Least misfit of all designs with a choice, over all calibrations and of each. A choice"
        " remains if a calibration has it among designs as good as its best, or if the default or"
        f" one change of it comes with it to {found.spec.as_good_as(found.winner.fitness):.3f}, as"
        " good as the best of all."
    )
    yield ""
    yield "![Least misfit by choice](choices.svg)"
    yield ""
    rows = [
        [
            f"`{p.variable.name}`",
            choice.name,
            _number(min(choice.fitness)),
            *map(_number, choice.fitness),
            "yes" if choice.name in found.remaining(p) else "no",
            _trusted(found, p),
        ]
        for p in found.parameters.parameters
        for choice in p.choices
    ]
    yield from _table(["convention", "choice", *_runs_head(found), "remains", "evidence"], rows)


def _intervals(found: Evidence) -> Iterator[str]:
    yield "## Misfit by interval"
    yield ""
    yield "The same of conventions that are numbers, in equal parts of what was searched."
    yield ""
    rows = []
    for column, p in enumerate(found.parameters.parameters):
        if p.choices:
            continue
        edges = np.linspace(p.variable.low, p.variable.high, INTERVALS + 1)
        for k, (low, high) in enumerate(pairwise(edges.tolist())):
            least = []
            for run in found.runs:
                values = run.designs[:, column]
                last = k + 1 == INTERVALS
                inside = (values >= low) & ((values <= high) if last else (values < high))
                least.append(float(run.fitness[inside].min(initial=np.inf)))
            part = f"{low:.3g} to {high:.3g}"
            rows.append(
                [
                    f"`{p.variable.name}`",
                    part,
                    *map(_number, (min(least), *least)),
                    _trusted(found, p),
                ]
            )
    yield from _table(["convention", "interval", *_runs_head(found), "evidence"], rows)


def _one_at_a_time(found: Evidence) -> Iterator[str]:
    yield "## One convention at a time"
    yield ""
    yield "What one change of the default does; the first row is the default itself."
    yield ""
    rows = [["default", "", *_optima_row(found.default)[1:]]]
    rows += [[f"`{a.variable.name}`", a.shown, *_optima_row(one)[1:]] for a, one in found.changed]
    yield from _table(["convention", "value", "misfit", *_optima_head(), "fail"], rows)


def _left_out(found: Evidence) -> Iterator[str]:
    yield "## Rows predicted from the others"
    yield ""
    yield (
        "Every fitted row by the choice that is best without it, and without all rows of its walk,"
        " from what the calibrations have evaluated."
    )
    yield ""
    rows = [
        [
            one.target.label,
            f"{one.target.value:.4g}",
            *_of(one.best),
            *_of(one.left_out),
            *_of(all_of_walk.left_out),
        ]
        for one, all_of_walk in zip(found.by_target.targets, found.by_walk.targets, strict=True)
        if one.target.use == "fit"
    ]
    head = ["row", "printed", "fitted", "off", "without row", "off", "without walk", "off"]
    yield from _table(head, rows)


def _predictions(found: Evidence) -> Iterator[str]:
    yield "## Published results that no row has"
    yield ""
    yield "Predicted: the other two optima of table 3.6, and f_G of B. None of them was fitted."
    yield ""
    for name, results in found.predictions["default"].items():
        yield f"{name}:"
        yield ""
        rows = [
            [label, *(_number(value) for value in predictions[name].values())]
            for label, predictions in found.predictions.items()
        ]
        yield from _table(["conventions", *results], rows)
        yield ""
    rows = [
        [one.label, _number(one.walked.optimality.fitness["B"]["B"])]
        for one in (found.default, *found.best)
    ]
    yield from _table(["conventions", "f_G of B"], rows)


def _exclusion(found: Evidence) -> Iterator[str]:
    yield "## Which published numbers exclude one another"
    yield ""
    yield "![Value of f_G of C against its rank](exclusion.svg)"
    yield ""
    yield (
        f"Of {len(list(found.choices()))} choices of conventions, C's value is within a factor of"
        f" two of the printed one under {_count(found, value=True)}, C is among the best"
        f" {_BEST_SHARE:.0%} of random designs under {_count(found, rank=True)}, and both hold"
        f" under {_count(found, value=True, rank=True)}."
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
    for one in (found.default, *found.best):
        bound = one.product_bound()
        means = one.walked.means.get("A", [np.nan] * 5)
        less = "" if bound is None else "yes" if bound < PRINTED["C"] else "no"
        rows.append([one.label, *(f"{means[m]:.3g}" for m in (0, 4)), _number(bound), less])
    head = ["conventions", "torque of A [N m]", "1/speed of A [s/m]", "f_C of A at most"]
    yield from _table([*head, f"below {PRINTED['C']:.4g}"], rows)
    yield ""
    yield _verdict(found)


def _verdict(found: Evidence) -> str:
    bounds = [one.product_bound() for one in (found.default, *found.best)]
    known = [bound for bound in bounds if bound is not None]
    if known and max(known) < PRINTED["C"]:
        return (
            f"The printed f_G of A and of C exclude that C is the best under its own preference:"
            f" with the torques and speeds of these models, whatever their accelerations and"
            f" energy, A comes to at most {max(known):.3g} under C, less than the"
            f" {PRINTED['C']:.4g} that is printed for C."
        )
    return "The bound does not exclude that C is better than A under its own preference."


def _count(found: Evidence, *, value: bool = False, rank: bool = False) -> int:
    def holds(one: Found) -> bool:
        fitness = one.walked.optimality.fitness["C"]["C"]
        near = fitness is not None and 0.5 <= fitness / PRINTED["C"] <= 2.0
        good = fitness is not None and one.walked.optimality.beaten["C"] <= _BEST_SHARE
        return (near or not value) and (good or not rank)

    return sum(map(holds, found.choices()))


def _optima_head() -> list[str]:
    return [column for o in OPTIMA for column in (f"f_G of {o}", f"beat {o}")]


def _optima_row(one: Found) -> list[str]:
    cells = [one.label, _number(one.fitness)]
    for optimum in OPTIMA:
        place = one.walked.optimality.place(optimum)
        value = _number(one.walked.optimality.fitness[optimum][optimum])
        cells += [value, f"{_share(one, optimum)} ({_number(place)})"]
    return [*cells, f"{one.walked.optimality.failed:.1%}"]


def _share(one: Found, optimum: str) -> str:
    return f"{one.walked.optimality.beaten[optimum]:.1%}"


def _runs_head(found: Evidence) -> list[str]:
    return ["misfit", *(f"seed {number}" for number in range(1, len(found.runs) + 1))]


def _trust(found: Evidence, parameter: ParameterIdentifiability) -> Trust | None:
    """Of a categorical convention with what the default and its changes tell."""
    if parameter.trust is None or not parameter.choices:
        return parameter.trust
    remaining = len(found.remaining(parameter))
    if remaining == len(parameter.choices):
        return Trust.UNKNOWN
    return Trust.TRUSTED if remaining == 1 else Trust.ROUGH


def _trusted(found: Evidence, parameter: ParameterIdentifiability) -> str:
    trust = _trust(found, parameter)
    return "one calibration" if trust is None else trust.value


def _reached(simulated: float, off: float) -> tuple[str, str]:
    return _number(float(simulated)), f"{off:+.2f}" if np.isfinite(off) else "–"


def _of(reached: Reached | None) -> tuple[str, str]:
    return ("–", "–") if reached is None else _reached(reached.simulated, reached.difference)


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
