"""The interface of a transport: commands in, reports out."""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol


class ReportKind(StrEnum):
    """The content of a report about a step: a state, or its result."""

    ACCEPTED = "accepted"
    EXECUTING = "executing"
    RESULT = "result"


@dataclass(frozen=True, slots=True)
class SupervisorCommand:
    """A command as it arrived: `text` is JSON in UTF-8, `key` names this delivery within the connection.

    `id` is the id of a command whose text has none; None if the transport knows none either.
    """

    key: str
    text: bytes
    id: str | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """The state or result of step `id` as JSON text; the id is None if its command had none that could be read.

    `key` is that of the command's delivery, None if none is known.
    """

    id: str | None
    kind: ReportKind
    text: str
    key: str | None = None


class SupervisorChannel(Protocol):
    """A connection to the supervisors of one robot. Both methods raise `SupervisorsLost` when it has ended."""

    async def receive(self) -> SupervisorCommand:
        """Return the next command. Until its result is sent, a later connection delivers it again."""
        ...

    async def send(self, report: Report) -> None:
        """Send a report; returns when the other side has it. A result is the end of its command."""
        ...


class SupervisorTransport(Protocol):
    """A way to the supervisors."""

    @property
    def where(self) -> str:
        """Its address, as people may read it: without credentials."""
        ...

    @property
    def default_command(self) -> str | None:
        """The command that a step without one means, as the robot's document says; None if it says nothing."""
        ...

    @property
    def needs_journal(self) -> bool:
        """Whether it must know the robot's journal to connect, because it claims commands for it."""
        ...

    def connected(self, robot: str, journal: str) -> AbstractAsyncContextManager[SupervisorChannel]:
        """Connect for the robot of this name, whose steps are in this journal; raises `SupervisorsLost` if that fails.

        `SessionTakenOver` if another robot has the name now.
        """
        ...
