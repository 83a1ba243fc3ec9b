"""What happened: jobs of all times, their reports, the audit log."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from maya_un.api.messages import AuditLine
from maya_un.client.steps import Item, Request, Source, get
from maya_un.process.view import JobLine

PAGE = 100
"""Jobs of one page."""


def page(
    *,
    state: Sequence[str] = (),
    owner: str | None = None,
    text: str | None = None,
    below: int | None = None,
    above: int | None = None,
    limit: int = PAGE,
    order: Literal["newest", "oldest"] = "newest",
) -> Request[list[JobLine]]:
    """Return a page of jobs: by states, owner, words in the name or notes, numbers `below` and `above`."""
    return get(
        "/v1/jobs",
        list[JobLine],
        state=tuple(state),
        owner=owner,
        text=text,
        below=below,
        above=above,
        limit=limit,
        order=order,
    )


def every(*, state: Sequence[str] = (), owner: str | None = None, text: str | None = None) -> Source[JobLine]:
    """Yield all jobs, newest first, page after page."""
    below = None
    while True:
        lines = yield from page(state=state, owner=owner, text=text, below=below)
        for line in lines:
            yield Item(line)
        if len(lines) < PAGE:
            return
        below = lines[-1].id


def audit(*, below: int | None = None, limit: int = PAGE) -> Request[list[AuditLine]]:
    """Return who asked for what and what came of it, newest first, numbered below `below`."""
    return get("/v1/audit", list[AuditLine], below=below, limit=limit)
