"""`gaitswarm token`: who may ask a server, and for what."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gaitswarm.cli.inputs.options import Db, Json

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitswarm.services.optimizer.access import Token, Tokens

Name = Annotated[str, typer.Argument(metavar="NAME", help="Of the token: whose jobs its jobs are.")]


def register(app: typer.Typer) -> None:
    """Add the group of commands."""
    group = typer.Typer(help="Make, list and revoke tokens, by which a server knows who asks.")
    group.command()(create)
    group.command("list")(list_)
    group.command()(revoke)
    app.add_typer(group, name="token")


def create(
    name: Name,
    scope: Annotated[
        Literal["read", "submit", "admin"],
        typer.Option(
            help="read: look at everything; submit: also submit jobs and command these; admin:"
            " command all jobs."
        ),
    ] = "submit",
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Make a token. Its secret is printed once, and stored nowhere."""
    from gaitswarm.cli.output import note, print_text
    from gaitswarm.services.optimizer.access import Scope

    with _tokens(db) as tokens:
        token, secret = tokens.create(name, Scope(scope))
    if as_json:
        _print_json({**_document(token), "secret": secret})
        return
    note(f"token {name!r} of scope {scope}; its secret is shown only now:")
    print_text(secret)


def list_(db: Db = None, as_json: Json = False) -> None:
    """List all tokens, the oldest first."""
    from gaitswarm.cli.output import note, print_text

    with _tokens(db, made=False) as tokens:
        found = tokens.all()
    if as_json:
        _print_json([_document(token) for token in found])
        return
    if not found:
        note("there are no tokens; `gaitswarm token create NAME` makes one")
    for token in found:
        state = "valid" if token.revoked_at is None else f"revoked {token.revoked_at:%Y-%m-%d}"
        made = f"{token.created_at:%Y-%m-%d}"
        print_text(f"{token.name:24} {token.scope:7} made {made}  {state}")


def revoke(name: Name, db: Db = None, as_json: Json = False) -> None:
    """Let a token allow nothing any more; servers know within five seconds."""
    from gaitswarm.cli.output import note

    with _tokens(db, made=False) as tokens:
        token = tokens.revoke(name)
    if as_json:
        _print_json(_document(token))
    else:
        note(f"token {name!r} is revoked")


@contextmanager
def _tokens(db: str | None, *, made: bool = True) -> Iterator[Tokens]:
    """Of the database that the option or the environment names.

    made: whether it is made if it is not there; else that is an error.
    """
    from contextlib import closing

    from gaitswarm.jobs.open import database_to_read, database_to_write
    from gaitswarm.services.runtime import open_store
    from gaitswarm.settings import read_settings

    find = database_to_write if made else database_to_read
    with closing(open_store(find(read_settings(db=db or None)))) as store:
        yield store.tokens


def _document(token: Token) -> dict[str, Any]:
    return {
        "name": token.name,
        "scope": str(token.scope),
        "created_at": token.created_at.isoformat(),
        "revoked_at": None if token.revoked_at is None else token.revoked_at.isoformat(),
    }


def _print_json(document: Any) -> None:
    import json

    from gaitswarm.cli.output import print_text

    print_text(json.dumps(document, indent=2))
