"""The public names of gaitswarm: fast to import and typed."""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

import gaitswarm
from gaitswarm.services.optimizer.search.registry import METHODS
from tests.examples.paths import ROOT
from tests.examples.processes import python


def test_type_checkers_see_the_names_that_exist() -> None:
    stub = ast.parse(Path(gaitswarm.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    (exported,) = [node.value for node in stub.body if isinstance(node, ast.Assign)]
    assert sorted(gaitswarm.__all__) == sorted(ast.literal_eval(exported))
    for statement in stub.body:
        if isinstance(statement, ast.ImportFrom):
            module = import_module(str(statement.module))
            for alias in statement.names:
                assert getattr(gaitswarm, alias.name) is getattr(module, alias.name)


def test_the_settings_of_every_method_are_public() -> None:
    settings = {method.settings.__name__ for method in METHODS.built_in.values()}
    assert {"AutoSettings", *settings} <= set(gaitswarm.__all__)


def test_the_package_is_marked_as_typed() -> None:
    assert files("gaitswarm").joinpath("py.typed").is_file()


def test_importing_it_imports_nothing_else_of_size() -> None:
    program = (
        "import json, sys; before = set(sys.modules); import gaitswarm; import gaitswarm.jobs;"
        "print(json.dumps(sorted({m.split('.')[0] for m in set(sys.modules) - before})))"
    )
    done = python("-c", program)
    assert set(json.loads(done.stdout)) - sys.stdlib_module_names == {"gaitswarm"}


def test_its_version_is_that_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert gaitswarm.__version__ == project["version"]


def test_names_can_be_listed_before_they_are_used_and_others_do_not_exist() -> None:
    assert set(gaitswarm.__all__) <= set(dir(gaitswarm))
    with pytest.raises(AttributeError, match="optimise"):
        _ = gaitswarm.optimise  # type: ignore[attr-defined]


def test_jobs_have_the_same_methods_for_programs_with_an_event_loop() -> None:
    def methods(kind: type) -> dict[str, inspect.Signature]:
        found = {n: f for n, f in inspect.getmembers(kind) if inspect.isfunction(f)}
        return {n: inspect.signature(f) for n, f in found.items() if not n.startswith("_")}

    blocking, others = methods(gaitswarm.Jobs), methods(gaitswarm.AsyncJobs)
    assert blocking.keys() == others.keys()
    for name, signature in blocking.items():
        assert signature.parameters == others[name].parameters


def documented() -> Iterator[tuple[str, Any]]:
    """Public functions, and classes with their public methods; models document their fields, and
    the methods of `AsyncJobs` are documented at `Jobs`.
    """
    for name in gaitswarm.__all__:
        value = getattr(gaitswarm, name)
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value) and value.__module__.startswith("gaitswarm."):
            if hasattr(value, "model_fields") or value is gaitswarm.AsyncJobs:
                continue
            inherited = {member for base in value.__mro__[1:] for member in vars(base)}
            for member, attribute in vars(value).items():
                function = getattr(attribute, "__func__", attribute)
                own = not member.startswith("_") and member not in inherited
                if inspect.isfunction(function) and own:
                    yield f"{name}.{member}", function


DOCUMENTED = dict(documented())


@pytest.mark.parametrize("name", DOCUMENTED)
def test_every_argument_is_documented(name: str) -> None:
    function = DOCUMENTED[name]
    text = inspect.getdoc(function) or ""
    elsewhere = re.search(rf"[Aa]rguments[^`]* `(\w+)\.{function.__name__}`", text)
    if elsewhere is not None:
        assert {function.__name__, f"{elsewhere[1]}.{function.__name__}"} & DOCUMENTED.keys()
        return
    sections = dict(re.findall(r"^(\w+):\n((?:[ ]{4}.*\n?|\n)+)", text, re.MULTILINE))
    arguments = [
        parameter.name
        for parameter in inspect.signature(function).parameters.values()
        # `Jobs` documents `job_id` and `after` once for all methods.
        if parameter.name not in ("self", "cls", "job_id", "after")
        and parameter.kind != parameter.VAR_KEYWORD
    ]
    written = re.findall(r"^    (\w+): \S", sections.get("Args", ""), re.MULTILINE)
    assert text
    assert [argument for argument in arguments if argument not in written] == []
