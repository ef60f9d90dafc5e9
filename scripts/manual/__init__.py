"""Parts of the manual that are made from the code: a Sphinx extension with these directives.

| directive        | is the reference of                                     |
| ---------------- | ------------------------------------------------------- |
| `{commands}`     | the command line                                        |
| `{settings}`     | what a process reads from its environment               |
| `{routes}`       | the REST API: paths, parameters, statuses, problems     |
| `{schemas}`      | what its bodies and answers have in them                |
| `{fields} MODEL` | a Pydantic model, and the models in it                  |
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.typing import ExtensionMetadata

from gaitswarm.cli import main as command_line
from scripts.manual.fields import models, settings
from scripts.manual.rest import routes, schemas


class Fields(SphinxDirective):
    """The fields of a Pydantic model, and of those within, as tables."""

    required_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        """Nodes of the directive. Called by Sphinx."""
        module, _, name = self.arguments[0].rpartition(".")
        self.env.note_reread()
        return self.parse_text_to_nodes("\n".join(models(getattr(import_module(module), name))))


def setup(app: Sphinx) -> ExtensionMetadata:
    """Add the directives.

    Args:
        app: Takes them on.

    Returns:
        That pages may be read in parallel.
    """
    for made in (commands, settings, routes, schemas):
        app.add_directive(made.__name__, _directive(made))
    app.add_directive("fields", Fields)
    return {"parallel_read_safe": True}


def commands() -> Iterator[str]:
    """Every command with its help, as printed at 80 characters: lines of Markdown."""
    return _commands(command_line.commands())


def _commands(command: Any, path: str = "gaitswarm", parent: Any = None) -> Iterator[str]:
    name = path.rsplit(maxsplit=1)[-1]
    context = command.context_class(
        command, info_name=name, parent=parent, **command.context_settings
    )
    context.terminal_width = 80
    yield f"\n(command-{path.replace(' ', '-')})=\n{'#' * min(len(path.split()) + 1, 4)} {path}\n"
    yield f"```text\n{command.get_help(context)}\n```"
    for name, inner in sorted(getattr(command, "commands", {}).items()):
        yield from _commands(inner, f"{path} {name}", context)


def _directive(made: Callable[[], Iterable[str]]) -> type[SphinxDirective]:
    """A directive that stands for lines of Markdown."""

    class Made(SphinxDirective):
        def run(self) -> list[nodes.Node]:
            # The code may have changed since a page without changes was read.
            self.env.note_reread()
            return self.parse_text_to_nodes("\n".join(made()))

    return Made
