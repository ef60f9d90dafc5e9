"""Every public function says what each of its arguments means."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]

FILES = (
    "sim/**/*.py",
    "services/optimizer/search/*.py",
    "services/optimizer/jobs/*.py",
    "services/optimizer/analysis/*.py",
    "services/optimizer/store/*.py",
    "services/optimizer/run/*.py",
    "services/optimizer/service.py",
    "services/worker/*.py",
    "services/*.py",
    "gaitswarm/views/*.py",
    "gaitswarm/requests/*.py",
    "gaitswarm/jobs/*.py",
    "api/*.py",
)
"""Without the API's routes, whose parameters are described to clients."""

TREES = {
    path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
    for pattern in FILES
    for path in ROOT.glob(pattern)
}

ALGEBRA = "sim/kernel/spatial.py"
"""Here a formula of its arguments says what a function does."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def classes(tree: ast.Module) -> Iterator[ast.ClassDef]:
    return (node for node in tree.body if isinstance(node, ast.ClassDef))


def functions(node: ast.Module | ast.ClassDef) -> Iterator[Function]:
    """Public ones."""
    for child in node.body:
        if isinstance(child, Function) and not child.name.startswith("_"):
            yield child


def is_port(node: ast.ClassDef) -> bool:
    return any(isinstance(base, ast.Name) and base.id in ("Protocol", "ABC") for base in node.bases)


def undocumented(function: Function, *, is_method: bool) -> list[str]:
    """Arguments that the docstring does not list."""
    a = function.args
    names = [x.arg for x in (*a.posonlyargs, *a.args)][int(is_method) :]
    names += [x.arg for x in (a.vararg, *a.kwonlyargs, a.kwarg) if x is not None]
    listed = (ast.get_docstring(function) or "").partition("Args:")[2]
    return [name for name in names if not re.search(rf"\n    \*{{0,2}}{name}: ", listed)]


PORTS = {
    method.name
    for tree in TREES.values()
    for port in classes(tree)
    if is_port(port)
    for method in functions(port)
    if not undocumented(method, is_method=True)
}
"""Methods that a port documents, so that a line is enough for an implementation."""


def shared_arguments(tree: ast.Module) -> str:
    """Those that a module documents once for all its functions."""
    return (ast.get_docstring(tree) or "").partition("Args that mean the same throughout:")[2]


def silent_arguments(
    function: Function, *, is_method: bool, is_algebra: bool, shared: str
) -> list[str]:
    """Arguments that nothing tells of."""
    text = ast.get_docstring(function) or ""
    missing = [
        name
        for name in undocumented(function, is_method=is_method)
        if f"\n    {name}: " not in shared
    ]
    if text and "\n" not in text:
        if is_method and function.name in PORTS:
            return []
        if is_algebra:
            return [name for name in missing if not re.search(rf"\b{name}\b", text)]
    return missing


def test_every_argument_of_a_public_function_is_documented() -> None:
    silent = []
    for path, tree in TREES.items():
        owners: list[ast.Module | ast.ClassDef] = [tree]
        owners += [node for node in classes(tree) if not node.name.startswith("_")]
        for owner in owners:
            for function in functions(owner):
                missing = silent_arguments(
                    function,
                    is_method=owner is not tree,
                    is_algebra=path == ALGEBRA,
                    shared=shared_arguments(tree),
                )
                silent += [f"{path}: {function.name}: {name}" for name in missing]
    assert silent == []


def test_no_docstring_only_sends_its_reader_elsewhere() -> None:
    senders = [
        f"{path}: {node.name}"
        for path, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, Function | ast.ClassDef)
        and (ast.get_docstring(node) or "").startswith("See `")
    ]
    assert senders == []
