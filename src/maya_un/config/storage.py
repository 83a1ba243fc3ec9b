"""How much of the past the queue's file keeps."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from maya_un.config.base import ConfigSection


class StorageConfig(ConfigSection):
    """The file of the queue: events and audit entries beyond this are dropped, the oldest first; jobs never are."""

    events: Annotated[int, Field(ge=1000, le=10_000_000, description="events kept")] = 200_000
    audit: Annotated[int, Field(ge=1000, le=10_000_000, description="entries of the audit log kept")] = 100_000
    days: Annotated[int, Field(ge=1, le=36_500, description="and none older than so many days before the newest")] = 365
