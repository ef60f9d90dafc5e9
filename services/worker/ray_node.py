"""A node of a Ray cluster: `ray start --block`, which ends when the node's raylet has ended.

    python -m gaitswarm.services.worker.ray_node --head --port=6379

Ray's own goes on without a raylet that has ended by itself, as one does when an agent of it is
killed: the node is gone then, and whatever starts nodes again does not know.
"""

from __future__ import annotations

import os
import runpy
import sys
from collections.abc import Callable, Sequence
from typing import Any, Final

_RAYLET: Final = "raylet"
"""Ray's name for the kind of process."""


def main(arguments: Sequence[str]) -> None:
    """Be a node until it ends or is told to.

    Args:
        arguments: Options of `ray start`, but for `--block`.
    """
    from ray._private.node import Node  # noqa: PLC0415 - takes a second, and not all have it

    dead_processes: Callable[[Any], Any] = Node.dead_processes

    def dead_processes_or_end(node: Any) -> Any:
        """Asked by `ray start --block` every second."""
        dead = dead_processes(node)
        if any(kind == _RAYLET for kind, _ in dead):
            sys.stderr.write("the raylet has ended, and the node with it\n")
            sys.stderr.flush()
            node.kill_all_processes(check_alive=False, allow_graceful=False)
            os._exit(1)
        return dead

    Node.dead_processes = dead_processes_or_end  # type: ignore[method-assign]
    sys.argv = ["ray", "start", "--block", *arguments]
    runpy.run_module("ray.scripts.scripts", run_name="__main__")


if __name__ == "__main__":
    main(sys.argv[1:])
