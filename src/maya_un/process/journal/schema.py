"""The tables of the journal's file, and the steps that bring an older file to them.

A file names its version in `PRAGMA user_version` and whose it is in `PRAGMA application_id`. A version once released is
never changed: what comes later is a step of its own at the end of `MIGRATIONS`.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path

from maya_un.errors import FileNotOurs, StorageTooNew

APPLICATION = 0x4D617961
"""The application id in the header of Maya's files: "Maya"."""

_VERSION_1 = """
CREATE TABLE meta (name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO meta VALUES ('run', 0);
CREATE TABLE queue (
    one INTEGER PRIMARY KEY CHECK (one = 1),
    paused INTEGER NOT NULL, reason TEXT NOT NULL, "by" TEXT NOT NULL, since TEXT NOT NULL
);
CREATE TABLE jobs (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL, owner TEXT NOT NULL, source TEXT NOT NULL,
    priority INTEGER NOT NULL, held INTEGER NOT NULL, depends_on TEXT NOT NULL, notes TEXT NOT NULL,
    on_failure TEXT NOT NULL, retries INTEGER NOT NULL, stepwise INTEGER NOT NULL,
    state TEXT NOT NULL, position REAL NOT NULL, submitted TEXT NOT NULL,
    steps INTEGER NOT NULL, done INTEGER NOT NULL, code INTEGER NOT NULL, message TEXT NOT NULL,
    predicted REAL, duration REAL, began TEXT NOT NULL, ended TEXT NOT NULL,
    key TEXT NOT NULL, digest TEXT NOT NULL, proposal INTEGER NOT NULL, approved_by TEXT NOT NULL
);
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_by_owner ON jobs (owner, state, id);
CREATE UNIQUE INDEX jobs_by_key ON jobs (owner, key) WHERE key <> '';
CREATE TABLE bodies (job INTEGER PRIMARY KEY, body TEXT NOT NULL);
CREATE TABLE labels (job INTEGER PRIMARY KEY, words TEXT NOT NULL);
CREATE TABLE steps (
    job INTEGER NOT NULL, "index" INTEGER NOT NULL, state TEXT NOT NULL, code INTEGER NOT NULL, message TEXT NOT NULL,
    predicted REAL, duration REAL, phase TEXT NOT NULL, "end" TEXT,
    PRIMARY KEY (job, "index")
) WITHOUT ROWID;
CREATE TABLE events (
    number INTEGER PRIMARY KEY,
    run INTEGER NOT NULL, seq INTEGER NOT NULL, date TEXT NOT NULL, time REAL NOT NULL,
    kind TEXT NOT NULL, code INTEGER NOT NULL, detail TEXT NOT NULL
);
CREATE UNIQUE INDEX events_by_seq ON events (run, seq);
CREATE TABLE audit (
    number INTEGER PRIMARY KEY,
    date TEXT NOT NULL, who TEXT NOT NULL, role TEXT NOT NULL, source TEXT NOT NULL,
    operation TEXT NOT NULL, code INTEGER NOT NULL, detail TEXT NOT NULL
);
"""

MIGRATIONS: tuple[str, ...] = (_VERSION_1,)
"""The migrations from each version to the next; the first one initialises an empty file."""

VERSION = len(MIGRATIONS)
"""The version that this program writes."""


def migrate(connection: sqlite3.Connection, path: Path | str, steps: tuple[str, ...] = MIGRATIONS) -> None:
    """Bring the file to this version, one transaction a step, so that one which is cut short has not happened.

    `path` is for what is raised: `StorageTooNew`, and `FileNotOurs` for a database of another program.
    """
    found = version(connection, path, len(steps))
    for number, script in enumerate(steps[found:], found + 1):
        connection.executescript(
            f"BEGIN IMMEDIATE;{script};PRAGMA application_id = {APPLICATION};PRAGMA user_version = {number};COMMIT;"
        )


def version(connection: sqlite3.Connection, path: Path | str, known: int = VERSION) -> int:
    """Return the version of a file, 0 for one that is empty; raises as `migrate` does."""
    found = int(connection.execute("PRAGMA user_version").fetchone()[0])
    application = int(connection.execute("PRAGMA application_id").fetchone()[0])
    if (found or _strangers(connection)) and application != APPLICATION:
        raise FileNotOurs(path=path, remedy="it is the database of another program; name another state folder")
    if found > known:
        raise StorageTooNew(path=path, found=found, known=known)
    return found


def _strangers(connection: sqlite3.Connection) -> bool:
    """Whether there are tables other than those of the users, which may be there before ours."""
    named = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name NOT GLOB 'access_*'"
    return bool(connection.execute(named).fetchone()[0])
