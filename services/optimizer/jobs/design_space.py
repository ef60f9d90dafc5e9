"""The search space, and the mapping between its points and designs"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import Variable, VariableCatalogue


@dataclass(frozen=True, slots=True)
class DesignSpace:
    """Searched variables with their bounds, and fixed values.

    A *position* is a point of the box, (d,). A *design* is what is judged and stored: integer
    variables rounded, categorical ones as the index of a choice, fixed values appended.
    """

    variables: tuple[Variable, ...]  # the d searched variables
    fixed: tuple[tuple[str, float], ...]  # names and values of the others
    # all of these in the simulator's catalogue, ordered as `names`, categorical ones with all of
    # their choices
    catalogue: tuple[Variable, ...]

    @classmethod
    def build(
        cls,
        *,
        required: Sequence[Variable] = (),
        optional: Sequence[Variable],
        default: Sequence[Variable] | None = None,
        chosen: Sequence[str | Variable] | None,
        fixed: Mapping[str, float | str],
    ) -> DesignSpace:
        """Combine a catalogue with a user's choice. Raises ValueError."""
        catalogue = VariableCatalogue((*required, *optional))
        fixed_values = _fixed_values(fixed, catalogue)
        if chosen is None:
            chosen = [v for v in (required if default is None else default) if v.name not in fixed]
        variables: dict[str, Variable] = {}
        for entry in chosen:
            name = entry if isinstance(entry, str) else entry.name
            if name not in catalogue:
                raise ValueError(
                    f"variables: unknown variable {name!r}; {instead_of(name, catalogue)}"
                )
            if name in variables:
                raise ValueError(f"variables: {name!r} is named twice")
            if name in fixed:
                raise ValueError(f"fixed: {name!r} is also among the variables; remove one")
            variables[name] = _checked(entry, catalogue[name])
        names = (*variables, *fixed)
        missing = [variable.name for variable in required if variable.name not in names]
        if missing:
            raise ValueError(
                f"variables: {', '.join(missing)} neither searched nor fixed; search or"
                " fix every one"
            )
        if not variables:
            raise ValueError("variables: every variable is fixed; leave at least one to search")
        searched = tuple(variables.values())
        return cls(searched, fixed_values, tuple(catalogue[name] for name in names))

    @property
    def names(self) -> tuple[str, ...]:
        """Columns of a design array: searched variables, then fixed ones."""
        return tuple(variable.name for variable in self.catalogue)

    @property
    def box(self) -> Space:
        return Space([Axis(v.low, v.high, v.kind) for v in self.variables])

    @property
    def middle(self) -> Floats:
        return (self.box.low + self.box.high) / 2.0

    @property
    def columns(self) -> tuple[Variable, ...]:
        """The variable of each column of a design array."""
        return (*self.variables, *self.catalogue[len(self.variables) :])

    def designs(self, positions: Floats) -> Floats:
        """Return the (n, v) designs of (n, d) positions."""
        held = np.array([value for _, value in self.fixed], dtype=np.float64)
        return np.hstack([self.box.designs(positions), np.tile(held, (len(positions), 1))])

    def positions(self, designs: Sequence[Mapping[str, float | str]]) -> Floats:
        """Return the positions of designs given by name. Raises ValueError."""
        held = dict(self.fixed)
        rows = []
        for index, design in enumerate(designs):
            for name, value in design.items():
                if name in held:
                    variable = next(variable for variable in self.columns if variable.name == name)
                    if _number(f"{index}.{name}", variable, value) != held[name]:
                        raise ValueError(
                            f"{index}.{name}: {value} is not the job's fixed value,"
                            f" {variable.shown(held[name])}; omit it or change `fixed`"
                        )
                elif name not in self.names:
                    raise ValueError(
                        f"{index}.{name}: no variable of this job, which searches"
                        f" {', '.join(v.name for v in self.variables)}; leave it out"
                    )
            rows.append([_searched(index, v, design) for v in self.variables])
        return self.box.positions(np.array(rows).reshape(len(rows), len(self.variables)))

    def simulated(self, designs: Floats) -> Floats:
        """Translate designs to the simulator's catalogue, with its indices of choices."""
        translated = designs.copy()
        for j, (column, full) in enumerate(zip(self.columns, self.catalogue, strict=True)):
            if column.choices != full.choices:
                index = np.array([full.number(choice) for choice in column.choices])
                translated[:, j] = index[designs[:, j].astype(np.intp)]
        return translated

    def shown(self, design: Iterable[float]) -> dict[str, float | str]:
        """Return a design by name, for people."""
        return {
            variable.name: variable.shown(value)
            for variable, value in zip(self.columns, design, strict=True)
        }

    @property
    def shown_fixed(self) -> dict[str, float | str]:
        """The fixed values by name, for people."""
        variables = self.columns[len(self.variables) :]
        return {v.name: v.shown(value) for v, (_, value) in zip(variables, self.fixed, strict=True)}

    def simulated_values(self, *positions: Floats) -> Iterator[dict[str, float]]:
        """Yield the simulated values of the designs of positions, by variable."""
        for values in self.simulated(self.designs(np.stack(positions))).tolist():
            yield dict(zip(self.names, values, strict=True))

    def corners(self) -> Iterator[dict[str, float]]:
        """Yield the simulated values at all lower and at all upper bounds, by variable."""
        yield from self.simulated_values(self.box.low, self.box.high)

    @contextmanager
    def requested(self) -> Iterator[None]:
        """Convert a simulator's error to one that names `fixed` or `variables`."""
        try:
            yield
        except SimulationInputError as error:
            raise self.refusal(error) from error

    def refusal(self, error: SimulationInputError) -> InvalidRequest:
        culprit = str(error).partition(":")[0]
        return InvalidRequest(
            str(error), field="fixed" if culprit in dict(self.fixed) else "variables"
        )


def _fixed_values(
    fixed: Mapping[str, float | str], catalogue: Mapping[str, Variable]
) -> tuple[tuple[str, float], ...]:
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
    where = f"{index}.{variable.name}"
    if variable.name not in design:
        raise ValueError(f"{where}: missing; give every searched variable")
    number = _number(where, variable, design[variable.name])
    if variable.kind == "integer" and not number.is_integer():
        raise ValueError(f"{where}: {number:g} is not an integer")
    if not variable.low <= number <= variable.high:
        raise ValueError(
            f"{where}: {number:g} is outside the bounds {variable.low:g} to {variable.high:g};"
            " widen them in `variables`, or omit the design"
        )
    return number


def _number(where: str, variable: Variable, value: float | str) -> float:
    try:
        return variable.number(value)
    except ValueError as error:
        raise ValueError(f"{where}: {str(error).removeprefix(f'{variable.name}: ')}") from error


def _checked(entry: str | Variable, catalogued: Variable) -> Variable:
    if isinstance(entry, str):
        return catalogued
    # A continuous variable may be restricted to integers.
    if entry.kind != catalogued.kind and (
        catalogued.kind != "continuous" or entry.kind == "categorical"
    ):
        article = "an" if catalogued.kind == "integer" else "a"
        raise ValueError(
            f"variables: {entry.name} is {article} {catalogued.kind} variable; set kind to"
            f" {catalogued.kind!r}"
        )
    for choice in entry.choices:
        if choice not in catalogued.choices:
            raise ValueError(
                f"variables: {choice!r} is not a choice of {entry.name}; choose from"
                f" {', '.join(catalogued.choices)}"
            )
    return entry.model_copy(
        update={"unit": catalogued.unit, "description": entry.description or catalogued.description}
    )
