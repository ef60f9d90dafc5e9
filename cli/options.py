"""Options that several commands share, and groups of them."""

from __future__ import annotations

import gc
import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from copy import copy
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    TypeVar,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import typer

from gaitswarm.cli.output import Printed, show
from gaitswarm.docstrings import docstring_of
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs

C = TypeVar("C", bound=str)

_LENGTH: Final = 12
"""Characters of a complete id."""


def one_of(choices: Iterable[C], text: str, option: str) -> C:
    """Return the choice that equals the text of an option."""
    choices = tuple(choices)
    for choice in choices:
        if choice == text:
            return choice
    raise InvalidRequest(f"{text!r} is none of {', '.join(choices)}", field=option)


def name_and_value(entry: str, option: str, form: str = "NAME=VALUE") -> tuple[str, str]:
    """Split NAME=VALUE at the equals sign."""
    name, equals, value = entry.partition("=")
    if not (name and equals and value):
        raise InvalidRequest(f"{entry!r} is not {form}", field=option)
    return name.strip(), value.strip()


def name_and_bounds(entry: str, option: str) -> tuple[str, tuple[str, str]]:
    name, value = name_and_value(entry, option, "NAME=LOW:HIGH")
    low, colon, high = value.partition(":")
    if not colon:
        raise InvalidRequest(f"{entry!r} is not NAME=LOW:HIGH", field=option)
    return name, (low, high)


def full_id(jobs: Jobs, prefix: str) -> str:
    """Return the only id with a prefix, or the text itself if there is none."""
    if not 0 < len(prefix) < _LENGTH:
        return prefix
    matches = [job.id for job in jobs.jobs(search=prefix) if job.id.startswith(prefix)]
    if len(matches) > 1:
        few = ", ".join(sorted(matches)[:4]) + (", ..." if len(matches) > 4 else "")
        raise InvalidRequest(f"{prefix!r} matches {few}; type more characters", field="id")
    return matches[0] if matches else prefix


def completed_all(context: typer.Context, ids: list[str]) -> list[str]:
    """Complete prefixes of ids."""
    if context.resilient_parsing or all(len(text) >= _LENGTH for text in ids):
        return ids
    from gaitswarm.jobs.open import open_jobs

    options = context.params
    with open_jobs(options.get("server"), options.get("db")) as jobs:
        return [full_id(jobs, text) for text in ids]


def completed(context: typer.Context, text: str | None) -> str | None:
    return None if text is None else completed_all(context, [text])[0]


def completed_start(context: typer.Context, text: str | None) -> str | None:
    """Complete prefixes of ids separated by commas; names of CSV files do not change."""
    if text is None or text.lower().endswith(".csv"):
        return text
    ids = [entry.strip() for entry in text.split(",") if entry.strip()]
    try:
        return ",".join(completed_all(context, ids))
    except NotFound:
        # The database does not exist yet: validation of the spec reports the unknown job.
        return text


def completed_reference(context: typer.Context, text: str | None) -> str | None:
    """Complete the prefix of a job's id; other references do not change."""
    other = text is None or text.startswith(("published:", "{", "-")) or text.endswith(".json")
    return text if other else completed_start(context, text)


JobId = Annotated[
    str,
    typer.Argument(
        metavar="ID", callback=completed, help="Identifier of the job, or a prefix of it."
    ),
]

JobIds = Annotated[
    list[str],
    typer.Argument(
        metavar="ID...", callback=completed_all, help="Identifiers of jobs, or prefixes of them."
    ),
]

JobName = Annotated[str | None, typer.Option(help="Display name of the job.")]

Priority = Annotated[
    int,
    typer.Option(
        min=-10,
        max=10,
        help="Priority: queued jobs with the highest run first, and running jobs get twice the"
        " share of the workers per step. Results do not depend on it.",
    ),
]

Notify = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        help="Webhook for a JSON document when the job ends; the server or runner must allow the"
        " URL's host.",
    ),
]

Server = Annotated[
    str | None,
    # Parsed before job ids, whose prefixes are completed there.
    typer.Option(metavar="URL", is_eager=True, help="Use this server. [env: GAITSWARM_SERVER]"),
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
        help="Resume although code, robot or compiler have changed; the job records it.",
    ),
]

RobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        metavar="NAME|JSON|FOLDER",
        help="Robot by name: szabadka2-reconstructed (the default), szabadka2-identified (table"
        " 2.7) or szabadka2 (datasheet); a variant as JSON, such as"
        ' {"contact_law": "stick", "backlash": [2.5, 1, 1]}; or a robot\'s folder.',
    ),
]

