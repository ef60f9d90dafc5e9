"""Plug-ins of other packages, found by entry points and loaded on demand."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Generic, Literal, TypeVar, get_args

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from gaitswarm.sim.near_names import instead_of, nearest

Kind = Literal["controller", "case", "optimizer"]

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

GROUPS: Final[Mapping[Kind, str]] = MappingProxyType({kind: f"gaitswarm.{kind}s" for kind in KINDS})
"""Group of entry points by kind."""


class PluginError(Exception):
    """A plug-in that cannot be used; the message names it, its distribution and the reason."""


@dataclass(frozen=True, slots=True)
class Plugin:
    """An entry point."""

    kind: Kind
    name: str  # in job specs
    distribution: str  # package that contains it
    version: str  # of the distribution
    place: str  # `module:attribute`

    @property
    def module(self) -> str:
        return self.place.partition(":")[0].strip()

    def __str__(self) -> str:
        return f"{self.kind} {self.name!r} of {self.distribution} {self.version}"

    def load(self) -> object:
        try:
            return metadata.EntryPoint(self.name, self.place, GROUPS[self.kind]).load()
        except (Exception, SystemExit) as error:
            raise PluginError(
                f"{self} cannot be loaded: {type(error).__name__}: {error}"
            ) from error


@lru_cache(maxsize=1)
def find_plugins() -> tuple[Plugin, ...]:
    """Return all installed entry points for gaitswarm, as of the first call."""
    # Query once: each query reads the metadata of all distributions.
    points = metadata.entry_points()
    plugins = {
        Plugin(
            kind,
            point.name,
            "unknown" if point.dist is None else point.dist.name,
            "0" if point.dist is None else point.dist.version,
            point.value,
        )
        for kind, group in GROUPS.items()
        for point in points.select(group=group)
    }
    return tuple(sorted(plugins, key=lambda p: (KINDS.index(p.kind), p.name, p.distribution)))


MISSING: Final = "none"
"""Version of a distribution that is not installed."""

_DIGITS: Final = 32

_SHOWN: Final = 12
"""Digits of the digest of a plug-in's code that are shown."""

_SUFFIXES: Final = (".py", ".c", ".h", ".so")


