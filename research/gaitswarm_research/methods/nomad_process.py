"""NOMAD in a separate process, controlled by lines of JSON.

It runs as a script, so that it imports only PyNomad. Each line on stdin is answered by one on
stdout:

    {"x0": [...], "lower": [...], "upper": [...], "parameters": [...]}   begins a run
    {"values": [...]}         values of the points of the last block, null for a failure

    {"block": [[...], ...]}   points to evaluate
    {"block": null}           the run has ended

The process ends when stdin closes, also in the middle of a run.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any


def main() -> None:
    """Serve runs until stdin ends."""
    import PyNomad

    # NOMAD prints messages to stdout, so answers use a copy of it.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

    def exchange(block: list[list[float]] | None) -> dict[str, Any]:
        """Answer, and wait for the next line."""
        try:
            answers.write(json.dumps({"block": block}) + "\n")
            answers.flush()
        except BrokenPipeError:
            os._exit(0)
        return _receive()

    def evaluate(block: Any) -> list[bool]:
        points = [block.get_x(k) for k in range(block.size())]
        values = exchange([[x.get_coord(j) for j in range(x.size())] for x in points])["values"]
        for point, value in zip(points, values, strict=True):
            if value is not None:
                point.setBBO(repr(value).encode())
        return [value is not None for value in values]

    run = _receive()
    while True:
        PyNomad.optimize(evaluate, run["x0"], run["lower"], run["upper"], run["parameters"])
        run = exchange(None)


def _receive() -> dict[str, Any]:
    """Read the next line. Exit at the end, because an exception would not pass through NOMAD."""
    line = sys.stdin.readline()
    if not line:
        os._exit(0)
    message: dict[str, Any] = json.loads(line)
    return message


if __name__ == "__main__":
    main()
