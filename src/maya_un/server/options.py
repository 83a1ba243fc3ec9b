"""Options for jobs in the query and the headers of a request: how to queue one, which ones to list."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import Depends, Header, Query
from pydantic import Field

from maya_un.process.journal.protocol import Filter
from maya_un.process.journal.rows import JobOptions
from maya_un.schema.jobs import OnFailure
from maya_un.schema.states import TaskState
from maya_un.server.numbers import MOST

_NUMBER = Annotated[int, Field(ge=1, le=MOST)]


async def _options(
    priority: Annotated[int, Query(ge=-100, le=100, description="the greater goes first")] = 0,
    held: Annotated[bool, Query(description="waits for somebody to release it")] = False,
    depends_on: Annotated[
        list[_NUMBER], Query(max_length=100, description="begins after these jobs are done; may be repeated")
    ] = [],  # noqa: B006
    notes: Annotated[str, Query(max_length=1000)] = "",
    on_failure: Annotated[OnFailure, Query(description="what the queue does after it failed")] = OnFailure.CONTINUE,
    retries: Annotated[int, Query(ge=0, le=10, description="of a step that is harmless to repeat")] = 0,
    stepwise: Annotated[bool, Query(description="the queue pauses after every step")] = False,
) -> JobOptions:
    return JobOptions(priority, held, tuple(depends_on), notes, on_failure, retries, stepwise)


SubmitOptions = Annotated[JobOptions, Depends(_options)]
"""The options in a request's query."""

IdempotencyKey = Annotated[
    str,
    Header(
        alias="Idempotency-Key",
        max_length=200,
        description="the same key and request once more are answered with the job that there is",
    ),
]
"""The key that a request shows, "" without one."""


async def _filter(
    state: Annotated[list[TaskState], Query(max_length=20, description="in these states; may be repeated")] = [],  # noqa: B006
    owner: Annotated[str | None, Query(max_length=200, description="of this owner")] = None,
    text: Annotated[str, Query(max_length=200, description="with this in their name or notes")] = "",
    below: Annotated[int | None, Query(ge=0, le=MOST, description="numbered below")] = None,
    above: Annotated[int | None, Query(ge=0, le=MOST, description="numbered above")] = None,
    limit: Annotated[int, Query(ge=1, le=1000, description="so many at most")] = 100,
    order: Literal["newest", "oldest"] = "newest",
) -> Filter:
    return Filter(tuple(state), owner, text, below, above, order == "oldest", limit)


Which = Annotated[Filter, Depends(_filter)]
"""Which jobs a request is to list."""
