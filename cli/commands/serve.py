"""`gaitswarm serve` and `gaitswarm runner`: the processes that run queued jobs."""

from __future__ import annotations

import gc
import json
import logging
import sys
import threading
from contextlib import ExitStack
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from gaitswarm.cli.options import RunnerOptions
from gaitswarm.cli.output import note

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from gaitswarm.api.dependencies import Component
    from gaitswarm.services.monitoring.activity import Activity
    from gaitswarm.services.monitoring.metrics import Metrics
    from gaitswarm.services.optimizer.run.runner import Runner
    from gaitswarm.services.runtime import Runtime
    from gaitswarm.settings import Settings

LogFormat = Literal["console", "json"]


class JsonFormatter(logging.Formatter):
    """One line of JSON per message: time, level, logger, message.

    If they apply, also `job`, `iteration`, `request` and `traceback`.
    """

    def format(self, record: logging.LogRecord) -> str:
        from gaitswarm.services.optimizer.log_context import log_fields

        document: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **log_fields(),
        }
        if record.exc_info:
            document["traceback"] = self.formatException(record.exc_info)
        return json.dumps(document, ensure_ascii=False, default=str)


def log_to_stderr(level: str, log_format: LogFormat = "console") -> None:
    handler = logging.StreamHandler(sys.stderr)
    if log_format == "json":
        handler.setFormatter(JsonFormatter())
        logging.captureWarnings(capture=True)
    else:
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logging.basicConfig(level=level, handlers=[handler])
    # It would report migrations at every start.
    logging.getLogger("alembic").setLevel(logging.WARNING)
    # It logs complete URLs of webhooks, which may contain secrets.
    logging.getLogger("httpx2").setLevel(logging.WARNING)


_SIGNAL_POLL: Final = 0.2
"""Maximum delay before a signal is handled [s]."""


def serve(
    *,
    host: str | None = None,
    port: Annotated[int | None, typer.Option(min=0, max=65535)] = None,
    no_runner: Annotated[bool, typer.Option("--no-runner")] = False,
    robots: Annotated[
        list[Path] | None, typer.Option(metavar="FOLDER", exists=True, file_okay=False)
    ] = None,
    options: RunnerOptions,
) -> None:
    """Serve the page and the REST API, and run queued jobs, until Ctrl-C.

    Args:
        host: Address to listen on. [env: GAITSWARM_API_HOST; default: 127.0.0.1]
        port: Port; 0 chooses a free one. [env: GAITSWARM_API_PORT; default: 8000]
        no_runner: Run no jobs in this process.
        robots: Folder of a robot, or of several, whose meshes the page shows to users who can read
            the jobs; repeatable. [env: GAITSWARM_ROBOTS; default: none]
    """
    from gaitswarm.api.app import create_app
    from gaitswarm.api.page import is_built
    from gaitswarm.api.server import ApiServer
    from gaitswarm.services.monitoring.activity import Activity
    from gaitswarm.services.monitoring.metrics import Metrics
    from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
    from gaitswarm.settings import read_settings

    settings = read_settings(**asdict(options), api_host=host, api_port=port, robots=robots or None)
    log_to_stderr(settings.log_level, settings.log_format)
    report = note if settings.log_format == "console" else logging.getLogger("gaitswarm").info
    metrics = Metrics()
    activity = None if no_runner else Activity()
    runs_jobs = not no_runner
    with _runtime(
        settings, metrics, runs_jobs=runs_jobs, housekeeping=True, activity=activity
    ) as opened:
        app = create_app(
            opened.service,
            settings=settings,
            components=_components(opened),
            metrics=metrics,
            activity=activity,
        )
        try:
            server = ApiServer(
                app, settings, drain=lambda at_once: _drain(opened.runner, settings, at_once)
            )
        except OSError as error:
            raise EvaluatorUnavailable(
                f"cannot listen: {error.strerror}; choose another --port, or --port 0"
            ) from error
        role = "runs no jobs" if opened.runner is None else "runs queued jobs"
        if not is_built():
            report("the page is not built, only the API is served: run `make page` in a checkout")
        report(f"gaitswarm serves {server.url} and {role}; {server.url}/docs; Ctrl-C ends it")
        if settings.tokens_required:
            _report_tokens(report, opened.service.store.tokens.create_first(), server.url)
        # Full collections would otherwise block the event loop for 0.1 s to visit all modules.
        gc.freeze()
        server.run()


