"""Build the shipped robots' kernels for machines without a compiler: python -m scripts.prebuilt

They are put into the package, where git ignores them and a wheel brings them. What is built is a
matter of this machine's compilers: for its own architecture any, for the other one a cross-compiler
or zig (`scripts/emulator.sh` fetches it).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final, get_args

from gaitswarm.sim.compiler.compilation import (
    ARM,
    ARM_TARGET,
    PREBUILT,
    X86_TARGETS,
    Target,
    build_library,
    find_compiler,
)
from gaitswarm.sim.controllers.quantisation import inference_source
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.emitted.source import kernel_identity, kernel_source
from gaitswarm.sim.robot.variant import SHIPPED, shipped_robot

TARGETS: Final[Mapping[str, Target]] = {
    **{aim.level: aim for aim in X86_TARGETS},
    ARM: ARM_TARGET,
}
"""What is built, by name."""

Source = tuple[str, bytes, Callable[[], str]]


def sources(robots: Sequence[str]) -> Iterator[Source]:
    """What robots need: the name, the identity and the text of each library, but once."""
    inference = inference_source()
    yield "inference", inference.encode(), partial(str, inference)
    seen: set[bytes] = set()
    for name in robots:
        robot = shipped_robot(name)
        for precision in get_args(Precision):
            identity = kernel_identity(robot, precision)
            if identity not in seen:
                seen.add(identity)
                text = kernel_source(robot, precision)
                yield f"kernel-{precision}-{name}", identity, partial(str, text)


def build(robots: Sequence[str], targets: Sequence[str], directory: Path) -> list[Path]:
    """Build all libraries of robots for targets into a directory; returns their paths."""
    built = []
    for name, identity, source in sources(robots):
        for target in targets:
            library = build_library(
                name, identity, source, compile_for=TARGETS[target], directory=directory
            )
            if library is None:
                raise SystemExit(f"{target}: there is no compiler for {TARGETS[target]}")
            print(f"{target:10} {library.stat().st_size / 1000:5.0f} kB  {library}")
            built.append(library)
    return built


def main(arguments: Sequence[str] | None = None) -> None:
    """Build what is asked for, and remove what is of no use any more."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--targets", nargs="+", choices=TARGETS, help="default: all that can be")
    parser.add_argument("--robots", nargs="+", choices=SHIPPED, default=SHIPPED)
    parser.add_argument("--directory", type=Path, default=PREBUILT)
    given = parser.parse_args(arguments)
    targets = given.targets or [
        name for name, aim in TARGETS.items() if find_compiler(aim.architecture) is not None
    ]
    for name in TARGETS.keys() - set(targets):
        print(f"{name} is left out", file=sys.stderr)
    built = build(given.robots, targets, given.directory)
    kept = {
        path for library in built for path in (library, library.with_name(f"{library.name}.sha256"))
    }
    for path in given.directory.iterdir():
        if path not in kept:
            path.unlink()


if __name__ == "__main__":
    main()
