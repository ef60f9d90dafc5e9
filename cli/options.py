"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SpecFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Job spec as JSON; `-` reads standard input. Without one: the chapter-4 job.",
    ),
]

Iterations = Annotated[int | None, typer.Option(help="Iterations to run.")]

Particles = Annotated[int | None, typer.Option(help="Size of the swarm.")]

Seed = Annotated[int | None, typer.Option(help="Source of all randomness.")]

PreferenceOption = Annotated[
    str | None, typer.Option("--preference", help="How objectives are weighed: A, B or C.")
]

Scenarios = Annotated[
    str | None, typer.Option(help="Names, numbers or FILE.json, separated by commas.")
]

ControllerOption = Annotated[
    str | None, typer.Option("--controller", help="fuzzy-pi, fuzzy-pi-3, p, pi or pid.")
]

RobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        metavar="NAME|JSON|FOLDER",
        help="Robot by name, a variant as JSON, such as"
        ' {"contact_law": "stick", "backlash": [2.5, 1, 1]}, or the folder of your own.',
    ),
]

JobName = Annotated[str | None, typer.Option("--name", help="Name of the job, for people.")]

JobId = Annotated[str, typer.Argument(metavar="ID", help="Identifier of the job.")]

Server = Annotated[
    str | None,
    typer.Option(metavar="URL", help="Ask this server. [env: GAITSWARM_SERVER]"),
]

Db = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
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

EvaluatorOption = Annotated[
    str | None,
    typer.Option(
        "--evaluator",
        help="ray, or in-process (threads of this process). [env: GAITSWARM_EVALUATOR; default:"
        " ray]",
    ),
]

Cpus = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Walks to compute at once on this machine. [env: GAITSWARM_CPUS; default: all cores]",
    ),
]

RayAddress = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Use this Ray cluster; else one is started, and ended. [env: GAITSWARM_RAY_ADDRESS]",
    ),
]
