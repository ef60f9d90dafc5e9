"""Thorough tests name the tests that cover them in `make test`."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from tests.examples.paths import ROOT
from tests.examples.variants import left_out

IDS = ["sqlite-pso", "sqlite-ga", "postgresql-pso", "postgresql-ga"]


@pytest.mark.parametrize(
    ("shown", "without", "run"),
    [
        ((), (), ["sqlite-pso"]),
        (("sqlite-*",), (), ["sqlite-pso", "sqlite-ga"]),
        (("sqlite-ga", "*-pso"), (), ["sqlite-pso", "sqlite-ga", "postgresql-pso"]),
        ((), "postgresql-ga", ["sqlite-pso", "sqlite-ga", "postgresql-pso"]),
        ((), ("postgresql-*", "*-ga"), ["sqlite-pso"]),
    ],
)
def test_named_instances_are_run_or_the_first_or_all_but_those_left_out(
    shown: tuple[str, ...], without: str | tuple[str, ...], run: list[str]
) -> None:
    more = left_out(IDS, *shown, without=without)
    assert [each for each in IDS if each not in more] == run


@pytest.mark.parametrize(
    ("shown", "without", "message"),
    [
        (("sqlite-tlbo",), (), "names 'sqlite-tlbo', but the instances are"),
        ((), "mysql-*", r"names 'mysql-\*', but the instances are"),
        (("*",), (), "leaves out 0 of 4"),
        ((), "*", "leaves out 4 of 4"),
        (("*-ga",), "sqlite-*", "not both"),
    ],
)
def test_a_name_that_fits_nothing_is_an_error_and_so_is_leaving_out_all_or_nothing(
    shown: tuple[str, ...], without: str | tuple[str, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        left_out(IDS, *shown, without=without)


def test_brackets_of_an_id_stand_for_themselves() -> None:
    assert left_out(["[1, 2]", "1"], "[1, 2]") == ["1"]


MARK = "pytest.mark.thorough"


def _tests() -> Iterator[tuple[str, list[str] | None]]:
    """Every test function, and why it is thorough as a whole; None where it is not."""
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        names = re.findall(r"^ *def (test_\w+)", text, re.MULTILINE)
        why = _thorough_tests(ast.parse(text)) if MARK in text else {}
        yield from ((name, why.get(name)) for name in names)


def _thorough_tests(module: ast.Module) -> dict[str, list[str]]:
    """Why tests of a module are thorough, by name."""
    of_module = [
        mark
        for node in module.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark"
        for mark in (node.value.elts if isinstance(node.value, ast.List) else [node.value])
    ]
    found = {}
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            marks = [mark for mark in (*of_module, *node.decorator_list) if _is_thorough(mark)]
            if marks:
                found[node.name] = [reason for mark in marks for reason in _reasons(mark)]
    return found


def _is_thorough(mark: ast.expr) -> bool:
    return ast.unparse(mark.func if isinstance(mark, ast.Call) else mark) == MARK


def _reasons(mark: ast.expr) -> list[str]:
    return [ast.literal_eval(why) for why in mark.args] if isinstance(mark, ast.Call) else []


def test_a_test_that_is_left_out_as_a_whole_says_why_and_names_only_tests_that_are_not() -> None:
    tests = list(_tests())
    left = {name: why for name, why in tests if why is not None}
    assert len(left) > 10
    assert [name for name, why in left.items() if not why] == []
    run = {name for name, why in tests if why is None}
    named = {each for why in left.values() for each in re.findall(r"test_\w+", " ".join(why))}
    assert len(named) > 5
    assert named - run == set()
