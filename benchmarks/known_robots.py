"""From a robot's file to a tuned walk: other people's robots, in the commands that users run.

    python -m benchmarks.known_robots [ROBOT ...] [--iterations 20] [--particles 25] [--seed 1]
        [--evaluator in-process] [--json]

`gaitswarm robot init` makes each robot of its file as the package example-robot-data or its
repository has it (`scripts/robots.sh`), `robot check` lets it stand, and `gaitswarm optimize
--robot` tunes it in its two default scenarios. A robot stands if its soles carry its weight. A walk
is three cycles; one without a fall is `ok`. The cost of transport is the motors' electrical
energy per weight and distance. The wall time is that of both commands, from an empty kernel cache.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

from tests.robots.known import ROBOTS

COMMAND: Final = "from gaitswarm.cli.main import main; main()"
GRAVITY: Final = 9.81
MOST_DESIGNS: Final = 1000

STANDS: Final = 0.02
"""Share of the weight by which the force on a standing robot's soles may be off."""

HEAD: Final = """\
| robot | legs | mass | stands | designs that walk both | `slow` | cost | `fast` | cost | time |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"""


def tuned(urdf: Path, folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Make a robot, tune it, and tell how its best design walks."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
    robot, database = folder / "robot", folder / "jobs.db"

    def gaitswarm(*arguments: str | Path) -> str:
        command = [sys.executable, "-c", COMMAND, *map(str, arguments)]
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, encoding="utf-8", check=False
        )
        if done.returncode:
            raise SystemExit(f"{' '.join(map(str, arguments))}:\n{done.stderr}")
        return done.stdout

    begun = time.perf_counter()
    gaitswarm("robot", "init", urdf, "--output", robot)
    job = json.loads(
        gaitswarm(
            *("optimize", "--robot", robot, "--json", "--db", database),
            *("--iterations", str(options.iterations), "--particles", str(options.particles)),
            *("--seed", str(options.seed), "--evaluator", options.evaluator),
        )
    )
    seconds = time.perf_counter() - begun
    check = json.loads(gaitswarm("robot", "check", robot, "--json"))
    gaitswarm("export", job["id"], "--db", database, "--output", folder / "designs.csv")
    with (folder / "designs.csv").open(encoding="utf-8", newline="") as file:
        designs = list(csv.DictReader(file))
    names = job["scenarios"]
    upright = [all(row[f"{name}.status"] == "ok" for name in names) for row in designs]
    walks = {} if job["best"] is None else job["best"]["scenarios"]
    return {
        "legs": len(check["legs"]),
        "mass": check["mass"],
        "standing": check["standing"]["normal_forces"] / check["standing"]["weight"],
        "designs": len(designs),
        "upright": sum(upright),
        "seconds": seconds,
        "walks": {name: _walk(walks.get(name), check["mass"]) for name in names},
    }


def _walk(result: dict[str, Any] | None, mass: float) -> dict[str, Any]:
    """How a design walks in a scenario; None: no design walks in all."""
    if result is None:
        return {"status": "none", "speed": None, "cost_of_transport": None}
    objectives = result["objectives"]
    return {
        "status": result["status"],
        "speed": 1.0 / objectives["reciprocal_speed"],
        "cost_of_transport": objectives["energy"] / (mass * GRAVITY),
    }


def line(name: str, row: dict[str, Any]) -> str:
    """Of the table, as docs/robots.md has it."""
    stands = "yes" if abs(row["standing"] - 1.0) < STANDS else f"{row['standing']:.0%}"
    cells = [name, str(row["legs"]), f"{row['mass']:.1f} kg", stands]
    cells.append(f"{row['upright']} of {row['designs']}")
    for walk in row["walks"].values():
        walked = walk["status"] == "ok"
        cells += [
            f"{walk['speed']:.2f} m/s" if walked else "falls",
            f"{walk['cost_of_transport']:.1f}" if walked else "",
        ]
    return f"| {' | '.join(cells)} | {row['seconds']:.0f} s |"


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robots", nargs="*", default=list(ROBOTS), metavar="ROBOT")
    parser.add_argument("--iterations", type=int, default=20)
    parser.add_argument("--particles", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--evaluator", default="in-process")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    unknown = sorted(set(options.robots) - set(ROBOTS))
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}; known are {', '.join(ROBOTS)}")
    if options.iterations * options.particles > MOST_DESIGNS:
        parser.error(f"a job of at most {MOST_DESIGNS} designs is what is asked for")
    missing = [name for name in options.robots if not ROBOTS[name].is_file()]
    if missing:
        print(f"missing: {', '.join(missing)}; run scripts/robots.sh", file=sys.stderr)
    rows = {}
    if not options.json:
        print(HEAD)
    for name in (name for name in options.robots if name not in missing):
        with tempfile.TemporaryDirectory() as folder:
            rows[name] = tuned(ROBOTS[name], Path(folder), options)
        if not options.json:
            print(line(name, rows[name]), flush=True)
    if options.json:
        print(json.dumps(rows, indent=2))


if __name__ == "__main__":
    main()
