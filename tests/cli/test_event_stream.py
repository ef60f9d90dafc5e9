"""Server-sent events are read as the HTML standard defines them."""

from __future__ import annotations

from gaitswarm.jobs.event_stream import Event, read_events


def test_an_event_has_the_name_and_the_data_of_its_lines() -> None:
    lines = ["event: iteration", "id: 3", 'data: {"a":', "data:1}", "", "data: x", ""]
    assert list(read_events(lines)) == [Event("iteration", '{"a":\n1}'), Event("message", "x")]


def test_comments_and_events_without_data_are_skipped() -> None:
    assert list(read_events([": ping", "", "event: state", "", "data: y", ""])) == [
        Event("message", "y")
    ]


def test_an_event_that_a_broken_connection_cut_off_is_dropped() -> None:
    assert list(read_events(["data: whole", "", "data: half"])) == [Event("message", "whole")]
