"""Parts of the manual that are made from the code: commands, and fields of files.

A Sphinx extension: `{commands}` is the reference of the command line, `{fields} MODEL` that of a
Pydantic model and of the models in it.
"""

from __future__ import annotations

import types
from collections.abc import Iterator
from importlib import import_module
from typing import Any, ClassVar, get_args, get_origin

import typer
from docutils import nodes
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.typing import ExtensionMetadata

from cli.main import app as command_line


class Commands(SphinxDirective):
    """Every command of the command line with its help, as printed at 80 characters."""

    def run(self) -> list[nodes.Node]:
        """Nodes of the directive. Called by Sphinx."""
        return self.parse_text_to_nodes("\n".join(_commands(typer.main.get_command(command_line))))


class Fields(SphinxDirective):
    """The fields of a Pydantic model, and of those within, as tables."""

    required_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        """Nodes of the directive. Called by Sphinx."""
        module, _, name = self.arguments[0].rpartition(".")
        model: type[BaseModel] = getattr(import_module(module), name)
        return self.parse_text_to_nodes("\n".join(_models(model)))


def setup(app: Sphinx) -> ExtensionMetadata:
    """Add the directives.

    Args:
        app: Takes them on.

    Returns:
        That pages may be read in parallel.
    """
    app.add_directive("commands", Commands)
    app.add_directive("fields", Fields)
    return {"parallel_read_safe": True}


def _commands(command: Any, path: str = "gaitswarm", parent: Any = None) -> Iterator[str]:
    context = command.context_class(command, info_name=path.rsplit(maxsplit=1)[-1], parent=parent)
    context.terminal_width = 80
    yield f"\n(command-{path.replace(' ', '-')})=\n{'#' * min(len(path.split()) + 1, 4)} {path}\n"
    yield f"```text\n{command.get_help(context)}\n```"
    for name, inner in sorted(getattr(command, "commands", {}).items()):
        yield from _commands(inner, f"{path} {name}", context)


def _models(model: type[BaseModel]) -> Iterator[str]:
    found: list[type[BaseModel]] = [model]
    for one in found:
        yield f"\n## {one.__name__}\n\n{(one.__doc__ or '').strip().splitlines()[0]}\n"
        yield "| field | type | default | meaning |\n| --- | --- | --- | --- |"
        for name, field in one.model_fields.items():
            yield _row(name, field)
            found += [inner for inner in _inner(field.annotation) if inner not in found]


def _row(name: str, field: FieldInfo) -> str:
    value = None if field.is_required() else field.get_default(call_default_factory=True)
    default = "" if value in (None, "") else f"`{value}`"
    kind = getattr(field.annotation, "__name__", None) if not get_args(field.annotation) else None
    shown = kind or str(field.annotation).replace("typing.", "")
    for module in ("sim.robot.description.", "collections.abc."):
        shown = shown.replace(module, "")
    cells = [f"`{name}`", f"`{shown}`", default, field.description or ""]
    return "| " + " | ".join(" ".join(cell.split()).replace("|", "\\|") for cell in cells) + " |"


def _inner(annotation: Any) -> Iterator[type[BaseModel]]:
    """Models in an annotation."""
    if get_origin(annotation) is None:
        is_class = isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias)
        if is_class and issubclass(annotation, BaseModel):
            yield annotation
    for part in get_args(annotation):
        yield from _inner(part)
