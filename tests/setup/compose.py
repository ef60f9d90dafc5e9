"""docker-compose.yml by itself, and with deploy/compose.cluster.yml as Compose merges files."""

from __future__ import annotations

from typing import Any, Final

import yaml

from tests.examples.paths import ROOT

_REPLACED: Final = ("command", "entrypoint", "test")
"""Lists that a later file replaces; it appends to all others."""


def _read(path: str) -> Any:
    return yaml.safe_load((ROOT / path).read_text(encoding="utf-8"))


def merged(first: Any, second: Any, key: str = "") -> Any:
    """Merge by the rules of the Compose specification."""
    if isinstance(first, dict) and isinstance(second, dict):
        return first | {k: merged(first.get(k), value, k) for k, value in second.items()}
    if isinstance(first, list) and isinstance(second, list) and key not in _REPLACED:
        return [*first, *(entry for entry in second if entry not in first)]
    return second


SINGLE: Final[dict[str, Any]] = _read("docker-compose.yml")
OVERLAY: Final[dict[str, Any]] = _read("deploy/compose.cluster.yml")
CLUSTER: Final[dict[str, Any]] = merged(SINGLE, OVERLAY)
