"""One model of settings for every process: environment, options over it, errors that name both."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest, StoreUnavailable
from gaitswarm.settings import read_settings


def test_an_option_goes_before_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAITSWARM_API_PORT", "1234")
    monkeypatch.setenv("GAITSWARM_CPUS", "3")
    settings = read_settings(api_port=0, cpus=None)
    assert (settings.api_port, settings.cpus) == (0, 3)


def test_an_empty_variable_is_not_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAITSWARM_CPUS", "")
    monkeypatch.setenv("GAITSWARM_DB", "")
    settings = read_settings()
    assert (settings.cpus, settings.db) == (None, None)


def test_every_bad_value_is_named_by_its_variable_or_option(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("GAITSWARM_LEASE_SECONDS", "soon")
    monkeypatch.setenv("GAITSWARM_LOG_LEVEL", "chatty")
    with pytest.raises(InvalidRequest) as refused:
        read_settings(evaluator="abacus")
    said = str(refused.value)
    assert "GAITSWARM_LEASE_SECONDS: " in said and "GAITSWARM_LOG_LEVEL: " in said
    assert "evaluator: " in said and "GAITSWARM_EVALUATOR" not in said


def test_the_level_of_the_log_may_be_written_in_small_letters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("GAITSWARM_LOG_LEVEL", "warning")
    assert read_settings().log_level == "WARNING"


def test_the_default_database_is_in_the_users_data_directory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert read_settings().database == str(tmp_path / "data/gaitswarm/gaitswarm.db")
    assert not (tmp_path / "data").exists()
    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert read_settings().database == str(tmp_path / ".local/share/gaitswarm/gaitswarm.db")
    assert read_settings(db="mine.db").database == "mine.db"


def test_without_a_home_directory_only_a_named_database_will_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def no_home(path: Path) -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.setattr(Path, "expanduser", no_home)
    assert read_settings(db="/mine.db").database == "/mine.db"
    with pytest.raises(StoreUnavailable, match="GAITSWARM_DB"):
        _ = read_settings().database


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("GAITSWARM_EVALUATR", "did you mean GAITSWARM_EVALUATOR?"),
        ("GAITSWARM_XYZ", "docs/settings.md"),
    ],
)
def test_a_variable_that_is_no_setting_is_reported(
    monkeypatch: pytest.MonkeyPatch, name: str, advice: str
) -> None:
    monkeypatch.setenv(name, "ray")
    with pytest.warns(UserWarning, match=rf"^{name} is no setting .*{re.escape(advice)}"):
        read_settings()
