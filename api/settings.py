"""Settings of the server process; those of a job are in its spec."""

from __future__ import annotations

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict


class ApiSettings(BaseSettings):
    """Read from the environment, prefix GAITSWARM_API_, by the process's entry point."""

    model_config = SettingsConfigDict(env_prefix="GAITSWARM_API_", frozen=True, extra="ignore")

    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    port: int = Field(
        default=8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one."
    )
    max_body_bytes: int = Field(
        default=1 << 20, ge=1, description="Largest request body that is read [B]."
    )
    event_poll_seconds: float = Field(
        default=0.5, gt=0.0, le=60.0, description="How often an event stream asks the store [s]."
    )
    simulation_workers: int = Field(
        default=2, ge=1, le=64, description="Walks on request that compute at the same time."
    )
    simulation_queue: int = Field(
        default=16, ge=0, description="Further ones that may wait; more are told to come later."
    )
    max_simulated_seconds: float = Field(
        default=300.0, gt=0.0, description="Longest walk of one request, all scenarios added [s]."
    )
    max_logged_seconds: float = Field(
        default=40.0, gt=0.0, description="The same for a request that asks for logs [s]."
    )
    shutdown_seconds: int = Field(
        default=5, ge=1, le=600, description="How long open requests may finish on shutdown [s]."
    )
