"""`gaitswarm bench`: simulation speed of this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

import typer

from gaitswarm.cli.inputs.options import Precision, one_of

if TYPE_CHECKING:
    from gaitswarm.cli.output import Printed
    from gaitswarm.services.profile import JobProfile

_SHARES: Final = {
    "physics": "kernel: physics steps",
    "control": "kernel: control ticks",
    "tables": "tasks: fuzzy tables",
    "preparation": "tasks: desired angles, parameters, objectives",
    "workers": "transfer of tasks and results, waiting for the last worker",
    "search": "judging designs and asking for the next",
    "store": "store",
}


def bench(
    repeats: Annotated[
        int, typer.Option(min=1, max=1000, help="Passes; the fastest one counts.")
    ] = 3,
    backend: Annotated[
        str, typer.Option(help="auto, native (compiled) or reference (interpreted).")
    ] = "auto",
    precision: Precision = None,
    profile: Annotated[
        bool,
        typer.Option("--profile", help="Profile a complete job of chapter 4 on all cores."),
    ] = False,
    evaluator: Annotated[
        str, typer.Option(help="Workers of the profiled job: ray or in-process.")
    ] = "ray",
) -> Printed:
    """Measure the simulator's speed on one core, for the main Fuzzy-PI job."""
    from dataclasses import asdict
    from typing import get_args

    from gaitswarm.services.worker import EvaluatorKind
    from gaitswarm.sim import benchmark
    from gaitswarm.sim.assembly import Backend
    from gaitswarm.sim.kernel import walk

    digits: walk.Precision = one_of(get_args(walk.Precision), precision or "double", "precision")
    if profile:
        from gaitswarm.services.profile import profile_job

        kind: EvaluatorKind = one_of(get_args(EvaluatorKind), evaluator, "evaluator")
        measured = profile_job(evaluator=kind, precision=digits)
        return asdict(measured), _profile_text(measured)
    requested: Backend = one_of(get_args(Backend), backend, "backend")
    result = benchmark.measure(repeats=repeats, backend=requested, precision=digits)
    size = (
        "" if result.bytes_of_code is None else f", {result.bytes_of_code / 1024:.0f} KiB of code"
    )
    return asdict(result), (
        f"{result.backend} kernel in {result.precision} precision, {result.lanes} walkers in"
        f" lock-step{size}: {result.us_per_step_per_walker:.3f} us per physics step and walker,"
        f" {result.real_time_factor_per_core:.0f} x real time on one core,"
        f" {result.lane_use:.1%} of its lanes used"
    )


def _profile_text(profile: JobProfile) -> str:
    heading = (
        f"{profile.walks} simulations of a chapter-4 job, {profile.slots} slots"
        f" ({profile.evaluator}), {profile.precision} precision: {profile.seconds:.2f} s,"
        f" {profile.walks_per_second:.0f} simulations/s, {profile.lane_use:.1%} of the kernel's"
        " lanes used"
    )
    lines = [f"  {name:12} {share:6.1%}  {_SHARES[name]}" for name, share in profile.shares.items()]
    return "\n".join([heading, "shares of the slots' time:", *lines])
