"""Settings of every process of gaitswarm, from its environment."""

from __future__ import annotations

import os
import re
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from gaitswarm.services.optimizer.errors import InvalidRequest, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import LONGEST_LEASE_SECONDS, QUARANTINE_AFTER
from gaitswarm.services.worker import EvaluatorKind
from gaitswarm.sim.compiler.cache import DEFAULT_SIZE
from gaitswarm.sim.input import message_of


def place_of(iteration: int, particle: int) -> str:
    """The place of a design as texts have it."""
    return f"{iteration}.{particle}"


def read_place(text: str, *, field: str) -> tuple[int, int]:
    """Read what `place_of` wrote."""
    found = re.fullmatch(r"(\d{1,9})\.(\d{1,9})", text, re.ASCII)
    if found is None:
        raise InvalidRequest(
            "must be the iteration and the number of a design in it, such as 24.7", field=field
        )
    return int(found[1]), int(found[2])


LogLevel = Annotated[Literal["DEBUG", "INFO", "WARNING", "ERROR"], BeforeValidator(str.upper)]


HostName = Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]+(:[0-9]{1,5})?$")]


def _network(text: str) -> str:
    return str(ip_network(text, strict=False)) if "/" in text else str(ip_address(text))


def _paths(value: object) -> object:
    """Of a list as PATH is one."""
    return [part for part in value.split(os.pathsep) if part] if isinstance(value, str) else value


Network = Annotated[str, AfterValidator(_network)]


def _parts(value: object) -> object:
    """Of a list with commas, as an environment has it."""
    return [part.strip() for part in value.split(",")] if isinstance(value, str) else value


