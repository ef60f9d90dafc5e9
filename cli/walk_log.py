"""Logs of walks as NumPy archives."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gaitswarm.cli.atomic_file import replacing
from gaitswarm.views import WalkLogView


def write_walk_logs(path: Path, logs: Mapping[str, WalkLogView | None]) -> None:
    """One array per recorded quantity, 500 rows a second, float64, NaN where undefined.

    Names are those of `gaitswarm.sim.kernel.observation.WalkLog`; with several scenarios,
    `<scenario>/<name>`.
    Raises InvalidRequest if the file cannot be written; an earlier file is replaced at once.
    """
    arrays = {
        f"{scenario}/{name}" if len(logs) > 1 else name: np.array(column.values, dtype=np.float64)
        for scenario, log in logs.items()
        if log is not None
        for name, column in log.columns.items()
    }
    with replacing(path, "log") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)
