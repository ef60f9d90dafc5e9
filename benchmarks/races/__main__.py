"""Race search methods, and print the tables of docs/optimizers.md from what is recorded.

    python -m benchmarks.races run PLAN... [--folder docs/data/races]
    python -m benchmarks.races keep REPORT
    python -m benchmarks.races tables [--folder docs/data/races]

`run` skips the runs that are in the folder's file of the plan, and appends every other one when it
has ended: stopped at any time, the same command goes on. Run k of a method has the seed that
`gaitswarm tournament --seed 1` gives it, and comes to the same. Walks of a search are in single
precision, what it found is judged in double.

`keep` takes over what the table of the test functions is made from, of the folder that
`gaitswarm tournament thesis` wrote.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from benchmarks.races import functions
from benchmarks.races.plans import PLANS
from benchmarks.races.records import FOLDER, read_all
from benchmarks.races.running import run_missing
from benchmarks.races.tables import all_tables


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    runs = commands.add_parser("run", help="what is missing of plans")
    known = ", ".join(PLANS)
    runs.add_argument("plans", nargs="+", choices=list(PLANS), metavar="PLAN", help=known)
    runs.add_argument("--repetitions", type=int, default=1000, help="at most; the first ones")
    kept = commands.add_parser("keep", help="the runs of a tournament on test functions")
    kept.add_argument("report", type=Path, help="the tournament's folder")
    tables = commands.add_parser("tables", help="print them as Markdown")
    for command in (runs, tables):
        command.add_argument("--folder", type=Path, default=FOLDER)
    given = parser.parse_args()
    if given.command == "run":
        for name in given.plans:
            plan = PLANS[name]
            plan = replace(plan, repetitions=min(plan.repetitions, given.repetitions))
            for done in run_missing(plan, given.folder / f"{name}.csv"):
                print(
                    f"{name}: run {done.repetition + 1} of {done.method} on {done.problem},"
                    f" {done.cpu_s:.0f} s",
                    flush=True,
                )
    elif given.command == "keep":
        functions.keep(given.report)
    else:
        of_functions = functions.table(functions.read())
        print("\n\n".join([*all_tables(read_all(given.folder)), of_functions]))


if __name__ == "__main__":
    main()