class Settings(BaseSettings):
    """What a process reads when it starts; each variable is a field's name after `GAITSWARM_`.

    Whatever belongs to a job is in its spec instead. An empty variable counts as one that is not
    set. Use `read_settings`, whose errors are for people.
    """

    model_config = SettingsConfigDict(
        env_prefix="GAITSWARM_", env_ignore_empty=True, frozen=True, extra="ignore"
    )

    server: str | None = Field(
        default=None, description="URL of a server that commands about jobs are sent to."
    )
    token: str | None = Field(
        default=None,
        description="Token that is sent to the server, where it asks for one: to that of"
        " GAITSWARM_SERVER if it is set, and to no other.",
        repr=False,
    )
    token_over_http: bool = Field(
        default=False,
        description="Whether a token may leave this machine over plain HTTP, where anybody on the"
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
        default="ray",
        description="Where walks run: `in-process` is threads of the process throughout.",
    )
    ray_address: str | None = Field(
        default=None,
        description="Ray cluster for all walks: HOST:PORT of its head, of which the machine becomes"
        " a node, or `auto` on a node. Without one, walks run in threads of the process, and long"
        " jobs on a Ray that it starts.",
    )
    cpus: int | None = Field(
        default=None, ge=1, description="Walks to compute at once on this machine; default all."
    )
    cache: bool = Field(
        default=True,
        description="Whether a design is walked only if no job of the database has walked it"
        " before.",
    )
    kernel_cache_bytes: int = Field(
        default=DEFAULT_SIZE,
        ge=0,
        description="What compiled kernels may take together [B].",
    )
    concurrent_jobs: int = Field(default=2, ge=1, le=256, description="Jobs to run at once.")
    lease_seconds: float = Field(
        default=30.0,
        ge=3.0,
        le=LONGEST_LEASE_SECONDS,
        description="After so long without a word from its process a job is taken over [s].",
    )
    quarantine_after: int = Field(
        default=QUARANTINE_AFTER,
        ge=1,
        le=1000,
        description="A job with which so many runner processes in a row went down fails.",
    )
    robots: Annotated[tuple[Path, ...], NoDecode, BeforeValidator(_paths)] = Field(
        default=(),
        description="Folders of robots, or of such folders, with `:` between, whose meshes a server"
        " gives out to whoever may read its jobs.",
    )
    webhook_hosts: Annotated[tuple[HostName, ...], NoDecode, BeforeValidator(_parts)] = Field(
        default=(),
        description="Hosts, each with or without port and with commas between, that may be told of"
        " ended jobs; none: nobody is.",
    )
    webhook_secret: str | None = Field(
        default=None,
        description="Signs what the hosts of GAITSWARM_WEBHOOK_HOSTS are told; any text, or"
        " `whsec_` and base64.",
        repr=False,
    )
    drain_seconds: float = Field(
        default=60.0,
        ge=0.0,
        le=86_400.0,
        description="How long iterations under way may take yet when a process is told to end [s].",
    )
    retention_days: float | None = Field(
        default=None,
        gt=0.0,
        le=100_000.0,
        description="Jobs that ended longer ago are deleted by `serve` [d]; default: none is.",
    )
    audit_days: float | None = Field(
        default=None,
        gt=0.0,
        le=100_000.0,
        description="Older entries of the audit log are removed by `serve` [d]; default: none is.",
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
        description="Port on which `runner` serves metrics and /healthz; 0 takes a free one, which"
        " the log names; none: it does not.",
    )
    metrics_host: str = Field(
        default="127.0.0.1",
        description="Address of the port of metrics; beyond the machine itself, they need a token.",
    )
    api_host: str = Field(default="127.0.0.1", description="Address to listen on.")
    api_port: int = Field(
        default=8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one."
    )
    api_access: Literal["auto", "token"] = Field(
        default="auto",
        description="`auto`: requests need a token where the server listens beyond its own machine;"
        " `token`: always.",
    )
    api_allowed_hosts: Annotated[tuple[HostName, ...], NoDecode, BeforeValidator(_parts)] = Field(
        default=(),
        description="Names, each with or without port and with commas between, that the server, or"
        " a runner's port of metrics, is reached by beside its addresses, `localhost`, its host and"
        " the machine's name.",
    )
    api_max_body_bytes: int = Field(
        default=1 << 20, ge=1, description="Largest request body that is read [B]."
    )
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
        description="How often jobs that event streams follow are looked at, all at once, where the"
        " database tells of no changes: SQLite, or a PostgreSQL whose listener is lost [s].",
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
        default=300.0, gt=0.0, description="Longest walk of one request, all scenarios added [s]."
    )
    api_max_logged_seconds: float = Field(
        default=40.0, gt=0.0, description="Longest walk of a request that asks for logs [s]."
    )
    api_max_sampled_seconds: float = Field(
        default=10_000.0,
        gt=0.0,
        description="Longest walk of a request that walks a sample of designs, all designs added"
        " [s].",
    )
    api_max_job_seconds: float = Field(
        default=1e10,
        gt=0.0,
        description="Longest job that is taken, all walks of all designs added [s]: by default"
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
        description="Simulated time that unfinished jobs of one owner may come to, all walks of all"
        " designs added [s].",
    )
    api_max_connections: int = Field(
        default=1000, ge=1, description="Connections and requests in progress; more get 503."
    )
    api_idle_seconds: int = Field(
        default=15, ge=1, description="How long a connection stays open between requests [s]."
    )
    api_trusted_proxies: Annotated[tuple[Network, ...], NoDecode, BeforeValidator(_parts)] = Field(
        default=("127.0.0.1", "::1"),
        description="Addresses or networks, with commas between, of proxies whose word is taken for"
        " who asks and by which scheme.",
    )
    api_shutdown_seconds: int = Field(
        default=5, ge=1, le=600, description="How long open requests may finish on shutdown [s]."
    )

    @property
    def tokens_required(self) -> bool:
        """Whether the server answers only those who send a token."""
        return self.api_access == "token" or not is_loopback(self.api_host)

    @property
    def metrics_need_token(self) -> bool:
        """Whether a runner's metrics are only for those who send a token."""
        return self.api_access == "token" or not is_loopback(self.metrics_host)

    @property
    def database(self) -> str:
        """URL of the database of the jobs; the user's own unless another is named."""
        return self.db or str(default_database())


def read_settings(**options: Any) -> Settings:
    """The environment's settings with a command's options laid over them."""
    given = {name: value for name, value in options.items() if value is not None}
    try:
        return Settings(**given)
    except ValidationError as error:
        problems = [
            (_source(str(problem["loc"][0]), given), message_of(problem))
            for problem in error.errors(include_url=False, include_input=False)
        ]
        (field, message), *others = problems
        more = "".join(f"; {name}: {text}" for name, text in others)
        raise InvalidRequest(message + more, field=field) from error


def default_database() -> Path:
    """The user's own database, the same for every process; its directory may not exist yet."""
    base = os.environ.get("XDG_DATA_HOME") or "~/.local/share"
    try:
        return Path(base).expanduser() / "gaitswarm" / "gaitswarm.db"
    except RuntimeError as error:
        raise StoreUnavailable(
            "there is no home directory to keep a database in; name one with --db or GAITSWARM_DB"
        ) from error


def is_loopback(host: str) -> bool:
    """Whether a host is this machine and nothing else."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _source(field: str, given: dict[str, Any]) -> str:
    """Where the user has set a field: an option of the command, or a variable."""
    return field.removeprefix("api_") if field in given else f"GAITSWARM_{field.upper()}"
