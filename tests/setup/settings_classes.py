"""The settings that a process reads from its environment."""

from __future__ import annotations

from gaitswarm.settings import Settings, variable_of


def variables() -> set[str]:
    """Names of the environment variables."""
    return set(map(variable_of, Settings.model_fields))
