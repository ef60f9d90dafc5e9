"""Expansion of xacro files."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Final
from unittest.mock import patch

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.bounds import check_urdf

PackageFinder = Callable[[str], str]
"""Returns the folder of a ROS package by its name; raises RobotFileError if there is none."""

ELSEWHERE: Final = "needs other files; convert it next to them: gaitswarm robot init FILE"


def require(module: str, form: str) -> None:
    if find_spec(module) is None:
        raise RobotFileError(
            f"robot.urdf: a robot in {form} needs pip install 'gaitswarm[{module}]', which is not"
            " installed here; or convert it to a URDF"
        )


def no_package(name: str) -> str:
    raise RobotFileError(f"package {name!r} is not at hand")


def expanded(
    text: str,
    path: Path | None = None,
    find: PackageFinder = no_package,
    arguments: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Expand a xacro text; None as the path of its file marks it as untrusted."""
    check_urdf(text)
    require("xacro", "xacro")
    import xacro  # noqa: PLC0415  an extra

    # xacro asks ROS for packages, which is not installed on most machines.
    packages = ModuleType("ament_index_python.packages")
    packages.__dict__["get_package_share_directory"] = find
    ros = {"ament_index_python": ModuleType("ament_index_python"), packages.__name__: packages}
    try:
        with (
            patch.dict(sys.modules, ros),
            redirect_stderr(StringIO()),
            _restricted(xacro, trusted=path is not None),
        ):
            xacro.init_stacks(None if path is None else str(path))
            document = xacro.parse(text)
            xacro.process_doc(document, mappings=dict(arguments))
            return str(document.toprettyxml(indent="  "))
    except Exception as error:  # expressions may raise anything
        cause: BaseException = error
        while isinstance(inner := getattr(cause, "exc", None), BaseException):
            cause = inner
        said = str(cause if isinstance(cause, RobotFileError) else error)
        if "Undefined substitution argument" in said:
            said += "; give its value (`--arg NAME=VALUE`)"
        raise RobotFileError(f"robot.urdf: xacro: {' '.join(said.split())[:500]}") from error


_COMPUTES: Final = (
    *(ast.Expression, ast.Constant, ast.Name, ast.Load, ast.BinOp, ast.UnaryOp, ast.BoolOp),
    *(ast.operator, ast.unaryop, ast.boolop, ast.cmpop, ast.Compare, ast.IfExp, ast.Call),
    *(ast.Subscript, ast.Slice, ast.List, ast.Tuple, ast.Dict),
)


@contextmanager
def _restricted(xacro: Any, *, trusted: bool) -> Iterator[None]:
    """Keep an untrusted text from other files, the environment and Python's objects."""
    if trusted:
        yield
        return
    evaluate, substitute = xacro.safe_eval, xacro.eval_extension

    def computed(expression: str, *symbols: Any) -> Any:
        for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
            if isinstance(node, ast.Attribute):
                module = isinstance(node.value, ast.Name) and node.value.id in ("math", "python")
                allowed = module and not node.attr.startswith("_") and node.attr not in _TOO_FREE
            else:
                allowed = isinstance(node, _COMPUTES) and getattr(node, "id", "") not in _TOO_FREE
            if not allowed:
                raise RobotFileError(f"the expression {expression[:100]!r} does more than compute")
        return evaluate(expression, *symbols)

    def substituted(text: str) -> Any:
        if re.fullmatch(r"\$\(arg \w+\)", text):
            return substitute(text)
        raise RobotFileError(f"{text[:100]} {ELSEWHERE}")

    def included(*_: object) -> None:
        raise RobotFileError(f"<xacro:include> {ELSEWHERE}")

    with patch.multiple(
        xacro, safe_eval=computed, eval_extension=substituted, process_include=included
    ):
        yield


_TOO_FREE: Final = frozenset({"load_yaml", "abs_filename", "xacro", "type", "vars"})
"""Functions of xacro's expressions that read files or reach Python's objects."""
