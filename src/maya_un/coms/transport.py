"""What the agent needs from a transport: commands in, reports out."""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol


class Kind(StrEnum):
    """What a report tells of a step: a state, or its result."""

    ACCEPTED = "accepted"
    EXECUTING = "executing"
    RESULT = "result"


@dataclass(frozen=True, slots=True)
class Command:
    """A command as it arrived: JSON in UTF-8. `key` names it in the transport; it is the id of one without an id."""

    key: str
    text: bytes


@dataclass(frozen=True, slots=True)
class Report:
    """The state or result of step `id` as JSON text. `key` is that of its command, None if no command is known."""

    id: str
    kind: Kind
    text: str
    key: str | None = None


class Channel(Protocol):
    """A connection to the supervisors of one robot. Both methods raise `SupervisorsLost` when it has ended."""

    async def receive(self) -> Command:
        """Return the next command. Until its result is sent, a later connection delivers it again."""
        ...

    async def send(self, report: Report) -> None:
        """Send a report; returns when the other side has it. A result is the end of its command."""
        ...


class Transport(Protocol):
    """A way to the supervisors."""

    @property
    def where(self) -> str:
        """Its address, as people may read it: without credentials."""
        ...

    @property
    def default_command(self) -> str | None:
        """The command that a step without one means, as the robot's document says; None if it says nothing."""
        ...

    def connected(self, robot: str) -> AbstractAsyncContextManager[Channel]:
        """Connect for the robot of this name; raises `SupervisorsLost` if that fails."""
        ...
