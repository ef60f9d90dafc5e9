"""A comparison of a measured and a simulated walk as a folder: Markdown and pictures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitswarm.cli.atomic_file import replacing
from gaitswarm.cli.tables.validation import alignment, confidence, percent, remarks
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.measurement.measured_log import Quantity
from gaitswarm.sim.validation import Tolerance

if TYPE_CHECKING:
    from gaitswarm.sim.measurement.synchronise import Synchronised
    from gaitswarm.sim.validation import Agreement, Comparison, QuantityComparison

REPORT: Final = "report.md"


def write_report(
    folder: Path, comparison: Comparison, pair: Synchronised, facts: Mapping[str, str]
) -> Path:
    """Write `report.md` and its pictures; returns the path of the report.

    facts: what was compared, by heading. Raises InvalidRequest if the folder cannot be written.
    """
    from gaitswarm.cli.pictures.plots import save
    from gaitswarm.cli.pictures.validation import draw_errors, draw_leg, draw_spectra

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidRequest(f"cannot make {folder}: {error.strerror}", field="report") from error
    save(draw_errors(comparison), folder / "rmae.png")
    save(draw_leg(pair, Quantity.JOINT_ANGLE), folder / "angles.png")
    save(draw_leg(pair, Quantity.CURRENT), folder / "currents.png")
    save(draw_spectra(pair, Quantity.CURRENT), folder / "spectra.png")
    text = "\n".join(_lines(comparison, facts, leg=pair.measured.legs[0]))
    with replacing(folder / REPORT, "report") as file:
        file.write(f"{text}\n".encode())
    return folder / REPORT


def _lines(comparison: Comparison, facts: Mapping[str, str], *, leg: str) -> Iterable[str]:
    yield "# Validation"
    yield ""
    for remark in remarks(comparison):
        yield f"**Note:** {remark}."
        yield ""
    common = {
        "compared": f"{alignment(comparison)}; {comparison.samples} rows",
        "desired angles": f"correlation {comparison.correlation:.6f}",
        "repeats": str(comparison.repeats),
    }
    yield from _table(["", ""], [[k, v] for k, v in {**facts, **common}.items()])
    yield ""
    yield "X is measured, Y simulated; formulas are in docs/validation.md of gaitswarm."
    yield ""
    yield "![RMAE by quantity and link](rmae.png)"
    yield ""
    yield "## Tolerance classes of RMAE"
    yield ""
    classes = [[known.value, _range(known), known.phrase] for known in Tolerance]
    yield from _table(["class", "RMAE", "meaning"], classes)
    yield ""
    yield "## By quantity and link"
    yield ""
    yield from _agreements(
        (judged, agreement)
        for judged in comparison.quantities
        for agreement in (*judged.links, judged.whole)
    )
    yield ""
    yield f"## Joint angles of {leg}"
    yield ""
    yield "![Joint angles over time](angles.png)"
    yield ""
    yield f"## Motor currents of {leg}"
    yield ""
    yield "![Motor currents over time](currents.png)"
    yield ""
    yield "## Spectra of the motor currents"
    yield ""
    spectra = comparison.quantity(Quantity.CURRENT).spectra
    yield from _table(
        ["link", "spectral error"], [[s.name, percent(s.spectral_error)] for s in spectra]
    )
    yield ""
    yield "![Amplitude spectra of the motor currents](spectra.png)"
    for judged in comparison.quantities:
        yield ""
        yield f"## {judged.quantity}: {judged.meaning}"
        yield ""
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
    known = list(Tolerance)
    low = 0.0 if tolerance is known[0] else known[known.index(tolerance) - 1].limit
    if tolerance is known[-1]:
        return f"above {low * 100:.0f} %"
    return f"{low * 100:.0f} to {tolerance.limit * 100:.0f} %"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterable[str]:
    yield f"| {' | '.join(headings)} |"
    yield f"|{' --- |' * len(headings)}"
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
