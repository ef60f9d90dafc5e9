"""`gaitswarm bench`: how fast this machine simulates."""

from __future__ import annotations

from typing import Annotated

import typer

from cli.options import Json


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(bench)


def bench(
    repeats: Annotated[
        int, typer.Option(min=1, max=1000, help="Passes; the fastest one counts.")
    ] = 3,
    backend: Annotated[
        str, typer.Option(help="auto, native (compiled) or reference (interpreted).")
    ] = "auto",
    as_json: Json = False,
) -> None:
    """Measure the simulator on one core, with the physics of the main Fuzzy-PI job."""
    import json
    from dataclasses import asdict
    from typing import get_args

    from cli.output import print_text
    from services.optimizer.errors import InvalidRequest
    from sim.assembly import Backend
    from sim.benchmark import measure

    for known in get_args(Backend):
        if backend == known:
            result = measure(repeats=repeats, backend=known)
            break
    else:
        known = ", ".join(get_args(Backend))
        raise InvalidRequest(f"{backend!r} is none of {known}", field="backend")
    if as_json:
        print_text(json.dumps(asdict(result), indent=2))
        return
    print_text(
        f"{result.backend} kernel, {result.lanes} walkers in lock-step:"
        f" {result.us_per_step_per_walker:.3f} us per physics step and walker,"
        f" {result.real_time_factor_per_core:.0f} x real time on one core"
    )
