"""`gaitswarm study precision`: what single precision does to objectives and to their ranking."""

from __future__ import annotations

from typing import Annotated

import typer

from gaitswarm.cli.inputs.options import Json


def precision(
    designs: Annotated[
        int, typer.Option(min=2, help="Random designs for each law of friction.")
    ] = 1000,
    backlash_designs: Annotated[
        int, typer.Option(min=0, help="The same with backlash, at 40 kHz; 0 leaves it out.")
    ] = 100,
    long_designs: Annotated[
        int, typer.Option(min=0, help="The same over walks of 60 s; 0 leaves them out.")
    ] = 100,
    robot: Annotated[
        str | None, typer.Option(help="Name of a shipped robot. Default: the default one.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the designs.")] = 1,
    cpus: Annotated[
        int | None, typer.Option(min=1, help="Walks to compute at once; default: all cores.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Let random designs walk in single and in double precision, and compare.

    In the six scenarios, with every law of friction, with backlash, and over long walks; fitness is
    that of preference A.
    """
    import json

    from gaitswarm.cli.output import note, print_text, stdout_console
    from gaitswarm.cli.studies.precision import compare, study_document, study_tables, variants
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.sim.robot import DEFAULT_ROBOT
    from gaitswarm.sim.robot.variant import SHIPPED

    name = robot or DEFAULT_ROBOT
    if name not in SHIPPED:
        raise InvalidRequest(f"{name!r} is none of {', '.join(SHIPPED)}", field="robot")
    planned = variants(name, designs=designs, with_backlash=backlash_designs, long=long_designs)
    found = []
    for variant in planned:
        note(f"{variant.name}: {variant.designs} designs")
        found.append(compare(variant, seed=seed, cpus=cpus))
    if as_json:
        print_text(json.dumps(study_document(found), indent=2))
        return
    for table in study_tables(found):
        stdout_console().print(table)
    note(
        "deviation: of single from double; 1 mg: of the fitness in double when the robot carries\n"
        "a milligram more; loss: how much worse than the best the design is that single takes for\n"
        "the best, both in double"
    )
