"""Things of one kind by name: those of gaitswarm, then those that plug-ins bring."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from typing import Any, Protocol, TypeVar

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from gaitswarm.sim.input.near_names import instead_of, nearest
from gaitswarm.sim.plugins.entry_points import Kind, Plugin, PluginError, find_plugins

T = TypeVar("T")

_LOG = logging.getLogger(__name__)


class Registry(MutableMapping[str, T]):
    """Things by name. A plug-in is imported when it is looked up, or when all are listed.

    A name of gaitswarm's is answered without a look at what is installed. A plug-in that is broken,
    or whose name is taken, is logged and left out: to its users it is an unknown name, with the
    reason beside it.
    """

    def __init__(
        self, kind: Kind, built_in: Mapping[str, T], accept: Callable[[Plugin, object], T]
    ) -> None:
        self._kind: Kind = kind
        self._built_in = dict(built_in)
        self._accept = accept
        self._loaded: dict[Plugin, T] = {}
        self._broken: dict[Plugin, str] = {}

    @property
    def kind(self) -> Kind:
        """Of the things."""
        return self._kind

    @property
    def built_in(self) -> Mapping[str, T]:
        """Those of gaitswarm, by name."""
        return self._built_in

    def __getitem__(self, name: str) -> T:
        if name in self._built_in:
            return self._built_in[name]
        for plugin in self.plugins():
            if plugin.name == name and self.problem(plugin) is None:
                return self._loaded[plugin]
        raise KeyError(name)

    def __setitem__(self, name: str, thing: T) -> None:
        self._built_in[name] = thing

    def __delitem__(self, name: str) -> None:
        del self._built_in[name]

    def __iter__(self) -> Iterator[str]:
        yield from self._built_in
        yield from (p.name for p in self.plugins() if self.problem(p) is None)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def plugins(self) -> tuple[Plugin, ...]:
        """Entry points of this kind that are installed, those that cannot be used among them."""
        return tuple(plugin for plugin in find_plugins() if plugin.kind == self._kind)

    def problem(self, plugin: Plugin) -> str | None:
        """Why a plug-in cannot be used; it is imported to find out, once."""
        if plugin not in self._loaded and plugin not in self._broken:
            try:
                self._check_name(plugin)
                self._loaded[plugin] = self._accepted(plugin)
            except PluginError as error:
                _LOG.warning("%s", error)
                self._broken[plugin] = str(error)
        return self._broken.get(plugin)

    def distribution(self, name: str) -> tuple[str, ...]:
        """The distribution that a name's plug-in is of."""
        if name in self._built_in:
            return ()
        return tuple(
            p.distribution for p in self.plugins() if p.name == name and self.problem(p) is None
        )

    def unknown(self, name: str) -> str:
        """Say that a name is none."""
        return f"unknown {self._kind} {name!r}; {self.instead_of(name, self)}"

    def instead_of(self, name: str, known: Iterable[str]) -> str:
        """What may help whoever gave a name that is none."""
        known = list(known)
        found = [self.problem(plugin) for plugin in self.plugins() if plugin.name == name]
        reasons = [reason for reason in found if reason is not None]
        if not reasons and nearest(name, known) is None:
            reasons = [
                "that of a plug-in is known where its package is installed (gaitswarm plugins)"
            ]
        return "; ".join([instead_of(name, known), *reasons])

    def _check_name(self, plugin: Plugin) -> None:
        if plugin.name in self._built_in:
            raise PluginError(f"{plugin} is left out: the name is one of gaitswarm's own")
        others = [o for o in self.plugins() if o.name == plugin.name and o != plugin]
        if others:
            # None of them: which one is first depends on the order of sys.path.
            named = ", ".join(f"{o.distribution} {o.version}" for o in others)
            raise PluginError(f"{plugin} is left out: {named} has one of that name, too")

    def _accepted(self, plugin: Plugin) -> T:
        brought = plugin.load()
        try:
            return self._accept(plugin, brought)
        except PluginError:
            raise
        except Exception as error:
            raise PluginError(
                f"{plugin} cannot be used: {type(error).__name__}: {error}"
            ) from error


class Names(Protocol):
    """Names that there are, which may become more when plug-ins are looked at."""

    def __contains__(self, name: object, /) -> bool: ...

    def __iter__(self) -> Iterator[str]: ...

    def unknown(self, name: str) -> str:
        """Say that a name is none."""


class KnownName:
    """Annotation of a `str` that is to be a known name, a plug-in's among them."""

    def __init__(self, names: Names) -> None:
        self._names = names

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Checks a name when it is read."""
        return core_schema.no_info_after_validator_function(self._known, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The names that there are where the schema is asked for."""
        return {**handler(schema), "enum": list(self._names)}

    def _known(self, name: str) -> str:
        if name not in self._names:
            raise PydanticCustomError("unknown_name", "{why}", {"why": self._names.unknown(name)})
        return name


def check_is(plugin: Plugin, brought: object, wanted: type[T]) -> T:
    """Check the type of what a plug-in brings, and that its own name is the entry point's."""
    if isinstance(brought, type) or not isinstance(brought, wanted):
        raise PluginError(
            f"{plugin} cannot be used: {plugin.place} is a {type(brought).__name__},"
            f" not a {wanted.__name__}"
        )
    return brought


def check_name(plugin: Plugin, own: object) -> None:
    """Check that a thing has the name that its entry point gives it."""
    if own != plugin.name:
        raise PluginError(f"{plugin} cannot be used: it calls itself {own!r}")
