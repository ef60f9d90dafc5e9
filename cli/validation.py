"""Comparisons of measured and simulated walks as tables, pictures and reports."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitswarm.cli.output import replacing
from gaitswarm.cli.tables import table
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.measurement.measured_log import Quantity
from gaitswarm.sim.validation import Tolerance

if TYPE_CHECKING:
    from rich.table import Table

    from gaitswarm.sim.measurement.measured_log import Synchronised
    from gaitswarm.sim.validation import Agreement, Comparison, QuantityComparison, Verdict

REPORT: Final = "report.md"


def write_report(
    folder: Path, comparison: Comparison, pair: Synchronised, facts: Mapping[str, str]
) -> Path:
    """Write `report.md` and its pictures, and return the report's path."""
    from gaitswarm.cli import pictures

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidRequest(f"cannot create {folder}: {error.strerror}", field="report") from error
    pictures.save(pictures.draw_errors(comparison), folder / "rmae.png")
    pictures.save(pictures.draw_joints(pair, Quantity.JOINT_ANGLE), folder / "angles.png")
    pictures.save(pictures.draw_joints(pair, Quantity.CURRENT), folder / "currents.png")
    pictures.save(pictures.draw_current_maps(pair), folder / "maps.png")
    pictures.save(pictures.draw_battery(pair), folder / "battery.png")
    pictures.save(pictures.draw_spectra(pair, Quantity.CURRENT), folder / "spectra.png")
    text = "\n".join(_lines(comparison, facts))
    with replacing(folder / REPORT, "report") as file:
        file.write(f"{text}\n".encode())
    return folder / REPORT


def _lines(comparison: Comparison, facts: Mapping[str, str]) -> Iterable[str]:
    def picture(heading: str, text: str, file: str) -> list[str]:
        return [f"## {heading}", "", f"![{text}]({file}.png)", ""]

    yield from ("# Validation", "")
    for remark in remarks(comparison):
        yield from (f"**Note:** {remark}.", "")
    common = {
        "compared": f"{alignment(comparison)}; {comparison.samples} rows",
        "desired angles": f"correlation {comparison.correlation:.6f}",
        "repeats": str(comparison.repeats),
    }
    yield from _table(["", ""], [[k, v] for k, v in {**facts, **common}.items()])
    yield from ("", "## Verdict", "")
    yield from (f"- {line}" for line in verdict_lines(comparison.verdict))
    yield from ("", "X is measured, Y simulated; formulas are in docs/validation.md of gaitswarm.")
    yield from ("", "![RMAE by quantity and link](rmae.png)", "")
    yield from ("## Tolerance classes of RMAE", "")
    classes = [[tolerance.value, _range(tolerance), tolerance.phrase] for tolerance in Tolerance]
    yield from _table(["class", "RMAE", "meaning"], classes)
    yield from ("", "## By quantity and link", "")
    yield from _agreements(
        (judged, agreement)
        for judged in comparison.quantities
        for agreement in (*judged.links, judged.whole)
    )
    yield ""
    yield from picture("Joint angles", "Joint angles over time", "angles")
    yield from picture("Motor currents", "Motor currents over time", "currents")
    yield from picture("Motor currents over the cycle", "Current by joint and phase", "maps")
    yield from picture("Battery", "Sum of motor currents, and current of the battery", "battery")
    yield from (battery(comparison), "")
    yield from ("## Spectra of the motor currents", "")
    spectra = comparison.quantity(Quantity.CURRENT).spectra
    yield from _table(
        ["link", "spectral error"], [[s.name, percent(s.spectral_error)] for s in spectra]
    )
    yield from ("", "![Amplitude spectra of the motor currents](spectra.png)")
    for judged in comparison.quantities:
        yield from ("", f"## {judged.quantity}: {judged.meaning}", "")
        yield from _agreements((judged, agreement) for agreement in judged.channels)


def _agreements(rows: Iterable[tuple[QuantityComparison, Agreement]]) -> Iterable[str]:
    columns = ["quantity", "of", "mean X", "mean Y", "MSE", "MAE", "RMAE", "class", "DAM", "RAM"]
    yield from _table(
        [*columns, "intensity X", "intensity Y", "CONF"],
        [
            [
                f"{judged.quantity} [{judged.unit}]",
                a.name,
                *(f"{x:.4g}" for x in (a.mean_absolute_measured, a.mean_absolute_simulated)),
                *(f"{x:.3g}" for x in (a.mse, a.mae)),
                percent(a.rmae),
                a.tolerance.value,
                f"{a.dam:.3g}",
                percent(a.ram),
                *(f"{x:.3g}" for x in (a.intensity_measured, a.intensity_simulated)),
                confidence(a),
            ]
            for judged, a in rows
        ],
    )


