"""Concurrent calls of a compiled kernel, whose threads take over walks of each other."""

from __future__ import annotations

import ctypes
import threading
import time
from typing import Any, Final


class _Call(ctypes.Structure):
    _fields_ = [
        ("walkers", ctypes.c_void_p),
        ("n", ctypes.c_int64),
        ("begun", ctypes.c_int64),
        ("left", ctypes.c_int64),
        ("number", ctypes.c_int64),
        ("following", ctypes.c_void_p),
    ]


class _Pool(ctypes.Structure):
    _fields_ = [
        ("busy", ctypes.c_int64),
        ("calls", ctypes.c_int64),
        ("first", ctypes.c_void_p),
    ]


class LaneCounts(ctypes.Structure):
    """As `gaitswarm.sim.kernel.walk.LaneUse`, of the lanes of one thread."""

    _fields_ = [(name, ctypes.c_int64) for name in ("walked", "computed", "timed", "control")]


SHARED_STRUCTURES: Final = {"call": _Call, "pool": _Pool, "lane_use": LaneCounts}
"""By their names in the library's functions that tell their sizes."""


class Pool:
    """Calls of one kernel and coding.

    A thread first begins all walks of its own call. Lanes that become free then are filled with
    walks of the other calls, so that all threads end at nearly the same time.
    """

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        self._shared = _Pool()
        self._walked = threading.Condition()
        self._kept: list[tuple[_Call, object]] = []

    def walk(
        self, walkers: ctypes.Array[Any], coding: ctypes.Structure, memory: object
    ) -> tuple[LaneCounts, float]:
        """Compute walks, and perhaps some of other calls.

        Returns:
            How the lanes of this thread were used; and how long it then waited for walks that other
            threads had taken over [s].
        """
        call = _Call(walkers=ctypes.addressof(walkers), n=len(walkers), left=len(walkers))
        use = LaneCounts()
        with self._walked:
            self._kept.append((call, (walkers, memory)))
        self._library.gaitswarm_walk(
            ctypes.byref(self._shared), ctypes.byref(call), ctypes.byref(coding), ctypes.byref(use)
        )
        walked = time.perf_counter()
        with self._walked:
            self._walked.notify_all()
            self._walked.wait_for(lambda: not self._left(call))
            self._kept = [kept for kept in self._kept if self._left(kept[0])]
        return use, time.perf_counter() - walked

    def _left(self, call: _Call) -> int:
        return int(self._library.gaitswarm_left(ctypes.byref(call)))
