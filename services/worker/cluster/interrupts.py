"""Cancellations, which Ray sends as SIGINT, in a process that is used again: never in an import."""

from __future__ import annotations

import _thread
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

_AGAIN_SECONDS: Final = 0.02
"""From an interruption that came in an import to the next look at whether that has ended."""

_IMPORTS: Final = "<frozen importlib._bootstrap"
"""How the names of files begin in which Python's imports are."""


@contextmanager
def interrupted_outside_imports() -> Iterator[None]:
    """Let SIGINT interrupt what runs inside by a KeyboardInterrupt, but for imports.

    An import that is interrupted leaves modules without the names that were to follow, or C
    libraries that cannot be loaded a second time, and whatever the process runs next fails of it.
    An interruption that comes in an import is made up for when that has ended.

    SIGINT is heeded even where it was ignored. A shell's script makes what it starts in the
    background ignore it, which Ray's workers inherit: Ray would then raise a TypeError in place of
    the cancellation. Without effect in a thread that is not the process's main one.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    is_due = True
    changing = threading.Lock()

    def again() -> None:
        time.sleep(_AGAIN_SECONDS)
        with changing:
            if is_due:
                _thread.interrupt_main()

    def heed(_signal: int, frame: FrameType | None) -> None:
        nonlocal is_due
        if not _is_importing(frame):
            is_due = False
            raise KeyboardInterrupt
        # Not by `threading`, whose locks the import may hold.
        _thread.start_new_thread(again, ())

    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, heed)
    try:
        yield
    finally:
        try:
            with changing:
                is_due = False
        finally:
            ignored = before in {signal.SIG_IGN, None}
            signal.signal(signal.SIGINT, signal.default_int_handler if ignored else before)


def _is_importing(frame: FrameType | None) -> bool:
    """Whether a module is being imported where a frame is."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORTS):
            return True
        frame = frame.f_back
    return False
