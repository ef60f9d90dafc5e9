"""The settings that a process reads from its environment."""

from __future__ import annotations

from gaitswarm.settings import Settings


def variables() -> set[str]:
    """Names of the environment variables."""
    prefix = Settings.model_config["env_prefix"]
    return {f"{prefix}{field}".upper() for field in Settings.model_fields}
