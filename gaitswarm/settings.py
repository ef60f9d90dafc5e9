"""Settings from environment variables, and places of designs as text."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeInt,
    PositiveFloat,
    ValidationError,
)

from gaitswarm.services.optimizer.errors import InvalidRequest, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import LONGEST_LEASE_SECONDS, QUARANTINE_AFTER
from gaitswarm.services.worker import EvaluatorKind
from gaitswarm.sim.compiler.cache import DEFAULT_SIZE
from gaitswarm.sim.input import message_of
from gaitswarm.sim.near_names import nearest


def place_of(iteration: int, particle: int) -> str:
    """Format the place of a design, such as 24.7."""
    return f"{iteration}.{particle}"


def read_place(text: str, *, field: str) -> tuple[int, int]:
    """Parse the result of `place_of`."""
    found = re.fullmatch(r"(\d{1,9})\.(\d{1,9})", text, re.ASCII)
    if found is None:
        raise InvalidRequest(
            "must be the iteration and the number of a design in it, such as 24.7", field=field
        )
    return int(found[1]), int(found[2])


_OF_TESTS: Final = re.compile(r"GAITSWARM_(REQUIRE_|SCREENSHOTS)")

Count = Annotated[int, Field(ge=1)]
Port = Annotated[int, Field(ge=0, le=65535)]
Days = Annotated[float, Field(gt=0.0, le=100_000.0)]
LogLevel = Annotated[Literal["DEBUG", "INFO", "WARNING", "ERROR"], BeforeValidator(str.upper)]

HostName = Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]+(:[0-9]{1,5})?$")]


def _network(text: str) -> str:
    return str(ip_network(text, strict=False)) if "/" in text else str(ip_address(text))


Network = Annotated[str, AfterValidator(_network)]


def _separated(by: str) -> BeforeValidator:
    """Split a text into a list without empty parts."""

    def split(value: object) -> object:
        if not isinstance(value, str):
            return value
        return [part.strip() for part in value.split(by) if part.strip()]

    return BeforeValidator(split)


class Settings(BaseModel):
    """Settings of a process; each variable is a field's name after `GAITSWARM_`.

    Options of a job are in its spec instead. An empty variable counts as unset.
    Use `read_settings`, whose errors name the variable.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    server: str | None = None
    """URL of the server that commands about jobs use."""
    token: str | None = Field(default=None, repr=False)
    """Token sent to the server if it requires one: to that of GAITSWARM_SERVER if it is set, and to
    no other."""
    token_over_http: bool = False
    """Whether a token may leave this machine over plain HTTP, where others on the way can read
    it."""
    db: str | None = Field(default=None, repr=False)
    """Database of the jobs: a file name, sqlite:///FILE or
    postgresql://USER:PASSWORD@HOST/DATABASE. Default: gaitswarm/gaitswarm.db in the user's data
    directory."""
    evaluator: EvaluatorKind = "auto"
    """Where simulations run: on Ray (`ray`), in threads (`in-process`), or `auto`: on the cluster
    at `ray_address`; without one, servers and runners start a local Ray and use threads until it is
    ready, and `optimize` uses threads."""
    ray_address: str | None = None
    """Ray cluster for all simulations: HOST:PORT of its head, which this machine joins, or `auto`
    on a node."""
    cpus: Count | None = None
    """Simulations to run at once on this machine; default all processors."""
    cache: bool = True
    """Whether to reuse results of designs that a job of the database has simulated before."""
    kernel_cache_bytes: NonNegativeInt = DEFAULT_SIZE
    """Memory limit of compiled kernels together [B]."""
    concurrent_jobs: Annotated[int, Field(ge=1, le=256)] = 2
    """Jobs that run at once."""
    lease_seconds: Annotated[float, Field(ge=3.0, le=LONGEST_LEASE_SECONDS)] = 30.0
    """Time without a heartbeat after which another process takes a job over [s]."""
    quarantine_after: Annotated[int, Field(ge=1, le=1000)] = QUARANTINE_AFTER
    """Runner processes in a row that may die with a job before it fails."""
    robots: Annotated[tuple[Path, ...], _separated(os.pathsep)] = ()
    """Folders of robots, or of such folders, separated by `:`, whose meshes a server serves to
    clients that may read its jobs."""
    webhook_hosts: Annotated[tuple[HostName, ...], _separated(",")] = ()
    """Hosts, with or without port and separated by commas, that may be notified of ended jobs;
    none: no notifications."""
    webhook_secret: str | None = Field(default=None, repr=False)
    """Secret that signs notifications to GAITSWARM_WEBHOOK_HOSTS; any text, or `whsec_` and
    base64."""
    drain_seconds: Annotated[float, Field(ge=0.0, le=86_400.0)] = 60.0
    """Time that running iterations have to finish on shutdown [s]."""
    retention_days: Days | None = None
    """Age at which `serve` deletes ended jobs [d]; default: never."""
    audit_days: Days | None = None
    """Age at which `serve` removes entries of the audit log [d]; default: never."""
    log_level: LogLevel = "INFO"
    """Least severe message that is logged."""
    log_format: Literal["console", "json"] = "console"
    """`console`: lines for people; `json`: an object for each message."""
    metrics_port: Port | None = None
    """Port on which `runner` serves metrics and /healthz; 0 chooses a free one, that the log names;
    none: not served."""
    metrics_host: str = "127.0.0.1"
    """Address of the metrics port; other than on loopback, metrics need a token."""
    api_host: str = "127.0.0.1"
    """Address to listen on."""
    api_port: Port = 8000
    """Port to listen on; 0 chooses a free one."""
    api_access: Literal["auto", "token"] = "auto"
    """`auto`: requests need a token where the server listens beyond its own machine; `token`:
    always."""
    api_allowed_hosts: Annotated[tuple[HostName, ...], _separated(",")] = ()
    """Host names, with or without port and separated by commas, of the server, or a runner's
    metrics port, besides its addresses, `localhost`, its host and the machine's name."""
    api_max_body_bytes: Count = 1 << 20
    """Largest request body [B]."""
    api_max_log_bytes: Count = 1 << 24
    """Largest body with a measured log, a second of which takes about a megabyte [B]."""
    api_event_poll_seconds: Annotated[float, Field(gt=0.0, le=60.0)] = 0.5
    """How often jobs that event streams follow are looked at, all at once [s]."""
    api_compute_workers: Annotated[int, Field(ge=1, le=64)] = 2
    """Requests that simulate, or analyze whole histories, at the same time."""
    api_compute_queue: NonNegativeInt = 64
    """Further requests that may wait to compute; more get 503."""
    api_max_fork_seconds: PositiveFloat = 20.0
    """How long bringing a search to where it was may take, for a fork [s]; 409 beyond it."""
    api_max_simulated_seconds: PositiveFloat = 300.0
    """Longest simulated time of one request, all scenarios added [s]."""
    api_max_logged_seconds: PositiveFloat = 40.0
    """Longest simulated time of a request with logs [s]."""
    api_max_sampled_seconds: PositiveFloat = 10_000.0
    """Longest simulated time of a request for a sample of designs, all designs added [s]."""
    api_max_job_seconds: PositiveFloat = 1e10
    """Longest job that is accepted, in simulated time of all designs [s]: by default three months
    of one core at 1200 x real time."""
    api_max_unfinished_jobs: Count = 10_000
    """Jobs of one owner that may be queued, running or paused; `admin` may submit more."""
    api_max_unfinished_seconds: PositiveFloat = 1e11
    """Simulated time of the unfinished jobs of one owner, over all designs added [s]."""
    api_max_connections: Count = 1000
    """Connections and requests in progress; more get 503."""
    api_idle_seconds: Count = 15
    """Idle time after which a connection is closed [s]."""
    api_trusted_proxies: Annotated[tuple[Network, ...], _separated(",")] = ("127.0.0.1", "::1")
    """Addresses or networks, separated by commas, of proxies trusted to state the client's address
    and scheme."""
    api_shutdown_seconds: Annotated[int, Field(ge=1, le=600)] = 5
    """Time that open requests have to finish on shutdown [s]."""

    @property
    def tokens_required(self) -> bool:
        """Whether the server requires tokens."""
        return self.api_access == "token" or not is_loopback(self.api_host)

    @property
    def metrics_need_token(self) -> bool:
        """Whether a runner's metrics require a token."""
        return self.api_access == "token" or not is_loopback(self.metrics_host)

    @property
    def database(self) -> str:
        """URL of the database; by default the user's own."""
        return self.db or str(default_database())


