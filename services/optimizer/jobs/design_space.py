"""The box in which an optimizer searches, and the designs that its points stand for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from services.optimizer.errors import InvalidRequest
from sim.errors import SimulationInputError
from sim.variables import Variable


@dataclass(frozen=True, slots=True)
class DesignSpace:
    """Variables with bounds, and values held fixed.

    A *position* is a point of the box, (d,) in the variables' own units. A *design* is what is
    simulated: integer variables rounded, fixed values appended; its columns are `names`.

    Attributes:
        variables: the d that are searched.
        fixed: names and values of the others.
    """

    variables: tuple[Variable, ...]
    fixed: tuple[tuple[str, float], ...] = ()

    @classmethod
    def build(
        cls,
        *,
        required: Sequence[Variable],
        optional: Sequence[Variable],
        chosen: Sequence[str | Variable] | None,
        fixed: Mapping[str, float],
    ) -> DesignSpace:
        """Combine a catalogue with a user's choice.

        Args:
            required: variables of which every one must be chosen or fixed: the controller's.
            optional: variables that may be: the gait's.
            chosen: what is searched, by name with the catalogue's bounds, or with bounds of one's
                own; None for all that are required, less those that are fixed.
            fixed: value of each variable that is held, by name.

        Returns:
            The space, its variables in the order of `chosen`.

        Raises:
            ValueError: the choice makes no sense; names the variable and the way out.
        """
        catalogue = {variable.name: variable for variable in (*required, *optional)}
        known = ", ".join(catalogue)
        if chosen is None:
            chosen = [variable for variable in required if variable.name not in fixed]
        variables: list[Variable] = []
        for entry in chosen:
            name = entry if isinstance(entry, str) else entry.name
            if name not in catalogue:
                raise ValueError(f"variables: unknown variable {name!r}; known are {known}")
            if any(variable.name == name for variable in variables):
                raise ValueError(f"variables: {name!r} is named twice")
            if name in fixed:
                raise ValueError(f"fixed: {name!r} is also among the variables; choose one")
            variables.append(_checked(entry, catalogue[name]))
        for name in fixed:
            if name not in catalogue:
                raise ValueError(f"fixed: unknown variable {name!r}; known are {known}")
        covered = {variable.name for variable in variables} | set(fixed)
        missing = [variable.name for variable in required if variable.name not in covered]
        if missing:
            raise ValueError(
                f"variables: {', '.join(missing)} neither searched nor fixed; the controller"
                " needs every one of its variables"
            )
        if not variables:
            raise ValueError("variables: nothing is left to search, every variable is fixed")
        return cls(tuple(variables), tuple(fixed.items()))

    @property
    def names(self) -> tuple[str, ...]:
        """Columns of a design array: the variables, then the fixed values."""
        return tuple(variable.name for variable in self.variables) + tuple(
            name for name, _ in self.fixed
        )

    @property
    def low(self) -> NDArray[np.float64]:
        """(d,) lower bounds."""
        return np.array([variable.low for variable in self.variables])

    @property
    def high(self) -> NDArray[np.float64]:
        """(d,) upper bounds."""
        return np.array([variable.high for variable in self.variables])

    def designs(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is simulated for points of the box.

        Args:
            positions: (n, d), inside the bounds.

        Returns:
            (n, len(names)), integer variables rounded and fixed values appended.
        """
        columns = np.empty((len(positions), len(self.names)))
        for j, variable in enumerate(self.variables):
            column = positions[:, j]
            columns[:, j] = np.rint(column) if variable.kind == "integer" else column
        for j, (_, value) in enumerate(self.fixed, start=len(self.variables)):
            columns[:, j] = value
        return columns

    def corners(self) -> Iterator[dict[str, float]]:
        """The designs at the lower and at the upper ends of all bounds, by variable."""
        for corner in (self.low, self.high):
            (values,) = self.designs(corner.reshape(1, -1))
            yield dict(zip(self.names, values.tolist(), strict=True))

    def refusal(self, error: SimulationInputError) -> InvalidRequest:
        """An error in a design as one of the spec's field that the design has the value from.

        Args:
            error: begins with the name of the variable that is to blame, and a colon.

        Returns:
            The same message about `variables` or `fixed`.
        """
        culprit = str(error).partition(":")[0]
        return InvalidRequest(
            str(error), field="fixed" if culprit in dict(self.fixed) else "variables"
        )


def _checked(entry: str | Variable, known: Variable) -> Variable:
    """A user's own bounds keep the catalogue's kind and unit."""
    if isinstance(entry, str):
        return known
    if entry.kind != known.kind and known.kind == "integer":
        raise ValueError(f"variables: {entry.name} is an integer variable; set kind to 'integer'")
    return entry.model_copy(
        update={"unit": known.unit, "description": entry.description or known.description}
    )
