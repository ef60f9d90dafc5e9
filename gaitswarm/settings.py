"""Settings from environment variables, and places of designs as text."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

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

    server: str | None = Field(
        default=None, description="URL of the server that commands about jobs use."
    )
    token: str | None = Field(
        default=None,
        description="Token sent to the server if it requires one: to that of"
        " GAITSWARM_SERVER if it is set, and to no other.",
        repr=False,
    )
    token_over_http: bool = Field(
        default=False,
        description="Whether a token may leave this machine over plain HTTP, where others on the"
        " way can read it.",
    )
    db: str | None = Field(
        default=None,
        repr=False,
        description="Database of the jobs: a file name, sqlite:///FILE or"
        " postgresql://USER:PASSWORD@HOST/DATABASE. Default: gaitswarm/gaitswarm.db in the user's"
        " data directory.",
    )
    evaluator: EvaluatorKind = Field(
        default="auto",
        description="Where simulations run: on Ray (`ray`), in threads (`in-process`), or `auto`:"
        " on the cluster at `ray_address`; without one, servers and runners start a local Ray and"
        " use threads until it is ready, and `optimize` uses threads.",
    )
    ray_address: str | None = Field(
        default=None,
        description="Ray cluster for all simulations: HOST:PORT of its head, which this machine"
        " joins, or `auto` on a node.",
    )
    cpus: int | None = Field(
        default=None,
        ge=1,
        description="Simulations to run at once on this machine; default all processors.",
    )
    cache: bool = Field(
        default=True,
        description="Whether to reuse results of designs that a job of the database has simulated"
        " before.",
    )
    kernel_cache_bytes: int = Field(
        default=DEFAULT_SIZE,
        ge=0,
        description="Memory limit of compiled kernels together [B].",
    )
    concurrent_jobs: int = Field(default=2, ge=1, le=256, description="Jobs that run at once.")
    lease_seconds: float = Field(
        default=30.0,
        ge=3.0,
        le=LONGEST_LEASE_SECONDS,
        description="Time without a heartbeat after which another process takes a job over [s].",
    )
    quarantine_after: int = Field(
        default=QUARANTINE_AFTER,
        ge=1,
        le=1000,
        description="Runner processes in a row that may die with a job before it fails.",
    )
    robots: Annotated[tuple[Path, ...], _separated(os.pathsep)] = Field(
        default=(),
        description="Folders of robots, or of such folders, separated by `:`, whose meshes a server"
        " serves to clients that may read its jobs.",
    )
    webhook_hosts: Annotated[tuple[HostName, ...], _separated(",")] = Field(
        default=(),
        description="Hosts, with or without port and separated by commas, that may be notified of"
        " ended jobs; none: no notifications.",
    )
    webhook_secret: str | None = Field(
        default=None,
        description="Secret that signs notifications to GAITSWARM_WEBHOOK_HOSTS; any text, or"
        " `whsec_` and base64.",
        repr=False,
    )
    drain_seconds: float = Field(
        default=60.0,
        ge=0.0,
        le=86_400.0,
        description="Time that running iterations have to finish on shutdown [s].",
    )
    retention_days: float | None = Field(
        default=None,
        gt=0.0,
        le=100_000.0,
        description="Age at which `serve` deletes ended jobs [d]; default: never.",
    )
    audit_days: float | None = Field(
        default=None,
        gt=0.0,
        le=100_000.0,
        description="Age at which `serve` removes entries of the audit log [d]; default: never.",
    )
    log_level: LogLevel = Field(default="INFO", description="Least severe message that is logged.")
    log_format: Literal["console", "json"] = Field(
        default="console",
        description="`console`: lines for people; `json`: an object for each message.",
    )
    metrics_port: int | None = Field(
        default=None,
        ge=0,
        le=65535,
        description="Port on which `runner` serves metrics and /healthz; 0 chooses a free one, that"
        " the log names; none: not served.",
    )
    metrics_host: str = Field(
        default="127.0.0.1",
        description="Address of the metrics port; other than on loopback, metrics need a token.",
    )
    api_host: str = Field(default="127.0.0.1", description="Address to listen on.")
    api_port: int = Field(
        default=8000, ge=0, le=65535, description="Port to listen on; 0 chooses a free one."
    )
    api_access: Literal["auto", "token"] = Field(
        default="auto",
        description="`auto`: requests need a token where the server listens beyond its own machine;"
        " `token`: always.",
    )
    api_allowed_hosts: Annotated[tuple[HostName, ...], _separated(",")] = Field(
        default=(),
        description="Host names, with or without port and separated by commas, of the server, or"
        " a runner's metrics port, besides its addresses, `localhost`, its host and"
        " the machine's name.",
    )
    api_max_body_bytes: int = Field(default=1 << 20, ge=1, description="Largest request body [B].")
    api_max_log_bytes: int = Field(
        default=1 << 24,
        ge=1,
        description="Largest body with a measured log, a second of which takes about a megabyte"
        " [B].",
    )
    api_event_poll_seconds: float = Field(
        default=0.5,
        gt=0.0,
        le=60.0,
        description="How often jobs that event streams follow are looked at, all at once [s].",
    )
    api_compute_workers: int = Field(
        default=2,
        ge=1,
        le=64,
        description="Requests that simulate, or analyze whole histories, at the same time.",
    )
    api_compute_queue: int = Field(
        default=64,
        ge=0,
        description="Further requests that may wait to compute; more get 503.",
    )
    api_max_fork_seconds: float = Field(
        default=20.0,
        gt=0.0,
        description="How long bringing a search to where it was may take, for a fork [s]; 409"
        " beyond it.",
    )
    api_max_simulated_seconds: float = Field(
        default=300.0,
        gt=0.0,
        description="Longest simulated time of one request, all scenarios added [s].",
    )
    api_max_logged_seconds: float = Field(
        default=40.0, gt=0.0, description="Longest simulated time of a request with logs [s]."
    )
    api_max_sampled_seconds: float = Field(
        default=10_000.0,
        gt=0.0,
        description="Longest simulated time of a request for a sample of designs, all designs added"
        " [s].",
    )
    api_max_job_seconds: float = Field(
        default=1e10,
        gt=0.0,
        description="Longest job that is accepted, in simulated time of all designs [s]: by default"
        " three months of one core at 1200 x real time.",
    )
    api_max_unfinished_jobs: int = Field(
        default=10_000,
        ge=1,
        description="Jobs of one owner that may be queued, running or paused; `admin` may submit"
        " more.",
    )
    api_max_unfinished_seconds: float = Field(
        default=1e11,
        gt=0.0,
        description="Simulated time of the unfinished jobs of one owner, over all"
        " designs added [s].",
    )
    api_max_connections: int = Field(
        default=1000, ge=1, description="Connections and requests in progress; more get 503."
    )
    api_idle_seconds: int = Field(
        default=15, ge=1, description="Idle time after which a connection is closed [s]."
    )
    api_trusted_proxies: Annotated[tuple[Network, ...], _separated(",")] = Field(
        default=("127.0.0.1", "::1"),
        description="Addresses or networks, separated by commas, of proxies trusted to state"
        " the client's address and scheme.",
    )
    api_shutdown_seconds: int = Field(
        default=5,
        ge=1,
        le=600,
        description="Time that open requests have to finish on shutdown [s].",
    )

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
    """Whether a host is a loopback address."""
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
    """Environment variable of a setting."""
    return f"GAITSWARM_{field.upper()}"