def read_settings(**options: Any) -> Settings:
    """Read settings from the environment, overridden by options of a command."""
    given = {name: value for name, value in options.items() if value is not None}
    variables = {name: os.environ.get(variable_of(name)) for name in Settings.model_fields}
    for problem in _unknown_variables():
        warnings.warn(problem, stacklevel=1)
    try:
        return Settings(**{n: v for n, v in variables.items() if v} | given)
    except ValidationError as error:
        problems = [
            (_source(str(problem["loc"][0]), given), message_of(problem))
            for problem in error.errors(include_url=False, include_input=False)
        ]
        (field, message), *others = problems
        more = "".join(f"; {name}: {text}" for name, text in others)
        raise InvalidRequest(message + more, field=field) from error


def _unknown_variables() -> Iterator[str]:
    """Yield what is wrong with variables that no setting has, such as misspelt ones."""
    known = {variable_of(name) for name in Settings.model_fields}
    for name in sorted(os.environ):
        if name.startswith("GAITSWARM_") and name not in known and not _OF_TESTS.match(name):
            near = nearest(name.removeprefix("GAITSWARM_"), Settings.model_fields)
            advice = f"did you mean {variable_of(near)}?" if near else "docs/settings.md has all"
            yield f"{name} is no setting and has no effect; {advice}"


def default_database() -> Path:
    """Path of the user's own database; its directory may not exist yet."""
    base = os.environ.get("XDG_DATA_HOME") or "~/.local/share"
    try:
        return Path(base).expanduser() / "gaitswarm" / "gaitswarm.db"
    except RuntimeError as error:
        raise StoreUnavailable(
            "no home directory for a database; name one with --db or GAITSWARM_DB"
        ) from error


def is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _source(field: str, given: dict[str, Any]) -> str:
    """Name of the option or variable that sets a field."""
    return field.removeprefix("api_") if field in given else variable_of(field)


def variable_of(field: str) -> str:
    return f"GAITSWARM_{field.upper()}"
