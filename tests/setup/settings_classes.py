"""Every class that reads settings from the environment."""

from __future__ import annotations

from api.settings import ApiSettings
from gaitswarm.settings import CliSettings
from services.__main__ import Settings as RunnerSettings


def variables() -> set[str]:
    """Names of the environment variables that some process reads."""
    return {
        f"{settings.model_config['env_prefix']}{field}".upper()
        for settings in (ApiSettings, CliSettings, RunnerSettings)
        for field in settings.model_fields
    }
