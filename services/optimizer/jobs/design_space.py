"""The box in which an optimizer searches, and the designs that its points stand for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import Variable, VariableCatalogue


@dataclass(frozen=True, slots=True)
class DesignSpace:
    """Variables with bounds, and values held fixed.

    A *position* is a point of the box, (d,) in the variables' own units. A *design* is what is
    judged and stored: integer variables rounded, of categorical ones the index of a choice, fixed
    values appended; its columns are `names`.

    Attributes:
        variables: the d that are searched.
        fixed: names and values of the others.
        catalogue: all of these as the simulator knows them, in the order of `names`; of a
            categorical variable with all of its choices.
    """

    variables: tuple[Variable, ...]
    fixed: tuple[tuple[str, float], ...]
    catalogue: tuple[Variable, ...]

    @classmethod
    def build(
        cls,
        *,
        required: Sequence[Variable],
        optional: Sequence[Variable],
        chosen: Sequence[str | Variable] | None,
        fixed: Mapping[str, float | str],
    ) -> DesignSpace:
        """Combine a catalogue with a user's choice."""
        catalogue = VariableCatalogue((*required, *optional))
        held = _held(fixed, catalogue)
        if chosen is None:
            chosen = [variable for variable in required if variable.name not in fixed]
        variables: list[Variable] = []
        for entry in chosen:
            name = entry if isinstance(entry, str) else entry.name
            if name not in catalogue:
                raise ValueError(
                    f"variables: unknown variable {name!r}; {instead_of(name, catalogue)}"
                )
            if any(variable.name == name for variable in variables):
                raise ValueError(f"variables: {name!r} is named twice")
            if name in fixed:
                raise ValueError(f"fixed: {name!r} is also among the variables; choose one")
            variables.append(_checked(entry, catalogue[name]))
        covered = {variable.name for variable in variables} | set(fixed)
        missing = [variable.name for variable in required if variable.name not in covered]
        if missing:
            raise ValueError(
                f"variables: {', '.join(missing)} neither searched nor fixed; the controller"
                " needs every one of its variables"
            )
        if not variables:
            raise ValueError("variables: nothing is left to search, every variable is fixed")
        names = (*(variable.name for variable in variables), *fixed)
        return cls(tuple(variables), held, tuple(catalogue[name] for name in names))

    @property
    def names(self) -> tuple[str, ...]:
        """Columns of a design array: the variables, then the fixed values."""
        return tuple(variable.name for variable in self.variables) + tuple(
            name for name, _ in self.fixed
        )

    @property
    def box(self) -> Space:
        """The box of the variables that are searched."""
        return Space([Axis(v.low, v.high, v.kind) for v in self.variables])

    @property
    def low(self) -> NDArray[np.float64]:
        """(d,) lower bounds."""
        return self.box.low

    @property
    def high(self) -> NDArray[np.float64]:
        """(d,) upper bounds."""
        return self.box.high

    @property
    def columns(self) -> tuple[Variable, ...]:
        """The variable of each column of a design array, as `names`."""
        return (*self.variables, *self.catalogue[len(self.variables) :])

    def designs(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is judged and stored for points of the box."""
        held = np.array([value for _, value in self.fixed], dtype=np.float64)
        return np.hstack([self.box.designs(positions), np.tile(held, (len(positions), 1))])

    def positions(self, designs: Sequence[Mapping[str, float | str]]) -> NDArray[np.float64]:
        """Points of the box for designs as people give them, of which `designs` gives them back."""
        held = {v.name: value for v, (_, value) in zip(self._held, self.fixed, strict=True)}
        rows = []
        for index, design in enumerate(designs):
            for name, value in design.items():
                if name in held:
                    self._check_held(f"{index}.{name}", name, value, held[name])
                elif name not in self.names:
                    raise ValueError(
                        f"{index}.{name}: no variable of this job, which searches"
                        f" {', '.join(v.name for v in self.variables)}; leave it out"
                    )
            rows.append([_searched(index, v, design) for v in self.variables])
        return self.box.positions(np.array(rows).reshape(len(rows), len(self.variables)))

    @property
    def _held(self) -> tuple[Variable, ...]:
        """The variables that are fixed, with all of their choices."""
        return self.catalogue[len(self.variables) :]

    def _check_held(self, where: str, name: str, value: float | str, held: float) -> None:
        known = next(variable for variable in self._held if variable.name == name)
        if _number(where, known, value) != held:
            raise ValueError(
                f"{where}: {value} is not what this job holds it at, {known.shown(held)}; leave it"
                " out, or change `fixed`"
            )

    def simulated(self, designs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Designs as the simulator takes them, which knows every choice of its catalogue."""
        translated = designs.copy()
        for j, (own, known) in enumerate(zip(self.columns, self.catalogue, strict=True)):
            if own.choices != known.choices:
                index = np.array([known.number(choice) for choice in own.choices])
                translated[:, j] = index[designs[:, j].astype(np.intp)]
        return translated

    def shown(self, design: Iterable[float]) -> dict[str, float | str]:
        """A design as people read it."""
        return {
            variable.name: variable.shown(value)
            for variable, value in zip(self.columns, design, strict=True)
        }

    @property
    def shown_fixed(self) -> dict[str, float | str]:
        """The fixed values as people read them, by name."""
        return {
            v.name: v.shown(value) for v, (_, value) in zip(self._held, self.fixed, strict=True)
        }

    def corners(self) -> Iterator[dict[str, float]]:
        """What is simulated at the lower and at the upper ends of all bounds, by variable."""
        for corner in (self.low, self.high):
            (values,) = self.simulated(self.designs(corner.reshape(1, -1)))
            yield dict(zip(self.names, values.tolist(), strict=True))

    def refusal(self, error: SimulationInputError) -> InvalidRequest:
        """An error in a design as one of the spec's field that the design has the value from."""
        culprit = str(error).partition(":")[0]
        return InvalidRequest(
            str(error), field="fixed" if culprit in dict(self.fixed) else "variables"
        )


def _held(
    fixed: Mapping[str, float | str], catalogue: Mapping[str, Variable]
) -> tuple[tuple[str, float], ...]:
    """Names and numbers of fixed values."""
    held = []
    for name, value in fixed.items():
        if name not in catalogue:
            raise ValueError(f"fixed: unknown variable {name!r}; {instead_of(name, catalogue)}")
        try:
            held.append((name, catalogue[name].number(value)))
        except ValueError as error:
            raise ValueError(f"fixed: {error}") from error
    return tuple(held)


def _searched(index: int, variable: Variable, design: Mapping[str, float | str]) -> float:
    """The number of a searched variable in a design."""
    where = f"{index}.{variable.name}"
    if variable.name not in design:
        raise ValueError(f"{where}: missing; a design gives every variable that is searched")
    number = _number(where, variable, design[variable.name])
    if variable.kind == "integer" and not number.is_integer():
        raise ValueError(f"{where}: {number:g} is no whole number")
    if not variable.low <= number <= variable.high:
        raise ValueError(
            f"{where}: {number:g} is outside the bounds {variable.low:g} to {variable.high:g};"
            " widen them in `variables`, or leave the design out"
        )
    return number


def _number(where: str, variable: Variable, value: float | str) -> float:
    try:
        return variable.number(value)
    except ValueError as error:
        raise ValueError(f"{where}: {str(error).removeprefix(f'{variable.name}: ')}") from error


def _checked(entry: str | Variable, known: Variable) -> Variable:
    """A user's own bounds or choices keep the catalogue's kind and unit."""
    if isinstance(entry, str):
        return known
    # A continuous variable may be searched in whole numbers.
    if entry.kind != known.kind and (known.kind != "continuous" or entry.kind == "categorical"):
        article = "an" if known.kind == "integer" else "a"
        raise ValueError(
            f"variables: {entry.name} is {article} {known.kind} variable; set kind to"
            f" {known.kind!r}"
        )
    for choice in entry.choices:
        if choice not in known.choices:
            raise ValueError(
                f"variables: {choice!r} is none of the choices of {entry.name}; they are"
                f" {', '.join(known.choices)}"
            )
    return entry.model_copy(
        update={"unit": known.unit, "description": entry.description or known.description}
    )
