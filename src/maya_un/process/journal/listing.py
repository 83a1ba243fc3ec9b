"""Pages of the list of jobs: found through an index, whatever the filter, so that a long history costs nothing."""

from __future__ import annotations

import sqlite3

from maya_un.process.journal import encoding
from maya_un.process.journal.encoding import JOB
from maya_un.process.journal.protocol import Filter
from maya_un.process.journal.rows import JobRow
from maya_un.process.journal.tables import LARGEST, bounded
from maya_un.schema.states import TaskState

MOST = 1000
"""The longest page."""


def page(connection: sqlite3.Connection, which: Filter) -> list[JobRow]:
    """Return a page of jobs without their bodies."""
    statement, values = _by_text(which) if which.text.split() else _by_index(which)
    return [encoding.job_of(row) for row in connection.execute(statement, values).fetchall()]


def _by_index(which: Filter) -> tuple[str, list[object]]:
    """Look at each state by itself: the newest of each are the newest of all, and every part has an index in order."""
    if not which.states and which.owner is None:
        conditions, values = _conditions(which, "id", ())
        return f"SELECT {JOB} FROM jobs WHERE {conditions} {_end(which)}", [*values, _limit(which)]
    parts: list[str] = []
    values = []
    for state in which.states or tuple(TaskState):
        conditions, bound = _conditions(which, "id", (state,))
        parts.append(f"SELECT * FROM (SELECT id FROM jobs WHERE {conditions} {_end(which)})")
        values += [*bound, _limit(which)]
    numbers = f"SELECT id FROM ({' UNION ALL '.join(parts)}) {_end(which)}"
    return f"SELECT {JOB} FROM jobs WHERE id IN ({numbers}) ORDER BY id {_way(which)}", [*values, _limit(which)]


def _by_text(which: Filter) -> tuple[str, list[object]]:
    """Read the narrow table of words in order, until the page is full; the longest word rules most out."""
    words = sorted(which.text.casefold().split(), key=len, reverse=True)
    alike = " AND ".join("words LIKE ? ESCAPE '\\'" for _ in words)
    conditions, values = _conditions(which, "labels.job", which.states)
    found = f"SELECT {JOB} FROM labels CROSS JOIN jobs ON jobs.id = labels.job WHERE {alike} AND {conditions}"
    return f"{found} ORDER BY labels.job {_way(which)} LIMIT ?", [*map(_pattern, words), *values, _limit(which)]


def _conditions(which: Filter, number: str, states: tuple[TaskState, ...]) -> tuple[str, list[object]]:
    conditions = [f"{number} > ?", f"{number} < ?"]
    values: list[object] = [-1 if which.above is None else bounded(which.above)]
    values.append(LARGEST if which.below is None else bounded(which.below))
    if which.owner is not None:
        conditions.append("owner = ?")
        values.append(which.owner)
    if states:
        conditions.append(f"state IN ({', '.join('?' * len(states))})")
        values += [state.value for state in states]
    return " AND ".join(conditions), values


def _pattern(word: str) -> str:
    escaped = word.replace("\\", "\\\\").replace("%", "\\%").replace("_", "\\_")
    return f"%{escaped}%"


def _way(which: Filter) -> str:
    return "ASC" if which.oldest_first else "DESC"


def _end(which: Filter) -> str:
    return f"ORDER BY id {_way(which)} LIMIT ?"


def _limit(which: Filter) -> int:
    return max(0, min(which.limit, MOST))
