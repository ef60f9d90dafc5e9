"""Fast start-up, help and clean ends of the command line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pytest
from typer import Context, Option, Typer
from typer.main import get_command

from gaitswarm.cli.exit_codes import ExitCode
from gaitswarm.cli.main import commands
from gaitswarm.cli.options import expanded
from tests.cli.conftest import Gaitswarm, finish
from tests.examples.processes import loaded_by

HEAVY = (
    "ray", "pinocchio", "casadi", "numpy", "sqlalchemy", "fastapi", "pydantic", "matplotlib",
    "pyarrow", "rich", "httpx2",
)  # fmt: skip


@pytest.mark.slow
def test_help_imports_none_of_the_heavy_packages() -> None:
    of = [[], ["optimize"], ["serve"], ["db", "backup"]]
    statements = (
        f"from gaitswarm.cli.main import run; assert not any(run([*c, '--help']) for c in {of})"
    )
    assert loaded_by(statements, HEAVY) == set()


RARE = (
    "scipy", "casadi", "pinocchio", "ray", "fastapi", "matplotlib", "pyarrow", "alembic",
    "gaitswarm.cli.commands.analysis", "gaitswarm.jobs.server", "gaitswarm.jobs.types",
    "gaitswarm.robots", "gaitswarm.services.optimizer.jobs.designs", "gaitswarm.services.runtime",
    "gaitswarm.services.optimizer.run.runner", "gaitswarm.simulation", "gaitswarm.sim.assembly",
    "gaitswarm.sim.case", "gaitswarm.sim.kernel.sensors", "gaitswarm.sim.kernel.walk",
    "gaitswarm.sim.robot.description", "gaitswarm.sim.robot.robot", "gaitswarm.sim.worlds",
    "rich._emoji_codes", "sqlalchemy.dialects.postgresql",
    *(
        f"gaitswarm.services.optimizer.jobs.kinds.{other}"
        for other in ("calibration", "certificate", "preferences")
    ),
)  # fmt: skip


@pytest.mark.slow
def test_list_and_status_import_neither_analyses_nor_what_simulates(tmp_path: Path) -> None:
    finished = finish(tmp_path)
    commands = [[*c, "--db", str(finished.db)] for c in (["list"], ["status", finished.id])]
    statements = f"from gaitswarm.cli.main import run; assert not any(map(run, {commands}))"
    assert loaded_by(statements, RARE) == set()


def test_help_is_that_of_the_innermost_command(
    gaitswarm: Gaitswarm,
) -> None:
    for words in ("db backup --help", "db prune --audit-older-than 1 -h", "db -h backup"):
        shown = gaitswarm(*words.split())
        assert (shown.code, shown.err) == (0, "")
        assert shown.out.startswith(f"Usage: gaitswarm {words.partition(' -')[0]} ")


def test_a_command_built_alone_equals_the_one_among_all() -> None:
    every: Any = commands()
    for name, command in every.commands.items():
        alone: Any = commands(name)
        assert list(alone.commands) == [name]
        assert _help(alone, name, alone.commands[name]) == _help(every, name, command)
    mistaken: Any = commands("fly")
    assert list(mistaken.commands) == list(every.commands)


def test_every_option_and_argument_has_a_help_text() -> None:
    every: Any = commands()
    groups = [every, *(c for c in every.commands.values() if hasattr(c, "commands"))]
    for command in (c for group in groups for c in group.commands.values()):
        missing = [parameter.name for parameter in command.params if not parameter.help]
        assert not missing, (command.name, missing)


@dataclass(frozen=True)
class Groups:
    """Options of a group.

    Args:
        count: How many.
    """

    count: Annotated[int, Option(min=1)] = 2


def test_help_texts_are_those_of_docstrings() -> None:
    def walk(robot: str, *, speed: float = 1.0, groups: Groups) -> None:
        """Walk.

        Args:
            robot: Which one.
            speed: How fast, in
                lengths per second.
        """

    app = Typer(add_completion=False)
    app.command()(expanded(walk))
    command: Any = get_command(app)
    assert command.help == "Walk."
    assert {parameter.name: parameter.help for parameter in command.params} == {
        "robot": "Which one.",
        "speed": "How fast, in lengths per second.",
        "count": "How many.",
    }


def _help(root: Any, name: str, command: Any) -> str:
    context = Context(root, info_name="gaitswarm", **root.context_settings)
    return str(command.get_help(Context(command, context, info_name=name)))


def test_help_after_two_dashes_is_an_argument(gaitswarm: Gaitswarm) -> None:
    result = gaitswarm("status", "--", "--help")
    assert (result.code, result.out) == (ExitCode.NOT_FOUND, "")


def test_help_cuts_no_commands_sentence(gaitswarm: Gaitswarm) -> None:
    listed = gaitswarm("--help").out.split("Start here:")[1]
    assert "..." not in listed
    assert "search methods of other packages" in " ".join(listed.split())


def test_help_lists_every_command_once_and_the_eight_main_ones_first(gaitswarm: Gaitswarm) -> None:
    every: Any = commands()
    listed = re.findall(r"^  ([a-z][a-z-]*)  ", gaitswarm("--help").out, re.MULTILINE)
    assert sorted(listed) == sorted(every.commands)
    main = ["optimize", "serve", "submit", "list", "status", "best", "simulate", "robot"]
    assert listed[:8] == main


def test_help_documents_the_exit_codes(gaitswarm: Gaitswarm) -> None:
    words = " ".join(gaitswarm("--help").out.split())
    documented = {int(code) for code in re.findall(r"(\d+) ", words.partition("Exit codes: ")[2])}
    assert documented - {ExitCode.BUG} == set(ExitCode) - {ExitCode.BUG}


@pytest.mark.parametrize(
    "arguments", [["fly"], ["fly", "--help"], ["status"], ["list", "--limit", "none"]]
)
def test_wrong_usage_is_exit_code_2(gaitswarm: Gaitswarm, arguments: list[str]) -> None:
    result = gaitswarm(*arguments)
    assert result.code == 2
    assert result.out == ""
