"""Every published number that can be simulated, side by side with print."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from gaitswarm import CONTROLLERS, SCENARIOS, simulate

QUANTITIES: Final = ("torque", "acceleration", "angular_acceleration", "energy", "speed")


@dataclass(frozen=True, slots=True)
class Published:
    """One published optimum.

    Attributes:
        results: Torque [N m], acceleration [m/s2], angular acceleration [rad/s2], energy [J/m] and
            speed [m/s] of table 3.6; empty in chapter 4.
        fitness: F of eq. 3.1, or f_G of table 4.6.
        use: Whether conventions of the model were chosen by its numbers.
    """

    label: str
    controller: str
    design: str
    preference: Literal["A", "B", "C", "chapter-3"]
    use: Literal["fitted", "held out"]
    results: tuple[float, ...]
    fitness: float


PUBLISHED: Final = (
    Published(
        *("Fuzzy-PI by PSO-PS", "fuzzy-pi-3", "fuzzy-pso-ps", "chapter-3", "fitted"),
        (8.71, 1.77, 16.09, 41.96, 0.156),
        6.887,
    ),
    Published(
        *("PI by PSO-PS", "pi", "pi-pso-ps", "chapter-3", "fitted"),
        (8.82, 1.77, 16.39, 42.55, 0.152),
        5.644,
    ),
    Published(
        *("Fuzzy-PI by PSO", "fuzzy-pi-3", "fuzzy-pso", "chapter-3", "held out"),
        (9.09, 1.89, 17.09, 41.05, 0.163),
        6.209,
    ),
    Published(
        *("PI by PSO", "pi", "pi-pso", "chapter-3", "held out"),
        (9.12, 1.80, 17.2, 42.5, 0.152),
        5.171,
    ),
    Published("A", "fuzzy-pi", "A", "A", "fitted", (), 20.8696),
    Published("C", "fuzzy-pi", "C", "C", "fitted", (), 1396908.0),
    Published("B", "fuzzy-pi", "B", "B", "held out", (), 59.5132),
)
"""Tables 3.6 and 4.6. Of the first two rows the targets are the results, not F."""


def deviations() -> str:
    """Simulate the published optima on the default model; return a table in Markdown."""
    return "\n".join(_lines())


def _lines() -> Iterator[str]:
    yield "| optimum | | torque | acc. | ang. acc. | energy | speed | F or f_G |"
    yield f"|{' --- |' * 8}"
    for row in PUBLISHED:
        yield f"| {' | '.join([row.label, row.use, *_cells(row)])} |"


def _cells(row: Published) -> Iterator[str]:
    result = simulate(
        CONTROLLERS[row.controller].published[row.design],
        controller=row.controller,
        preference=row.preference,
        scenarios=["straight"] if row.results else list(SCENARIOS),
    )
    if not row.results:
        yield from [""] * len(QUANTITIES)
        yield _compared(row.fitness, float(result.fitness[0]))
        return
    walk = result["straight"]
    for name, printed in zip(QUANTITIES, row.results, strict=True):
        values = walk.measurements if name == "speed" else walk.objectives
        yield _compared(printed, float(values[name][0]))
    yield _compared(row.fitness, float(result.figure_of_merit[0]))


def _compared(printed: float, simulated: float) -> str:
    change = f"{100.0 * (simulated / printed - 1.0):+.0f} %"
    return f"{_number(printed)} → {_number(simulated)}, {change}"


def _number(value: float) -> str:
    return f"{value:,.0f}".replace(",", " ") if value >= 1e5 else f"{value:.4g}"
