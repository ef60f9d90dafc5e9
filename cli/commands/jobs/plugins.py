"""`gaitswarm plugins`: what other packages bring; `cases`: what designs may be put to by them."""

from __future__ import annotations

import typer

from gaitswarm.cli.inputs.options import Json


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(plugins)
    app.command()(cases)


def plugins(as_json: Json = False) -> None:
    """List plug-ins: controllers, cases and search methods of other packages that are installed."""
    from rich.text import Text

    from gaitswarm.cli.output import print_json_list, stdout_console
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.views import plugin_views

    if as_json:
        print_json_list(plugin_views())
        return
    table = Table("kind", "name", "distribution", "version", "state", box=None)
    for view in plugin_views():
        state = Text(view.state if view.reason is None else f"{view.state}: {view.reason}")
        table.add_row(view.kind, view.name, view.distribution, view.version, state)
    stdout_console().print(table)


def cases(as_json: Json = False) -> None:
    """List cases of plug-ins, which evaluate designs in place of walks, with their settings."""
    from rich.text import Text

    from gaitswarm.cli.output import print_json_list, stdout_console
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.views import case_views

    if as_json:
        print_json_list(case_views())
        return
    table = Table("name", "description", "settings", box=None)
    for view in case_views():
        needs = "" if view.needs is None else f"; needs {view.needs}"
        settings = view.settings_schema.get("properties", {})
        lines = (
            f"{name} {field.get('default', '')}"
            for name, field in settings.items()
            if name != "name"
        )
        table.add_row(view.name, Text(f"{view.description}{needs}"), Text("\n".join(lines)))
    stdout_console().print(table)