ControllerOption = Annotated[
    str | None,
    typer.Option(
        "--controller",
        help="Motor controller: fuzzy-pi, fuzzy-pi-3, p, pi, pid, joint-pd for torque-controlled"
        " actuators, or servo for position-controlled servos [default: that of the job or spec,"
        " else of the robot's folder, else fuzzy-pi].",
    ),
]

ConstraintOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="LIMIT",
        help="Limit that a design must keep: speed>=0.05, slope-fast:speed>=0.03 (one scenario) or"
        " energy<=0.9*published:A (relative to a published design or job:ID). Repeatable.",
    ),
]

NoConstraints = Annotated[bool, typer.Option("--no-constraints", help="Lift all constraints.")]

NoWorseThan = Annotated[
    str | None,
    typer.Option(
        metavar="published:NAME|ID|FILE.json",
        callback=completed_reference,
        help="Design that f1 to f5 may not exceed in any scenario: a published one, a job's best,"
        " or one of a file.",
    ),
]

ScenarioWeight = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=WEIGHT",
        help="Weight of a scenario in the geometric mean, such as slope-fast=2, and 1 for others"
        " [default: those of the job or spec]; repeatable.",
    ),
]

ScenarioAggregate = Annotated[
    str | None,
    typer.Option(
        metavar="mean|worst",
        help="Judge designs by the mean over the scenarios, or by the worst one [default: that of"
        " the job or spec, else mean].",
    ),
]

TrajectoryOption = Annotated[
    Path | None,
    typer.Option(
        "--trajectory", metavar="FILE", help="JSON object of gait parameters, added to the design."
    ),
]

PreferenceOption = Annotated[
    str | None,
    typer.Option(
        "--preference",
        help="Weighting of objectives: A, B, C or chapter-3 [default: the job's, else that of"
        " the robot's folder, else A].",
    ),
]

Precision = Annotated[
    str | None,
    typer.Option(
        metavar="single|double",
        help="Precision of the physics: double (the default), or single, which is about twice as"
        " fast. A job's best design is always evaluated in double.",
    ),
]

TerrainOption = Annotated[
    str | None,
    typer.Option(
        metavar="KIND:NUMBERS|JSON|FILE",
        help="Walk the scenarios on uneven ground: rough:0.01 (amplitude in m), stairs:0.02 or"
        " steps:0.02 (height in m), grid:FILE.csv:0.01 (rows of heights and their distance in m).",
    ),
]


