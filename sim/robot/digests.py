"""Robots' files that were found to be good, by digest: they need not be looked at again."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from typing import Final

_REMEMBERED: Final = 1024


def digest_of(toml: str, urdf: str) -> bytes:
    """What two files are told from others by."""
    # Texts that are no Unicode are refused later, by name.
    texts = (text.encode(errors="surrogatepass") for text in (toml, urdf))
    return hashlib.sha256(b"%d " % len(toml) + b"".join(texts)).digest()


class _Digests:
    """Digests, those that were asked for last at the end. Thread-safe."""

    def __init__(self) -> None:
        self._digests: OrderedDict[bytes, None] = OrderedDict()
        self._lock = threading.Lock()

    def has(self, digest: bytes) -> bool:
        with self._lock:
            known = digest in self._digests
            if known:
                self._digests.move_to_end(digest)
            return known

    def add(self, digest: bytes) -> None:
        with self._lock:
            self._digests[digest] = None
            if len(self._digests) > _REMEMBERED:
                self._digests.popitem(last=False)


PASSED: Final = _Digests()
"""Files that passed `gaitswarm.sim.robot.check.check_files`, in this process."""

READ: Final = _Digests()
"""Files that this process has made a robot of."""
