"""The command line."""

from __future__ import annotations

from typer.testing import CliRunner

from gaitswarm_research.main import app


def test_help_describes_the_command() -> None:
    result = CliRunner().invoke(app, ["--help"])
    assert result.exit_code == 0
    assert "Compare search methods" in result.output
