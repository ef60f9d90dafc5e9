"""Options that several commands share, and groups of them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, get_type_hints

import typer

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs

_LENGTH: Final = 12
"""Characters of an id."""


def full_id(jobs: Jobs, given: str) -> str:
    """The id of the only job whose id begins so."""
    from gaitswarm.services.optimizer.errors import InvalidRequest

    if not 0 < len(given) < _LENGTH:
        return given
    found = [job.id for job in jobs.jobs(search=given) if job.id.startswith(given)]
    if len(found) > 1:
        few = ", ".join(sorted(found)[:4]) + (", ..." if len(found) > 4 else "")
        raise InvalidRequest(f"{given!r} fits {few}; give more of it", field="id")
    return found[0] if found else given


def completed_all(context: typer.Context, given: list[str]) -> list[str]:
    """Ids of the command line, in full."""
    if context.resilient_parsing or all(len(one) >= _LENGTH for one in given):
        return given
    from gaitswarm.jobs.open import open_jobs

    options = context.params
    with open_jobs(options.get("server"), options.get("db")) as jobs:
        return [full_id(jobs, one) for one in given]


def completed(context: typer.Context, given: str | None) -> str | None:
    """An id of the command line, in full."""
    return None if given is None else completed_all(context, [given])[0]


def completed_start(context: typer.Context, given: str | None) -> str | None:
    """What a job begins with: ids of jobs in full, or the name of a file as it is."""
    if given is None or given.lower().endswith(".csv"):
        return given
    from gaitswarm.services.optimizer.errors import NotFound

    ids = [one.strip() for one in given.split(",") if one.strip()]
    try:
        return ",".join(completed_all(context, ids))
    except NotFound:
        # A database that is made with the job has none of them: the spec is refused by its place.
        return given


JobId = Annotated[
    str,
    typer.Argument(
        metavar="ID", callback=completed, help="Identifier of the job, or its beginning."
    ),
]

JobIds = Annotated[
    list[str],
    typer.Argument(
        metavar="ID...", callback=completed_all, help="Identifiers of jobs, or their beginnings."
    ),
]

JobName = Annotated[str | None, typer.Option(help="Name of the job, for people.")]

Priority = Annotated[
    int,
    typer.Option(
        min=-10,
        max=10,
        help="How urgent it is: of waiting jobs the highest is run first, and of running jobs one"
        " that is a step higher has twice the share of the workers. No result depends on it.",
    ),
]

Notify = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        help="Where a JSON document is sent when the job has ended, by a server or runner that"
        " allows the URL's host.",
    ),
]

Server = Annotated[
    str | None,
    # Read before the id of a job, which may have to be looked up there.
    typer.Option(metavar="URL", is_eager=True, help="Ask this server. [env: GAITSWARM_SERVER]"),
]

Db = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        is_eager=True,
        help="Use this database: a file, sqlite:///FILE or postgresql://... [env: GAITSWARM_DB;"
        " default: gaitswarm/gaitswarm.db in the user's data directory]",
    ),
]

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]

AcceptChanges = Annotated[
    bool,
    typer.Option(
        "--accept-changes",
        help="Go on although code, robot or compiler have changed; the job records it.",
    ),
]

RobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        metavar="NAME|JSON|FOLDER",
        help="Robot by name, szabadka2-reconstructed (the default), szabadka2-identified (of table"
        " 2.7) or szabadka2 (of the datasheet), a variant as JSON, such as"
        ' {"contact_law": "stick", "backlash": [2.5, 1, 1]}, or the folder of your own.',
    ),
]

ControllerOption = Annotated[
    str | None,
    typer.Option(
        "--controller",
        help="Motor controller: fuzzy-pi, fuzzy-pi-3, p, pi, pid or, of torque-controlled"
        " actuators, joint-pd [default: that of the job or spec, else of the robot's folder, else"
        " fuzzy-pi].",
    ),
]

Precision = Annotated[
    str | None,
    typer.Option(
        metavar="single|double",
        help="Of the physics' numbers: double (the default), or single, which is about twice as"
        " fast. What a job reports as best is judged in double.",
    ),
]


@dataclass(frozen=True, slots=True)
class SpecOptions:
    """Options of a command that submits a job; None leaves the value of the spec in the file.

    scenarios: names, numbers or files, separated by commas.
    """

    spec: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Job spec as JSON; `-` reads standard input. Without one: the chapter-4 job.",
        ),
    ] = None
    iterations: Annotated[
        int | None, typer.Option(help="Budget, in iterations of so many designs as --particles.")
    ] = None
    particles: Annotated[int | None, typer.Option(help="Designs of one iteration, at most.")] = None
    optimizer: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Search method: cma-es, pso-thesis, auto, ...; `gaitswarm optimizers` lists all.",
        ),
    ] = None
    optimizer_settings: Annotated[
        str | None,
        typer.Option(
            metavar="JSON|FILE",
            help="Settings of the method that are not its defaults, such as '{\"sigma\": 0.4}'.",
        ),
    ] = None
    seed: Annotated[int | None, typer.Option(help="Source of all randomness.")] = None
    start_from: Annotated[
        str | None,
        typer.Option(
            metavar="ID[,ID]|FILE.csv",
            callback=completed_start,
            help="Begin with the best designs of earlier jobs, or with those of a file.",
        ),
    ] = None
    start_count: Annotated[
        int | None,
        typer.Option(
            min=1, help="Designs to begin with [default: of jobs the 5 best, of a file all]."
        ),
    ] = None
    preference: Annotated[
        str | None, typer.Option(help="How objectives are weighed: A, B, C or chapter-3 (eq. 3.1).")
    ] = None
    scenarios: Annotated[
        str | None, typer.Option(help="Names, numbers or FILE.json, separated by commas.")
    ] = None
    controller: ControllerOption = None
    case: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|JSON|FILE",
            help="Evaluate designs by a plug-in's case in place of walks in gaitswarm's simulator,"
            " by its name or its settings; `gaitswarm cases` lists all.",
        ),
    ] = None
    with_gait: Annotated[
        bool | None,
        typer.Option(
            "--with-gait",
            help="Search the gait, too: cycle time, stride, height, duty factor and FIR filter.",
        ),
    ] = None
    worlds: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=100,
            help="Judge every design in so many worlds that differ from the model, not in the model"
            " alone.",
        ),
    ] = None
    aggregate: Annotated[
        str | None,
        typer.Option(
            metavar="mean|quantile|worst|cvar",
            help="With --worlds: what utilities in all worlds come to [default: cvar].",
        ),
    ] = None
    level: Annotated[
        float | None,
        typer.Option(help="With --worlds: of a quantile or of the cvar [default: 0.75]."),
    ] = None
    worlds_seed: Annotated[
        int | None, typer.Option(min=0, help="With --worlds: of the worlds [default: 1].")
    ] = None
    robot: RobotOption = None
    precision: Precision = None
    name: JobName = None

    @property
    def given(self) -> dict[str, Any]:
        """Those that the user gave, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, slots=True)
