"""Recorded walks as a table."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.text import Text

from gaitswarm.cli.tables.fitted import Table
from gaitswarm.cli.tables.views import MISSING, number

if TYPE_CHECKING:
    from gaitswarm.views.identification import RecordingEntryView


def recordings_table(recordings: Iterable[RecordingEntryView]) -> Table:
    """One row a recording; one that cannot be read has an id and a time."""
    table = Table(box=None)
    # Ids are what other commands take: they are never cut.
    table.add_column("id", no_wrap=True)
    for heading in ("walk", "currents", "recorded (UTC)"):
        table.add_column(heading)
    for entry in recordings:
        walk = Text(" ".join(filter(None, (entry.scenario, entry.controller))) or MISSING)
        if entry.synthetic:
            walk.append(" SYNTHETIC")
        known = entry.joints is not None and entry.seconds is not None
        table.add_row(
            entry.id,
            walk,
            f"{entry.joints} over {number(entry.seconds)} s" if known else MISSING,
            f"{entry.created_at:%Y-%m-%d %H:%M}",
        )
    return table
