"""Which jobs a command is about: those of a server, or those in a database."""

from __future__ import annotations

import os
from pathlib import Path

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict


class CliSettings(BaseSettings):
    """Read from the environment, prefix GAITSWARM_; an option of the command goes before."""

    model_config = SettingsConfigDict(
        env_prefix="GAITSWARM_", env_ignore_empty=True, frozen=True, extra="ignore"
    )

    server: str | None = Field(
        default=None, description="URL of a gaitswarm server that commands are sent to."
    )
    db: str | None = Field(
        default=None,
        description="Database of the jobs: a file name, sqlite:///FILE or"
        " postgresql://USER:PASSWORD@HOST/DATABASE. Default: a file in the user's data directory.",
    )


def default_database() -> Path:
    """The user's own database, the same for every command; its directory may not exist yet."""
    base = os.environ.get("XDG_DATA_HOME") or "~/.local/share"
    return Path(base).expanduser() / "gaitswarm" / "gaitswarm.db"