class WorkerOptions:
    """Options of a command that runs jobs, named as the settings that they go before."""

    db: Db = None
    evaluator: Annotated[
        str | None,
        typer.Option(
            help="in-process: threads of this process; ray: the same, and Ray in long jobs or at an"
            " address. [env: GAITSWARM_EVALUATOR; default: ray]",
        ),
    ] = None
    cpus: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Walks to compute at once on this machine. [env: GAITSWARM_CPUS; default: all"
            " cores]",
        ),
    ] = None
    ray_address: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Use this Ray cluster for all walks: HOST:PORT of its head, or auto on a node of"
            " it. [env: GAITSWARM_RAY_ADDRESS]",
        ),
    ] = None
    cache: Annotated[
        bool | None,
        typer.Option(
            "--cache/--no-cache",
            help="Walk a design only if no job in the database has walked it before; it changes no"
            " result. [env: GAITSWARM_CACHE; default: cache]",
        ),
    ] = None


@dataclass(frozen=True, slots=True)
class RunnerOptions(WorkerOptions):
    """Options of a command that runs queued jobs."""

    concurrent_jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            min=1,
            max=256,
            help="Jobs to run at once. [env: GAITSWARM_CONCURRENT_JOBS; default: 2]",
        ),
    ] = None


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """A command as Typer, which knows no groups of options, takes it."""
    annotations = get_type_hints(command, include_extras=True)
    groups: dict[str, type[Any]] = {
        name: kind
        for name, kind in annotations.items()
        if isinstance(kind, type) and is_dataclass(kind)
    }
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in groups:
            parameters += _parameters(groups[name])
        else:
            parameters.append(parameter.replace(annotation=annotations[name]))

    @wraps(command)
    def called(**given: Any) -> None:
        for name, kind in groups.items():
            given[name] = kind(**{field.name: given.pop(field.name) for field in fields(kind)})
        command(**given)

    by_name = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in parameters]
    called.__signature__ = inspect.Signature(by_name)  # type: ignore[attr-defined]
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in by_name}
    return called


def _parameters(group: type) -> list[inspect.Parameter]:
    """Those with which a dataclass is made, their annotations resolved."""
    annotations = get_type_hints(group, include_extras=True)
    parameters = inspect.signature(group).parameters
    return [own.replace(annotation=annotations[name]) for name, own in parameters.items()]