def _range(tolerance: Tolerance) -> str:
    classes = list(Tolerance)
    low = 0.0 if tolerance is classes[0] else classes[classes.index(tolerance) - 1].limit
    if tolerance is classes[-1]:
        return f"above {low * 100:.0f} %"
    return f"{low * 100:.0f} to {tolerance.limit * 100:.0f} %"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterable[str]:
    yield f"| {' | '.join(headings)} |"
    yield f"|{' --- |' * len(headings)}"
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"


STYLES: Final = {
    Tolerance.GREEN: "green",
    Tolerance.YELLOW: "yellow",
    Tolerance.ORANGE: "dark_orange",
    Tolerance.RED: "red",
    Tolerance.PURPLE: "magenta",
}


def _by_link(comparison: Comparison) -> Iterator[tuple[str, Agreement]]:
    """Yield agreements by link, or of the whole robot, and the quantity with each first one."""
    for judged in comparison.quantities:
        for row, agreement in enumerate(judged.links or (judged.whole,)):
            yield "" if row else f"{judged.quantity} [{judged.unit}]", agreement


def comparison_table(comparison: Comparison) -> Table:
    """Return a table with one row per quantity and link; one for supply and acceleration."""
    heads = ("quantity", "<of", "mean |X|", "mean |Y|", "MSE", "MAE", "RMAE", "<class", "RAM")
    rows = (
        (
            *(quantity, a.name),
            *(f"{x:.4g}" for x in (a.mean_absolute_measured, a.mean_absolute_simulated)),
            *(f"{x:.3g}" for x in (a.mse, a.mae)),
            *((text, STYLES[a.tolerance]) for text in (percent(a.rmae), a.tolerance.value)),
            percent(a.ram),
        )
        for quantity, a in _by_link(comparison)
    )
    return table(heads, rows, gap=1)


def verdict_lines(verdict: Verdict) -> Iterator[str]:
    """Yield the verdict, and the reason of each failed gate."""
    passed = ", ".join(gate.quantity for gate in verdict.gates if gate.passed) or "none"
    yield f"{'validated' if verdict.validated else 'not validated'}; passed: {passed}"
    for gate in verdict.gates:
        if not gate.passed:
            end = " (a digital signal: this ends it)" if gate.quantity.digital else ""
            yield f"{gate.quantity} failed{end}: {gate.reason}"


def battery(comparison: Comparison) -> str:
    """Describe the sum of the motors' currents, and the battery's current."""
    motors = comparison.battery.motors

    def part(name: str, summed: float, against: Agreement | None) -> str:
        drawn = (
            "" if against is None else f", {against.mean_absolute_measured:.4g} A of the battery"
        )
        return f"{name} {summed:.4g} A{drawn}"

    return (
        "sum of the motors' currents, mean: "
        f"{part('measured', motors.mean_absolute_measured, comparison.battery.measured)};"
        f" {part('simulated', motors.mean_absolute_simulated, comparison.battery.simulated)};"
        f" RMAE of the sum {percent(motors.rmae)}"
    )


def confidence_table(comparison: Comparison) -> Table:
    """Return a table of simulated means within repeated measurements (eq. 2.20)."""
    within = {None: "", True: "inside", False: "outside"}
    rows = (
        (
            *(quantity, a.name, confidence(a), f"{a.mean_absolute_simulated:.5g}"),
            within[a.within_confidence],
        )
        for quantity, a in _by_link(comparison)
    )
    heads = ("quantity", "<of", "<CONF of mean |X|", "<mean |Y|", "<")
    return table(heads, rows, gap=1)


def confidence(agreement: Agreement) -> str:
    """Format CONF, the smallest and largest mean of the measurements."""
    if agreement.confidence is None:
        return ""
    low, high = agreement.confidence
    return f"{low:.5g} – {high:.5g}"


def percent(share: float) -> str:
    """Format a share; `∞` for the error of a signal measured as zero."""
    return f"{share * 100:.1f} %" if math.isfinite(share) else "∞"


def alignment(comparison: Comparison) -> str:
    """Describe the compared cycles and the alignment of the logs."""
    order = "later" if comparison.lag >= 0.0 else "earlier"
    return (
        f"{comparison.cycles} cycle{'s' if comparison.cycles > 1 else ''} of"
        f" {comparison.cycle_time:g} s; the walk begins {abs(comparison.lag):g} s {order} in the"
        " measured log"
    )


def remarks(comparison: Comparison) -> list[str]:
    notes = []
    if comparison.synthetic:
        notes.append("the measured log is SYNTHETIC: this tests the toolkit, not the model")
    desired = comparison.quantity(Quantity.DESIRED_ANGLE).whole
    if desired.tolerance is not Tolerance.GREEN:
        notes.append(
            f"the desired angles differ by {percent(desired.rmae)}: scenario, design or cycle time"
            " are probably not those of the measured walk"
        )
    return notes
