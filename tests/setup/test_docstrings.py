"""Published functions document each of their arguments."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest

import gaitswarm
import gaitswarm.plugins
from gaitswarm.services.optimizer.run import evaluator
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.store.changes import Changes
from gaitswarm.services.optimizer.store.outbox import Outbox
from gaitswarm.services.optimizer.store.tokens import Tokens

INTERFACES = (gaitswarm, gaitswarm.plugins, evaluator, Store, Changes, Outbox, Tokens)
"""The library, plug-in contracts, and the evaluator and store interfaces."""


def defined(module: Any) -> list[str]:
    """Public names that the module itself defines."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and getattr(value, "__module__", None) == module.__name__
    ]


def published(interface: Any) -> Iterator[tuple[str, Any, str]]:
    """Functions and public methods of a class, or of a module's public classes.

    Yields the name, the function, and the docstrings of its class and base classes.
    """
    if inspect.isclass(interface):
        values: dict[str, Any] = {interface.__name__: interface}
    else:
        names = getattr(interface, "__all__", None) or defined(interface)
        values = {name: getattr(interface, name) for name in names}
    for name, value in values.items():
        if inspect.isclass(value) and value.__module__.startswith("gaitswarm"):
            text = "\n".join(base.__doc__ or "" for base in value.__mro__)
            for method_name, method in inspect.getmembers(value, inspect.isfunction):
                ours = method.__module__.startswith("gaitswarm")
                if ours and not method_name.startswith("_"):
                    yield f"{name}.{method_name}", method, text
        elif inspect.isfunction(value) and value.__module__.startswith("gaitswarm"):
            yield name, value, ""


def undocumented(function: Any, of_class: str = "") -> list[str]:
    """Arguments described neither here nor among those of several methods."""
    text = inspect.getdoc(function) or ""
    if ".store." in function.__module__:
        text += f"\n{inspect.getdoc(Store)}"
    names = [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]
    return [
        name
        for name in names
        if not re.search(rf"\n    (\w+, )?\*{{0,2}}{name}(, \w+)?: ", text)
        and f"`{name}` is " not in of_class
    ]


@pytest.mark.parametrize("interface", INTERFACES, ids=lambda interface: interface.__name__)
def test_published_functions_document_their_arguments(interface: Any) -> None:
    missing = {name: undocumented(function, text) for name, function, text in published(interface)}
    assert missing
    documented = {name.rpartition(".")[2] for name, arguments in missing.items() if not arguments}
    # A line is enough where another published class documents a method of the same name.
    gaps = {
        name: arguments
        for name, arguments in missing.items()
        if arguments and name.rpartition(".")[2] not in documented
    }
    assert gaps == {}


def test_a_missing_argument_is_noticed() -> None:
    def function(first: int, second: int) -> None:
        """Do something.

        Args:
            first: The first.
        """

    assert undocumented(function) == ["second"]
