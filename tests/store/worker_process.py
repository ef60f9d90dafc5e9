"""Programs of processes that use a store; `main` is a runner: `claim URL` or `commit URL`.

It begins when a line comes on its standard input, and prints what it has done, line by line.
"""

from __future__ import annotations

import sys

from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.schema import admit
from tests.store.examples import ask, completed

PARTICLES = 25


def say(word: object) -> None:
    """One line, at once."""
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


def claim_all(store: Store) -> None:
    """Claim until there is nothing left; prints the ids."""
    while (claim := store.claim("process", lease_seconds=600.0)) is not None:
        say(claim.job.id)


def commit_for_ever(store: Store) -> None:
    """Claim a job and commit iteration after iteration; prints the index of each."""
    # A lease of no time: after this process's death others need not wait.
    claim = store.claim("process", lease_seconds=0.0)
    assert claim is not None
    if claim.ask is None:
        store.begin(claim, ask(0, particles=PARTICLES))
    index = claim.ask.iteration if claim.ask is not None else 0
    while True:
        fitness = [1.0 / (index + 1) + particle for particle in range(PARTICLES)]
        store.commit(claim, completed(index, fitness), ask(index + 1, particles=PARTICLES))
        say(index)
        index += 1


def main() -> None:
    """Do what is asked for, when a line has come."""
    what, url = sys.argv[1:]
    opened = open_store(url)
    say("ready")
    sys.stdin.readline()
    {"claim": claim_all, "commit": commit_for_ever}[what](opened)


def open_when_told() -> None:
    """Open a database, which may have to be made, when a line has come."""
    say("ready")
    sys.stdin.readline()
    open_store(sys.argv[1]).ping()


def stay_open() -> None:
    """Have a database open, and do nothing, until a line comes."""
    database = Database(sys.argv[1])
    admit(database)
    with database.read():
        pass
    say("ready")
    sys.stdin.readline()


if __name__ == "__main__":
    main()
