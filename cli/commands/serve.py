"""`gaitswarm serve`: the HTTP API, with a runner beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.options import Cpus, Db, EvaluatorOption, RayAddress

if TYPE_CHECKING:
    from api.settings import ApiSettings


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(serve)


def serve(
    db: Db = None,
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
    jobs: Annotated[int, typer.Option(min=1, max=256, help="Jobs to run at once.")] = 2,
    evaluator: EvaluatorOption = "ray",
    cpus: Cpus = None,
    ray_address: RayAddress = None,
) -> None:
    """Serve the page and the REST API, and run queued jobs, until Ctrl-C."""
    from api.app import create_app
    from api.page_folder import is_built
    from api.server import ApiServer
    from cli.options import evaluator_kind
    from cli.output import log_to_stderr, note
    from gaitswarm.jobs.open import database_url
    from services.optimizer.errors import EvaluatorUnavailable
    from services.runtime import RuntimeSettings, open_runtime

    log_to_stderr()
    settings = _api_settings(host=host, port=port)
    runtime = RuntimeSettings(
        database_url(db),
        evaluator=None if no_runner else evaluator_kind(evaluator),
        ray_address=ray_address,
        cpus=cpus,
        concurrent_jobs=jobs,
    )
    with open_runtime(runtime) as opened:
        app = create_app(opened.service, settings=settings)
        try:
            server = ApiServer(app, host=settings.host, port=settings.port)
        except OSError as error:
            raise EvaluatorUnavailable(
                f"cannot listen on {settings.host}, port {settings.port}: {error.strerror}; choose"
                " another --port, or --port 0"
            ) from error
        doing = "runs no jobs" if opened.runner is None else "runs queued jobs"
        if not is_built():
            note("there is no page, only the API: in a checkout, `make page` builds the page")
        note(f"gaitswarm serves {server.url} and {doing}; {server.url}/docs; Ctrl-C ends it")
        server.run()


def _api_settings(*, host: str | None, port: int | None) -> ApiSettings:
    """The server's settings from the environment, with options laid over them.

    Raises InvalidRequest that names the variable.
    """
    from pydantic import ValidationError

    from api.settings import ApiSettings
    from services.optimizer.errors import InvalidRequest

    given: dict[str, Any] = {
        name: v for name, v in (("host", host), ("port", port)) if v is not None
    }
    try:
        return ApiSettings(**given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = "_".join(str(part) for part in first["loc"]).upper()
        raise InvalidRequest(first["msg"], field=f"GAITSWARM_API_{name}") from error