def source_digest(root: Path, files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        content = file.read_bytes()
        digest.update(f"{file.relative_to(root).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:_DIGITS]


def version_of(distribution: str) -> str:
    versions = plugin_versions()
    if distribution in versions:
        return versions[distribution]
    try:
        return _installed(distribution)
    except metadata.PackageNotFoundError:
        return MISSING


@lru_cache(maxsize=256)
def _installed(distribution: str) -> str:
    """Cached: every job needs it, and reading it takes a millisecond."""
    return metadata.version(distribution)


@lru_cache(maxsize=1)
def plugin_versions() -> dict[str, str]:
    """Return versions of all distributions with plug-ins by name, as of the first call."""
    by_name: dict[str, list[Plugin]] = {}
    for plugin in find_plugins():
        by_name.setdefault(plugin.distribution, []).append(plugin)
    return {
        name: f"{plugins[0].version} (code {_code(plugins)})"
        for name, plugins in sorted(by_name.items())
    }


def _code(plugins: Iterable[Plugin]) -> str:
    digest = hashlib.sha256()
    for package in sorted({plugin.module.partition(".")[0] for plugin in plugins}):
        try:
            for root in _roots(package):
                files = [root] if root.is_file() else sorted(root.rglob("*"))
                sources = [f for f in files if f.suffix in _SUFFIXES and f.is_file()]
                digest.update(source_digest(root.parent, sources).encode())
        except (ImportError, OSError, ValueError):
            # Loading the plug-in reports the reason.
            digest.update(b"unreadable")
    return digest.hexdigest()[:_SHOWN]


def _roots(package: str) -> tuple[Path, ...]:
    spec = find_spec(package)
    if spec is None:
        return ()
    if spec.submodule_search_locations is not None:
        return tuple(Path(folder) for folder in spec.submodule_search_locations)
    return () if spec.origin is None else (Path(spec.origin),)


T = TypeVar("T")

_LOG = logging.getLogger(__name__)


class Registry(MutableMapping[str, T]):
    """Built-in and plugged-in objects by name; plug-ins are imported when looked up or listed.

    Built-in names do not need the installed entry points. A plug-in that is broken or whose name is
    taken is logged and omitted: its name is unknown, and the error message says why.
    """

    def __init__(
        self,
        kind: Kind,
        built_in: Mapping[str, T],
        accept: Callable[[Plugin, object], T],
        elsewhere: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self.kind: Final = kind
        self.built_in = dict(built_in)
        self._elsewhere = elsewhere
        self._accept = accept
        self._loaded: dict[Plugin, T] = {}
        self._broken: dict[Plugin, str] = {}

    def __getitem__(self, name: str) -> T:
        if name in self.built_in:
            return self.built_in[name]
        for plugin in self.plugins():
            if plugin.name == name and self.problem(plugin) is None:
                return self._loaded[plugin]
        raise KeyError(name)

    def __setitem__(self, name: str, thing: T) -> None:
        self.built_in[name] = thing

    def __delitem__(self, name: str) -> None:
        del self.built_in[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.built_in
        yield from (p.name for p in self.plugins() if self.problem(p) is None)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def plugins(self) -> tuple[Plugin, ...]:
        """Installed entry points of this kind, including unusable ones."""
        return tuple(plugin for plugin in find_plugins() if plugin.kind == self.kind)

    def problem(self, plugin: Plugin) -> str | None:
        """Return why a plug-in cannot be used; the first call imports it."""
        if plugin not in self._loaded and plugin not in self._broken:
            try:
                self._check_name(plugin)
                self._loaded[plugin] = self._accepted(plugin)
            except PluginError as error:
                _LOG.warning("%s", error)
                self._broken[plugin] = str(error)
        return self._broken.get(plugin)

    def distribution(self, name: str) -> tuple[str, ...]:
        if name in self.built_in:
            return ()
        return tuple(
            p.distribution for p in self.plugins() if p.name == name and self.problem(p) is None
        )

    def unknown(self, name: str) -> str:
        return f"unknown {self.kind} {name!r}; {self.instead_of(name, self)}"

    def instead_of(self, name: str, known: Iterable[str]) -> str:
        if name in self._elsewhere and not any(p.name == name for p in self.plugins()):
            return self._elsewhere[name]
        known = list(known)
        found = [self.problem(plugin) for plugin in self.plugins() if plugin.name == name]
        reasons = [reason for reason in found if reason is not None]
        if not reasons and nearest(name, known) is None:
            reasons = ["a plug-in's name is known if its package is installed (gaitswarm plugins)"]
        return "; ".join([instead_of(name, known), *reasons])

    def _check_name(self, plugin: Plugin) -> None:
        if plugin.name in self.built_in:
            raise PluginError(f"{plugin} is ignored: gaitswarm itself uses the name")
        others = [o for o in self.plugins() if o.name == plugin.name and o != plugin]
        if others:
            # Omit both: which one comes first depends on the order of sys.path.
            named = ", ".join(f"{o.distribution} {o.version}" for o in others)
            raise PluginError(f"{plugin} is ignored: {named} uses the name, too")

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


class KnownName:
    """Annotation of a `str` that must be a known name; plug-ins' names included."""

    def __init__(self, names: Registry[Any]) -> None:
        self._names = names

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._known, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {**handler(schema), "enum": list(self._names)}

    def _known(self, name: str) -> str:
        if name not in self._names:
            raise PydanticCustomError("unknown_name", "{why}", {"why": self._names.unknown(name)})
        return name


def check_is(plugin: Plugin, brought: object, wanted: type[T]) -> T:
    if isinstance(brought, type) or not isinstance(brought, wanted):
        raise PluginError(
            f"{plugin} cannot be used: {plugin.place} is a {type(brought).__name__},"
            f" not a {wanted.__name__}"
        )
    return brought


def check_name(plugin: Plugin, own: object) -> None:
    if own != plugin.name:
        raise PluginError(f"{plugin} cannot be used: its own name is {own!r}")


class PluginSettings(Generic[T]):
    """Annotation of settings that may be a plug-in's; others are read as annotated."""

    def __init__(
        self, registry: Registry[T], model: Callable[[T], type[BaseModel]], seen: str
    ) -> None:
        self._registry, self._model, self._seen = registry, model, seen

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Read settings by the model of their name; write all fields."""
        return core_schema.no_info_wrap_validator_function(
            self._read, handler(source), serialization=core_schema.simple_ser_schema("any")
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        annotated = handler(schema)
        names = [name for name in self._registry if name not in self._registry.built_in]
        if not names:
            return annotated
        own = {
            "title": "PluginSettings",
            "type": "object",
            "properties": {"name": {"type": "string", "enum": names}},
            "required": ["name"],
            "description": f"Settings of a plug-in's {self._registry.kind}; see {self._seen}.",
        }
        for union in ("oneOf", "anyOf"):
            if union in annotated:
                return {**annotated, union: [*annotated[union], own]}
        return {"anyOf": [annotated, own]}

    def _read(self, value: Any, otherwise: Callable[[Any], Any]) -> Any:
        if isinstance(value, Mapping):
            name = value.get("name")
        else:
            name = getattr(value, "name", None) if isinstance(value, BaseModel) else None
        if not isinstance(name, str) or name in self._registry.built_in:
            return otherwise(value)
        if name not in self._registry:
            return otherwise(value)
        return self._model(self._registry[name]).model_validate(value)
