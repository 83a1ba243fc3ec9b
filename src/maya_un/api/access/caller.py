"""Who asks: the principal behind a request, its role, and what it shows."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from maya_un.errors import InvalidValue
from maya_un.schema.bodies import RoleName


class Role(IntEnum):
    """What somebody may do, each all that the ones before it may.

    A viewer looks, and may stop. A student proposes jobs, and drives while an operator lends him the lease. An operator
    drives, keeps the queue and approves. An administrator keeps users as well.
    """

    VIEWER = 1
    STUDENT = 2
    OPERATOR = 3
    ADMIN = 4

    @property
    def word(self) -> str:
        """Its name as people write it."""
        return self.name.lower()

    @classmethod
    def of(cls, word: str) -> Role:
        """Return the role that people write like this; raises `InvalidValue`."""
        for role in cls:
            if role.word == word:
                return role
        known = ", ".join(role.word for role in cls)
        raise InvalidValue(key="role", value=repr(word), reason=f"it is one of {known}")


assert set(RoleName.__args__) == {role.word for role in Role}


@dataclass(frozen=True, slots=True)
class Caller:
    """One who asks.

    `name` is the principal's, `source` where the request came from ("127.0.0.1", "ros", "cli"). `lease` is the control
    lease that it shows, "" where none. One that is `implicit` shows none and takes the lease for the length of a wish
    while it is free: the local user without ceremony, and the ROS graph. `token` is the public part of the token it
    signed in with, "" where with none.
    """

    name: str
    role: Role
    source: str = ""
    lease: str = ""
    implicit: bool = False
    token: str = ""


LOCAL = Caller("local", Role.ADMIN, "local", implicit=True)
"""Whoever sits at the machine, while no users are kept: may everything, and needs no lease of his own."""

ROS = Caller("ros", Role.OPERATOR, "ros", implicit=True)
"""The ROS graph and rosbridge: one principal, which takes the lease for each wish while it is free."""

BYSTANDER = Caller("local", Role.VIEWER, "local")
"""Whoever sits at the machine and shows no token though users are kept: may stop and abort, and no more."""

RESERVED = frozenset({LOCAL.name, ROS.name, "maya", "queue", "unknown"})
"""Names that no user can have."""
