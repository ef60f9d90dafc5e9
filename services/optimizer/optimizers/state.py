"""Checks on a dumped optimizer state, so that a damaged one is refused and not continued."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

M = TypeVar("M", bound=BaseModel)


def parse_state(state: dict[str, Any], optimizer: str, model: type[M]) -> M:
    """The state as an object. Raises ValueError that names the field that is wrong."""
    try:
        return model.model_validate(state)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"not a state of {optimizer}: {where}: {first['msg']}") from error


def matrix(rows: list[list[float]], shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """(n, d) array of the rows. Raises ValueError if they have another shape."""
    if len(rows) != shape[0] or any(len(row) != shape[1] for row in rows):
        raise ValueError(f"{name}: expected {shape[0]} rows of {shape[1]} numbers")
    return np.array(rows, dtype=np.float64).reshape(shape)