def runner(options: RunnerOptions) -> None:
    """Run queued jobs, without page and API, until Ctrl-C or SIGTERM.

    Running jobs then commit their current iterations and return to the queue; a second signal
    discards these iterations.
    """
    from gaitswarm.services.runtime import stop_on_signals
    from gaitswarm.settings import read_settings

    settings = read_settings(**asdict(options))
    log_to_stderr(settings.log_level, settings.log_format)
    log = logging.getLogger(__name__)
    stop, at_once = threading.Event(), threading.Event()
    metrics = None
    if settings.metrics_port is not None:
        from gaitswarm.services.monitoring.metrics import Metrics

        metrics = Metrics()
    # A signal while connecting to a cluster ends the command.
    with (
        stop_on_signals(stop, at_once),
        _runtime(settings, metrics) as opened,
        ExitStack() as stack,
    ):
        log.info("ready: %d slots, %d jobs at once", opened.slots, settings.concurrent_jobs)
        if metrics is not None and opened.runner is not None:
            from gaitswarm.api.server import metrics_server

            tokens, trouble = lambda: opened.service.store.tokens, opened.runner.trouble
            url = stack.enter_context(metrics_server(metrics, tokens, settings, trouble))
            log.info("metrics: %s", url)
        # Handlers run in this thread, but the system may deliver a signal to another.
        while not stop.wait(_SIGNAL_POLL):
            pass
        _drain(opened.runner, settings, at_once)


def _drain(runner: Runner | None, settings: Settings, at_once: threading.Event) -> None:

    if runner is None:
        return
    seconds = settings.drain_seconds
    logging.getLogger(__name__).info(
        "stopping: jobs commit their current iterations within %g s and return to the queue; a"
        " second signal discards these iterations",
        seconds,
    )
    runner.drain(seconds, at_once)


def _components(opened: Runtime) -> tuple[Component, ...]:
    """Return the components of health reports; jobs wait for missing workers."""
    from gaitswarm.api.dependencies import Component

    events, runner = Component("events", opened.service.store.changes.trouble), opened.runner
    if runner is None:
        return (events,)
    return (
        events,
        Component("runner", runner.trouble),
        Component("workers", opened.workers_trouble, vital=False),
    )


def _report_tokens(report: Callable[[str], None], secret: str | None, url: str) -> None:
    if secret is None:
        report("requests need a token: create one by `gaitswarm token create NAME`")
        return
    report(
        "requests need a token; this one, `first`, has all permissions and is shown only once:\n"
        f"  {secret}\n"
        f"  page: {url}/#token={secret}\n"
        "create more by `gaitswarm token create NAME`; revoke it by `gaitswarm token revoke first`"
    )


def _runtime(
    settings: Settings,
    metrics: Metrics | None,
    *,
    runs_jobs: bool = True,
    housekeeping: bool = False,
    activity: Activity | None = None,
) -> AbstractContextManager[Runtime]:
    from gaitswarm.jobs.open import database_to_write
    from gaitswarm.services.runtime import open_runtime

    return open_runtime(
        database_to_write(settings),
        evaluator=settings.evaluator if runs_jobs else None,
        ray_address=settings.ray_address,
        cpus=settings.cpus,
        concurrent_jobs=settings.concurrent_jobs,
        lease_seconds=settings.lease_seconds,
        quarantine_after=settings.quarantine_after,
        cache=settings.cache,
        longest_job=settings.api_max_job_seconds,
        housekeeping=housekeeping,
        retention_days=settings.retention_days,
        audit_days=settings.audit_days,
        longest_fork=settings.api_max_fork_seconds,
        longest_reference=settings.api_max_sampled_seconds,
        metrics=metrics,
        webhook_hosts=settings.webhook_hosts,
        webhook_secret=settings.webhook_secret,
        activity=activity,
    )