@dataclass
class GivenOptions:
    """Options of which None says that the user did not pass them."""

    @property
    def given(self) -> dict[str, Any]:
        """Options that the user passed, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass
class SpecOptions(GivenOptions):
    """Options of commands that submit a job; None keeps the value of the spec file.

    Args:
        spec: Job spec as JSON; `-` reads standard input. Default: the chapter-4 job.
        iterations: Budget, in iterations of --particles designs.
        particles: Maximum designs per iteration.
        optimizer: Search method: cma-es, pso, auto, ...; `gaitswarm optimizers` lists all.
        optimizer_settings: Settings of the method, such as '{"sigma": 0.4}'.
        seed: Seed of all random numbers.
        start_from: Start from the best designs of earlier jobs, or from those of a file.
        start_count: Number of start designs [default: 5 of jobs, all of a file].
        preference: Weighting of objectives: A, B, C or chapter-3 (eq. 3.1).
        scenarios: Names, numbers or FILE.json, separated by commas.
        case: Evaluate designs by a plug-in's case, instead of the simulator, by its name or
            settings; `gaitswarm cases` lists all.
        with_gait: Also search the gait: stride, height, duty factor, FIR filter and, unless the
            scenarios differ in it, cycle time.
        worlds: Evaluate every design in this many worlds that differ from the model.
        aggregate: With --worlds: aggregation of utilities over worlds [default: cvar].
        level: With --worlds: level of the quantile or cvar [default: 0.75].
        worlds_seed: With --worlds: seed of the worlds [default: 1].
    """

    spec: Annotated[Path | None, typer.Option(metavar="FILE")] = None
    iterations: int | None = None
    particles: int | None = None
    optimizer: Annotated[str | None, typer.Option(metavar="NAME")] = None
    optimizer_settings: Annotated[str | None, typer.Option(metavar="JSON|FILE")] = None
    seed: int | None = None
    start_from: Annotated[
        str | None, typer.Option(metavar="ID[,ID]|FILE.csv", callback=completed_start)
    ] = None
    start_count: Annotated[int | None, typer.Option(min=1)] = None
    preference: str | None = None
    constraint: ConstraintOption = None
    no_worse_than: NoWorseThan = None
    scenarios: str | None = None
    terrain: TerrainOption = None
    controller: ControllerOption = None
    case: Annotated[str | None, typer.Option(metavar="NAME|JSON|FILE")] = None
    with_gait: Annotated[bool | None, typer.Option("--with-gait")] = None
    scenario_weight: ScenarioWeight = None
    scenario_aggregate: ScenarioAggregate = None
    worlds: Annotated[int | None, typer.Option(min=1, max=100)] = None
    aggregate: Annotated[str | None, typer.Option(metavar="mean|quantile|worst|cvar")] = None
    level: float | None = None
    worlds_seed: Annotated[int | None, typer.Option(min=0)] = None
    robot: RobotOption = None
    precision: Precision = None
    name: JobName = None


@dataclass
class WorkerOptions:
    """Options of commands that run jobs, named as the settings that they override.

    Args:
        evaluator: Where simulations run. ray: on Ray; in-process: in threads; auto: on Ray with an
            address and in servers, otherwise in threads. [env: GAITSWARM_EVALUATOR; default: auto]
        cpus: Parallel simulations on this machine. [env: GAITSWARM_CPUS; default: all cores]
        ray_address: Ray cluster for all simulations: HOST:PORT of its head, or auto on one of its
            nodes. [env: GAITSWARM_RAY_ADDRESS]
        cache: Reuse earlier simulations of the same designs in the database; results do not change.
            [env: GAITSWARM_CACHE; default: cache]
    """

    db: Db = None
    evaluator: str | None = None
    cpus: Annotated[int | None, typer.Option(min=1)] = None
    ray_address: Annotated[str | None, typer.Option(metavar="ADDRESS")] = None
    cache: Annotated[bool | None, typer.Option("--cache/--no-cache")] = None


@dataclass
class RunnerOptions(WorkerOptions):
    """Options of commands that run queued jobs.

    Args:
        concurrent_jobs: Jobs to run in parallel. [env: GAITSWARM_CONCURRENT_JOBS; default: 2]
    """

    concurrent_jobs: Annotated[int | None, typer.Option("--jobs", min=1, max=256)] = None


@dataclass
class Place:
    """Options of commands about jobs: where the jobs are."""

    server: Server = None
    db: Db = None

    def open(self, *, create: bool = False) -> Jobs:
        """Open the jobs; a missing SQLite file is created, or an error."""
        from gaitswarm.jobs.open import open_jobs

        return open_jobs(self.server, self.db, create=create)


def expanded(command: Callable[..., Any]) -> Callable[..., None]:
    """Return a command with the parameters that Typer expects.

    Dataclasses among its parameters become single options. A parameter `jobs: Jobs` becomes the
    options of `Place`, which is open until the result is printed. A command that returns `Printed`
    gets --json. Help texts that an annotation does not have are those of the docstring's "Args".
    """
    annotations = get_type_hints(command, None, {"Jobs": Place}, include_extras=True)
    prints = annotations.pop("return") == Printed
    groups = {name: kind for name, kind in annotations.items() if is_dataclass(kind)}
    parameters: list[inspect.Parameter] = []
    for parameter in _parameters(command, annotations):
        if parameter.name in groups:
            kind = cast(type, groups[parameter.name])
            parameters += _parameters(kind, get_type_hints(kind, include_extras=True))
        else:
            parameters.append(parameter)
    if prints:
        json = inspect.Parameter("as_json", inspect.Parameter.KEYWORD_ONLY, default=False)
        parameters.append(json.replace(annotation=Json))

    @wraps(command)
    def called(**values: Any) -> None:
        as_json = values.pop("as_json") if prints else False
        with ExitStack() as stack:
            for name, kind in groups.items():
                options = {field.name: values.pop(field.name) for field in fields(kind)}
                group: Any = cast(type, kind)(**options)
                values[name] = stack.enter_context(group.open()) if name == "jobs" else group
            gc.freeze()
            gc.enable()
            printed = command(**values)
            if prints:
                show(*printed, as_json=as_json)

    by_name = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in parameters]
    called.__signature__ = inspect.Signature(by_name)  # type: ignore[attr-defined]
    called.__doc__ = docstring_of(command).text
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in by_name}
    return called


def _parameters(
    command: Callable[..., Any], annotations: dict[str, Any]
) -> Iterator[inspect.Parameter]:
    """Yield the parameters of a command or a dataclass, with help texts of its docstring."""
    documented = reversed(command.__mro__) if isinstance(command, type) else [command]
    texts = {n: text for part in documented for n, text in docstring_of(part).arguments.items()}
    for name, parameter in inspect.signature(command).parameters.items():
        annotation = annotations[name]
        if name in texts:
            kind, option = annotation, typer.Option()
            if parameter.default is inspect.Parameter.empty:
                option = typer.Argument()
            if get_origin(annotation) is Annotated:
                kind, option = get_args(annotation)
            option = copy(option)
            option.help = texts[name]
            annotation = Annotated[kind, option]
        yield parameter.replace(annotation=annotation)
