"""A kernel for aarch64 in an emulator, which stands in a `NativeKernel` for the library.

What Python compiles cannot be loaded into a process of another architecture. So the kernel is
linked with a small program, emulated_call.c, that reads a call and writes what it left in memory.
"""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from gaitswarm.sim.compiler.compilation import (
    ARM,
    ARM_TARGET,
    Target,
    find_compiler,
    host_architecture,
)
from gaitswarm.sim.kernel.native import Walker
from tests.examples.paths import ROOT

TOOLS: Final = Path(sys.prefix) / "cross"
"""Where scripts/emulator.sh puts what a machine lacks."""

_ARGUMENTS: Final = 8
_FUNCTION: Final = re.compile(r"^(?:int64_t|void) (gaitswarm_\w+)\(", re.MULTILINE)


def tools_for_arm(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The emulator's command, and a compiler on the path; without them the test is skipped."""
    monkeypatch.setenv("PATH", f"{os.environ.get('PATH', '')}{os.pathsep}{TOOLS}")
    if find_compiler(ARM) is None:
        pytest.skip("NOT TESTED without a compiler for aarch64: run scripts/emulator.sh")
    if host_architecture() == ARM:
        return []
    for name in ("qemu-aarch64", "qemu-aarch64-static"):
        if found := shutil.which(name):
            return [found]
    pytest.skip("NOT TESTED without qemu-aarch64: run scripts/emulator.sh")


def build_program(source: str, executable: Path, aim: Target = ARM_TARGET) -> Path:
    """Compile and link a program with the flags of libraries, and without any library.

    source: lacks DOUBLES only.
    """
    compiler = find_compiler(aim.architecture)
    assert compiler is not None
    code = executable.with_suffix(".c")
    code.write_text(f"#define DOUBLES {aim.lanes}\n{source}", encoding="utf-8")
    flags = [flag for flag in compiler.flags(aim) if flag not in ("-shared", "-fPIC")]
    built = executable.with_suffix(".o")
    compiled = [*flags, "-mno-outline-atomics", "-c", str(code), "-o", str(built)]
    for arguments in (compiled, ["-static", "-nostdlib", str(built), "-o", str(executable)]):
        subprocess.run([*compiler.command, *arguments], check=True)
    return executable


class EmulatedLibrary:
    """C source, compiled for aarch64. Every call of a function is a process.

    Arguments are integers, arrays, and what a kernel is called with.
    """

    def __init__(self, source: str, folder: Path, emulator: list[str]) -> None:
        self._functions = _FUNCTION.findall(source)
        names = ", ".join(f"(Function)(void *){name}" for name in self._functions)
        main = (ROOT / "tests" / "sim" / "emulated_call.c").read_text(encoding="utf-8")
        text = f"{source}\n#define FUNCTIONS {names}\n{main}"
        self._command = [*emulator, str(build_program(text, folder / "kernel"))]

    def __getattr__(self, name: str) -> _Function:
        if name not in self._functions:
            raise AttributeError(name)
        function = _Function(self, self._command, self._functions.index(name))
        setattr(self, name, function)
        return function

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Bytes of a call's arrays; of those that are as long as a walk, of one tick."""
        joints = self.gaitswarm_joints()
        return {
            "q0": 8 * (7 + joints),
            "end": 8 * (7 + joints),
            "internal_state": 8 * self.gaitswarm_internal_state_size(),
            "parameters": 8 * self.gaitswarm_parameters(),
            "sums": 8 * self.gaitswarm_integrands(),
            "desired": 4 * joints,
            "disturbance": 8 * joints,
            "feed_forward": 8 * joints,
            "log": 8 * self.gaitswarm_log_width(),
            "robot": 8 * self.gaitswarm_constants(),
        }


class _Function:
    """A function of the library. Assigning `argtypes` and `restype` is of no effect."""

    argtypes: Any = None
    restype: Any = None

    def __init__(self, library: EmulatedLibrary, command: list[str], number: int) -> None:
        self._library, self._command, self._number = library, command, number

    def __call__(self, *arguments: Any) -> int:
        memory = _Memory()
        values, pointers = [0] * _ARGUMENTS, 0
        for k, argument in enumerate(arguments):
            if isinstance(argument, int):
                values[k] = argument
                continue
            if isinstance(argument, np.ndarray):
                values[k] = memory.copy_of(argument.ctypes.data, argument.nbytes)
                pointers |= 1 << k
                continue
            # What ctypes.byref makes tells what it points to in this way only.
            value = getattr(argument, "_obj", argument)
            values[k] = memory.copy_of(ctypes.addressof(value), ctypes.sizeof(value))
            pointers |= 1 << k
            self._follow(memory, value, values[k])
        head = [self._number, len(memory.pointers), len(memory.content), *values, pointers]
        numbers = [*head, *memory.pointers]
        message = (ctypes.c_int64 * len(numbers))(*numbers)
        done = subprocess.run(
            self._command, input=bytes(message) + memory.content, stdout=subprocess.PIPE, check=True
        )
        memory.write_back(done.stdout[8:])
        return int.from_bytes(done.stdout[:8], sys.byteorder, signed=True)

    def _follow(self, memory: _Memory, structure: ctypes.Structure, at: int) -> None:
        """Copy what a structure, at this place of the memory, points to: walkers with their own."""
        for owner, name, place in _pointers(structure, at):
            address = getattr(owner, name)
            if address is None:
                continue
            if name != "walkers":
                memory.point(place, address, self._size(structure, owner, name))
                continue
            walkers = (Walker * owner.n).from_address(address)
            first = memory.point(place, address, ctypes.sizeof(walkers))
            for k, walker in enumerate(walkers):
                self._follow(memory, walker, first + k * ctypes.sizeof(Walker))

    def _size(self, walker: Any, owner: Any, name: str) -> int:
        if name == "values":
            return int(owner.n_error * owner.n_current * owner.n_velocity)
        ticks = walker.ticks if name in ("desired", "disturbance", "feed_forward", "log") else 1
        return int(self._library.sizes[name] * ticks)


def _pointers(structure: ctypes.Structure, at: int) -> Iterator[tuple[Any, str, int]]:
    for name, kind, *_ in structure._fields_:
        place = at + getattr(type(structure), name).offset
        if kind is ctypes.c_void_p:
            yield structure, name, place
        elif issubclass(kind, ctypes.Structure):
            yield from _pointers(getattr(structure, name), place)


class _Memory:
    """Copies of this process's memory, with pointers into themselves."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.pointers: dict[int, int] = {}
        self._copies: list[tuple[int, int, int]] = []

    def copy_of(self, address: int, size: int) -> int:
        self.content += bytes(-len(self.content) % 64)
        place = len(self.content)
        self.content += ctypes.string_at(address, size)
        self._copies.append((address, place, size))
        return place

    def point(self, place: int, address: int, size: int) -> int:
        self.pointers[place] = address
        target = self.copy_of(address, size)
        self.content[place : place + 8] = target.to_bytes(8, sys.byteorder)
        return target

    def write_back(self, content: bytes) -> None:
        left = bytearray(content)
        assert len(left) == len(self.content)
        for place, address in self.pointers.items():
            left[place : place + 8] = address.to_bytes(8, sys.byteorder)
        for address, place, size in self._copies:
            after = bytes(left[place : place + size])
            if after != ctypes.string_at(address, size):
                ctypes.memmove(address, after, size)
