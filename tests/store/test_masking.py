"""URLs are shown without passwords."""

from __future__ import annotations

import pytest

from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.settings import Settings

SECRET = "postgresql://u:secret@h/d?sslpassword=secret"


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("jobs.db", "jobs.db"),
        ("sqlite:////srv/jobs.db", "sqlite:////srv/jobs.db"),
        ("postgresql://h:5432/d", "postgresql://h:5432/d"),
        ("postgresql://u:secret@h/d", "postgresql://u:***@h/d"),
        ("postgresql://u:sec@ret@h/d", "postgresql://u:***@h/d"),
        ("postgresql://u:sec/ret@[::1]:5432/d", "postgresql://u:***@[::1]:5432/d"),
        ("postgresql://u:sec?ret@h/d", "postgresql://***"),
        ("postgresql://u:secret", "postgresql://***"),
        ("postgresql://h/d?user=u&password=secret", "postgresql://h/d?user=u&***"),
        ("postgresql://h/d?PASSWORD=secret&port=1", "postgresql://h/d?port=1&***"),
        ("postgresql://h/d?sslpassword=secret&passfile=/secret", "postgresql://h/d?***"),
        ("postgresql://h/d?password=secret&secret", "postgresql://h/d?***"),
        ("postgresql:///d?host=a,b&sslmode=require", "postgresql:///d?host=a,b&sslmode=require"),
        ("https://secret@h/prefix", "https://***@h/prefix"),
        ("https://u:secret@h/prefix?key=secret", "https://***:***@h/prefix?***"),
    ],
)
def test_only_harmless_parts_of_a_url_are_shown(url: str, shown: str) -> None:
    assert masked_url(url) == shown


def test_the_options_that_find_a_job_again_hide_the_password(store: Store) -> None:
    place = DatabaseJobs(JobService(store), SECRET).place
    assert place == " --db 'postgresql://u:***@h/d?***'"


def test_settings_are_shown_without_the_database() -> None:
    assert "secret" not in repr(Settings(db=SECRET))
