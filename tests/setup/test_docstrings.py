"""Every public function says what each of its arguments means."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]

FILES = (
    "sim/**/*.py",
    "services/optimizer/search/**/*.py",
    "services/optimizer/jobs/**/*.py",
    "services/optimizer/analysis/**/*.py",
    "services/optimizer/tournament/*.py",
    "services/optimizer/store/*.py",
    "services/optimizer/store/*/*.py",
    "services/optimizer/run/*.py",
    "services/optimizer/service.py",
    "services/worker/*.py",
    "services/*.py",
    "gaitswarm/views/*.py",
    "gaitswarm/requests/*.py",
    "gaitswarm/jobs/**/*.py",
    "api/*.py",
)
"""Without the API's routes, whose parameters are described to clients."""


@cache
def trees() -> dict[str, ast.Module]:
    """All files, by path."""
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for pattern in FILES
        for path in ROOT.glob(pattern)
    }


ALGEBRA = "sim/kernel/dynamics/spatial.py"
"""Here a formula of its arguments says what a function does."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def classes(tree: ast.Module) -> Iterator[ast.ClassDef]:
    return (node for node in tree.body if isinstance(node, ast.ClassDef))


def functions(node: ast.Module | ast.ClassDef) -> Iterator[Function]:
    """Public ones."""
    for child in node.body:
        if isinstance(child, Function) and not child.name.startswith("_"):
            yield child


def arguments(function: Function, *, is_method: bool) -> list[str]:
    a = function.args
    names = [x.arg for x in (*a.posonlyargs, *a.args)][int(is_method) :]
    return names + [x.arg for x in (a.vararg, *a.kwonlyargs, a.kwarg) if x is not None]


def is_listed(name: str, function: Function) -> bool:
    """Whether the docstring has the argument in its list."""
    listed = (ast.get_docstring(function) or "").partition("Args:")[2]
    return re.search(rf"\n    \*{{0,2}}{name}: ", listed) is not None


def is_port(node: ast.ClassDef) -> bool:
    return any(isinstance(base, ast.Name) and base.id in ("Protocol", "ABC") for base in node.bases)


@cache
def in_ports() -> set[tuple[str, str]]:
    """Methods and arguments that a port documents: a line is enough for an implementation."""
    return {
        (method.name, name)
        for tree in trees().values()
        for port in classes(tree)
        if is_port(port)
        for method in functions(port)
        for name in arguments(method, is_method=True)
        if is_listed(name, method)
    }


def undocumented(function: Function, *, is_method: bool, is_algebra: bool) -> list[str]:
    """Arguments that the docstring does not tell of."""
    text = ast.get_docstring(function) or ""
    silent = [x for x in arguments(function, is_method=is_method) if not is_listed(x, function)]
    if text and "\n" not in text:
        if is_method:
            return [name for name in silent if (function.name, name) not in in_ports()]
        if is_algebra:
            return [name for name in silent if not re.search(rf"\b{name}\b", text)]
    return silent


def test_every_argument_of_a_public_function_is_documented() -> None:
    silent = []
    for path, tree in trees().items():
        owners: list[ast.Module | ast.ClassDef] = [tree]
        owners += [node for node in classes(tree) if not node.name.startswith("_")]
        for owner in owners:
            for function in functions(owner):
                missing = undocumented(
                    function, is_method=owner is not tree, is_algebra=path == ALGEBRA
                )
                silent += [f"{path}: {function.name}: {name}" for name in missing]
    assert silent == []


def test_no_docstring_only_sends_its_reader_elsewhere() -> None:
    senders = [
        f"{path}: {node.name}"
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, Function | ast.ClassDef)
        and (ast.get_docstring(node) or "").startswith("See `")
    ]
    assert senders == []
