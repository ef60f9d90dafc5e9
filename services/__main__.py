"""`python -m services`: a process that runs queued jobs, until SIGTERM or SIGINT."""

from __future__ import annotations

import logging
import sys
import threading
from typing import Final

from pydantic import Field, ValidationError
from pydantic_settings import BaseSettings, SettingsConfigDict

from services.optimizer.errors import GaitswarmError
from services.runtime import EvaluatorKind, RuntimeSettings, open_runtime, stop_on_signals

_EXIT_UNAVAILABLE: Final = 69
"""EX_UNAVAILABLE of sysexits.h: the database or the cluster does not answer."""

_EXIT_CONFIG: Final = 78
"""EX_CONFIG of sysexits.h."""

_log = logging.getLogger(__name__)


class Settings(BaseSettings):
    """Environment of the process; each name is preceded by GAITSWARM_."""

    model_config = SettingsConfigDict(env_prefix="GAITSWARM_", env_ignore_empty=True)

    db: str = Field(
        default="sqlite:///gaitswarm.db", description="Where jobs and their history are kept."
    )
    evaluator: EvaluatorKind = Field(default="ray", description="Where walks run.")
    ray_address: str | None = Field(
        default=None, description="Ray cluster to use; one is started if there is none."
    )
    cpus: int | None = Field(default=None, ge=1, description="Slots on this machine; default all.")
    concurrent_jobs: int = Field(default=2, ge=1, le=256, description="Jobs to run at once.")
    lease_seconds: float = Field(
        default=30.0,
        ge=3.0,
        le=3600.0,
        description="Time after which a job is taken over whose process is not heard of.",
    )
    log_level: str = Field(default="INFO", description="DEBUG, INFO, WARNING or ERROR.")


def main() -> int:
    """Run jobs until told to end; the exit code."""
    try:
        settings = Settings()
        logging.basicConfig(
            level=settings.log_level.upper(), format="%(asctime)s %(levelname)s %(message)s"
        )
    except ValidationError as error:
        for problem in error.errors(include_url=False, include_input=False):
            name = "_".join(str(part) for part in problem["loc"]).upper()
            print(f"GAITSWARM_{name}: {problem['msg']}", file=sys.stderr)  # noqa: T201
        return _EXIT_CONFIG
    # Every start would tell of migrations that are already done.
    logging.getLogger("alembic").setLevel(logging.WARNING)
    stop = threading.Event()
    try:
        with stop_on_signals(stop), open_runtime(_runtime_settings(settings)) as runtime:
            slots = runtime.evaluator.slots if runtime.evaluator else 0
            _log.info("ready: %d slots, %d jobs at once", slots, settings.concurrent_jobs)
            stop.wait()
            _log.info("stopping: jobs under way go back to the queue")
    except GaitswarmError as error:
        _log.error("%s", error)
        return _EXIT_UNAVAILABLE
    return 0


def _runtime_settings(settings: Settings) -> RuntimeSettings:
    return RuntimeSettings(
        database=settings.db,
        evaluator=settings.evaluator,
        ray_address=settings.ray_address,
        cpus=settings.cpus,
        concurrent_jobs=settings.concurrent_jobs,
        lease_seconds=settings.lease_seconds,
    )


if __name__ == "__main__":
    sys.exit(main())
