"""Callers: the principal behind a request, its role, and its credentials."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from maya_un.errors import InvalidValue
from maya_un.schema.bodies import RoleName


class Role(IntEnum):
    """Roles; each includes the rights of the ones before it.

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
    lease that it shows, "" where none. An `implicit` caller has no lease and takes the free lease for the length of a
    command: the local user while no users exist, and the ROS graph. `token` is the public part of the token it signed
    in with, "" where with none.
    """

    name: str
    role: Role
    source: str = ""
    lease: str = ""
    implicit: bool = False
    token: str = ""


LOCAL = Caller("local", Role.ADMIN, "local", implicit=True)
"""The local user while no users exist: has full access, and needs no lease."""

ROS = Caller("ros", Role.OPERATOR, "ros", implicit=True)
"""The ROS graph and rosbridge: one principal, which takes the free lease for each command."""

BYSTANDER = Caller("local", Role.VIEWER, "local")
"""A client on this machine without a token, though users exist: may only stop and abort."""

RESERVED = frozenset({LOCAL.name, ROS.name, "maya", "queue", "unknown"})
"""Names that no user can have."""
