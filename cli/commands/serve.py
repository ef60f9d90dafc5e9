"""`gaitswarm serve` and `gaitswarm runner`: the processes that run queued jobs."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from gaitswarm.cli.inputs.options import RunnerOptions, with_groups

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from gaitswarm.api.dependencies import Component
    from gaitswarm.services.monitoring.activity import Activity
    from gaitswarm.services.monitoring.metrics import Metrics
    from gaitswarm.services.monitoring.tracing import Tracing
    from gaitswarm.services.optimizer.run.runner import Runner
    from gaitswarm.services.runtime import Runtime
    from gaitswarm.settings import Settings

_GLANCE: Final = 0.2
"""Seconds after which a signal is seen at the latest."""


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(serve)
    app.command()(runner)


@with_groups
def serve(
    *,
    host: Annotated[
        str | None,
        typer.Option(help="Address to listen on. [env: GAITSWARM_API_HOST; default: 127.0.0.1]"),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            help="Port; 0 takes a free one. [env: GAITSWARM_API_PORT; default: 8000]",
        ),
    ] = None,
    no_runner: Annotated[
        bool, typer.Option("--no-runner", help="Run no jobs; other processes do.")
    ] = False,
    robots: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER",
            exists=True,
            file_okay=False,
            help="Show this robot's meshes on the page, or those of the robots in this folder, to"
            " whoever may read the jobs; may be repeated. [env: GAITSWARM_ROBOTS; default: none]",
        ),
    ] = None,
    options: RunnerOptions,
) -> None:
    """Serve the page and the REST API, and run queued jobs, until Ctrl-C."""
    import logging
    from dataclasses import asdict

    from gaitswarm.api.app import create_app
    from gaitswarm.api.page import is_built
    from gaitswarm.api.server import ApiServer
    from gaitswarm.cli.logs import log_to_stderr
    from gaitswarm.cli.output import note
    from gaitswarm.services.monitoring.activity import Activity
    from gaitswarm.services.monitoring.metrics import Metrics
    from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
    from gaitswarm.settings import read_settings

    settings = read_settings(**asdict(options), api_host=host, api_port=port, robots=robots or None)
    log_to_stderr(settings.log_level, settings.log_format)
    tell = note if settings.log_format == "console" else logging.getLogger("gaitswarm").info
    metrics = Metrics()
    activity = None if no_runner else Activity()
    runs_jobs = not no_runner
    with _runtime(
        settings, metrics, runs_jobs=runs_jobs, housekeeping=True, activity=activity
    ) as opened:
        beside = opened.runner
        components = _components(opened, beside)
        app = create_app(
            opened.service,
            settings=settings,
            components=components,
            metrics=metrics,
            activity=activity,
        )
        try:
            server = ApiServer(
                app, settings, drain=lambda at_once: _drain(beside, settings, at_once)
            )
        except OSError as error:
            raise EvaluatorUnavailable(
                f"cannot listen: {error.strerror}; choose another --port, or --port 0"
            ) from error
        doing = "runs no jobs" if beside is None else "runs queued jobs"
        if not is_built():
            tell("there is no page, only the API: in a checkout, `make page` builds the page")
        tell(f"gaitswarm serves {server.url} and {doing}; {server.url}/docs; Ctrl-C ends it")
        if settings.tokens_required:
            _tell_of_tokens(tell, opened.service.store.tokens.create_first(), server.url)
        # Full collections would otherwise block the event loop for 0.1 s to visit all modules.
        gc.freeze()
        server.run()


@with_groups
def runner(options: RunnerOptions) -> None:
    """Run queued jobs, without page and API, until Ctrl-C or SIGTERM.

    The jobs that are then under way commit their iterations and go back to the queue; a second
    signal drops the iterations.
    """
    import logging
    import threading
    from contextlib import suppress
    from dataclasses import asdict

    from gaitswarm.cli.logs import log_to_stderr
    from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped
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
    # A stop while a cluster is connected ends the command before it is ready.
    with (
        suppress(EvaluationStopped),
        stop_on_signals(stop, at_once),
        _runtime(settings, metrics, should_stop=stop.is_set) as opened,
        _served(metrics, settings, opened) as url,
    ):
        log.info("ready: %d slots, %d jobs at once", opened.slots, settings.concurrent_jobs)
        if url is not None:
            log.info("metrics: %s", url)
        # Handlers run in this thread, but the system may hand a signal to another one.
        while not stop.wait(_GLANCE):
            pass
        _drain(opened.runner, settings, at_once)


def _drain(runner: Runner | None, settings: Settings, at_once: threading.Event) -> None:
    import logging

    if runner is None:
        return
    seconds = settings.drain_seconds
    logging.getLogger(__name__).info(
        "ending: jobs commit their iterations under way, for %g s at most, and go back to the"
        " queue; a second signal drops the iterations",
        seconds,
    )
    runner.drain(seconds, at_once)


def _components(opened: Runtime, runner: Runner | None) -> tuple[Component, ...]:
    """Parts of the process that it tells of. Jobs wait for workers that are away."""
    from gaitswarm.api.dependencies import Component

    events = Component("events", opened.service.store.changes.trouble)
    if runner is None:
        return (events,)
    return (
        events,
        Component("runner", runner.trouble),
        Component("workers", opened.workers_trouble, vital=False),
    )


def _tell_of_tokens(tell: Callable[[str], None], secret: str | None, url: str) -> None:
    if secret is None:
        tell("requests need a token: `gaitswarm token create NAME` makes one")
        return
    tell(
        "requests need a token; this one, `first`, may do everything, and is shown only now:\n"
        f"  {secret}\n"
        f"  the page with it: {url}/#token={secret}\n"
        "`gaitswarm token create NAME` makes more, and `gaitswarm token revoke first` ends this one"
    )


def _runtime(
    settings: Settings,
    metrics: Metrics | None,
    *,
    runs_jobs: bool = True,
    housekeeping: bool = False,
    should_stop: Callable[[], bool] = lambda: False,
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
        should_stop=should_stop,
        metrics=metrics,
        tracing=_tracing() if runs_jobs else None,
        webhook_hosts=settings.webhook_hosts,
        webhook_secret=settings.webhook_secret,
        activity=activity,
    )


def _tracing() -> Tracing | None:
    """Where OpenTelemetry's variables name a collector, spans are sent there."""
    import logging
    import os

    names = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
    if not any(os.environ.get(name) for name in names):
        return None
    try:
        from gaitswarm.services.monitoring.tracing import exporting_tracing
    except ModuleNotFoundError as error:
        # Other programs on the machine may have asked for it.
        logging.getLogger(__name__).warning(
            "no spans are sent, %s is missing: install gaitswarm[telemetry]", error.name
        )
        return None
    return exporting_tracing()


@contextmanager
def _served(metrics: Metrics | None, settings: Settings, opened: Runtime) -> Iterator[str | None]:
    """A runner's metrics and health on the port of the settings; URL of the metrics, if any."""
    if metrics is None or settings.metrics_port is None:
        yield None
        return
    from gaitswarm.services.monitoring.exposition import MetricsAccess, metrics_server
    from gaitswarm.services.monitoring.hosts import HostNames

    access = MetricsAccess(
        lambda: opened.service.store.tokens, required=settings.metrics_need_token
    )
    host, port = settings.metrics_host, settings.metrics_port
    names = HostNames(host, settings.api_allowed_hosts)
    trouble = opened.runner.trouble if opened.runner is not None else lambda: None
    with metrics_server(metrics, access, names=names, trouble=trouble, host=host, port=port) as url:
        yield url
