"""Server-sent events, as the HTML standard defines their lines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Event:
    """One event: its name ("message" if it has none) and its data, lines joined."""

    name: str
    data: str


def read_events(lines: Iterable[str]) -> Iterator[Event]:
    """Events as their last line comes; comments and unknown fields are skipped.

    An event without its closing blank line, as a broken connection leaves it, is dropped.
    """
    name, data = "", list[str]()
    for line in lines:
        text = line.rstrip("\r\n")
        if not text:
            if data:
                yield Event(name or "message", "\n".join(data))
            name, data = "", []
            continue
        field, _, value = text.partition(":")
        value = value.removeprefix(" ")
        if field == "event":
            name = value
        elif field == "data":
            data.append(value)
