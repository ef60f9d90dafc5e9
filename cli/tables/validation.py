"""A comparison of a measured and a simulated walk as tables for people."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from rich.text import Text

from gaitswarm.cli.tables.fitted import Table
from gaitswarm.sim.validation import Tolerance

if TYPE_CHECKING:
    from gaitswarm.sim.validation import Agreement, Comparison, QuantityComparison

STYLES: Final = {
    Tolerance.GREEN: "green",
    Tolerance.YELLOW: "yellow",
    Tolerance.ORANGE: "dark_orange",
    Tolerance.RED: "red",
    Tolerance.PURPLE: "magenta",
}

_WITHIN: Final = {True: "inside", False: "outside"}


def comparison_table(comparison: Comparison) -> Table:
    """One row by quantity and link; supply and acceleration have one row each."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("quantity", no_wrap=True)
    for column in ("of", "mean |X|", "mean |Y|", "MSE", "MAE", "RMAE", "class", "RAM"):
        table.add_column(column, justify="left" if column in ("of", "class") else "right")
    for judged in comparison.quantities:
        for row, agreement in enumerate(judged.links or (judged.whole,)):
            style = STYLES[agreement.tolerance]
            cells: list[str | Text] = [
                _heading(judged) if row == 0 else "",
                agreement.name,
                f"{agreement.mean_absolute_measured:.4g}",
                f"{agreement.mean_absolute_simulated:.4g}",
                f"{agreement.mse:.3g}",
                f"{agreement.mae:.3g}",
                Text(percent(agreement.rmae), style=style),
                Text(agreement.tolerance, style=style),
                percent(agreement.ram),
            ]
            table.add_row(*cells)
    return table


def confidence_table(comparison: Comparison) -> Table:
    """Whether the simulated mean lies between those of repeated measurements (eq. 2.20)."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    for column in ("quantity", "of", "CONF of mean |X|", "mean |Y|", ""):
        table.add_column(column, no_wrap=True)
    for judged in comparison.quantities:
        for row, agreement in enumerate(judged.links or (judged.whole,)):
            table.add_row(
                _heading(judged) if row == 0 else "",
                agreement.name,
                confidence(agreement),
                f"{agreement.mean_absolute_simulated:.5g}",
                "" if agreement.within_confidence is None else _WITHIN[agreement.within_confidence],
            )
    return table


def confidence(agreement: Agreement) -> str:
    """CONF, from the least to the largest mean of the measurements."""
    if agreement.confidence is None:
        return ""
    low, high = agreement.confidence
    return f"{low:.5g} – {high:.5g}"


def _heading(judged: QuantityComparison) -> Text:
    # Not a plain string: rich takes [rad] for a style.
    return Text(f"{judged.quantity} [{judged.unit}]")


def percent(share: float) -> str:
    """`27.6 %`; `∞` for the error of a signal that was measured as zero."""
    return f"{share * 100:.1f} %" if math.isfinite(share) else "∞"


def alignment(comparison: Comparison) -> str:
    """What was compared, and how the logs were aligned."""
    order = "later" if comparison.lag >= 0.0 else "earlier"
    return (
        f"{comparison.cycles} cycle{'s' if comparison.cycles > 1 else ''} of"
        f" {comparison.cycle_time:g} s; the walk begins {abs(comparison.lag):g} s {order} in the"
        " measured log"
    )


def remarks(comparison: Comparison) -> list[str]:
    """What to know before one believes the table."""
    from gaitswarm.sim.measurement.measured_log import Quantity

    said = []
    if comparison.synthetic:
        said.append("the measured log is SYNTHETIC: this tests the toolkit, not the model")
    desired = comparison.quantity(Quantity.DESIRED_ANGLE).whole
    if desired.tolerance is not Tolerance.GREEN:
        said.append(
            f"the desired angles differ by {percent(desired.rmae)}: scenario, design or cycle time"
            " are probably not those of the measured walk"
        )
    return said
