"""Assertions about errors."""

from __future__ import annotations

from collections.abc import Callable


def refused(error: type[Exception], word: str, call: Callable[[], object]) -> None:
    """Check that a call raises an error whose message has a word in it.

    Args:
        error: Type of the error.
        word: Word in its message.
        call: Call that must raise it.

    Raises:
        AssertionError: The call did not raise it.
    """
    try:
        call()
    except error as raised:
        if word not in str(raised):
            raise AssertionError(f"{word!r} is not in the message {str(raised)!r}") from raised
        return
    raise AssertionError(f"{error.__name__} was not raised; its message would have named {word!r}")
