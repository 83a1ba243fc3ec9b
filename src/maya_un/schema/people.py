"""Users, their tokens, the control lease and the audit log, as messages. Dates are ISO 8601 in UTC, times in s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from maya_un.schema.choices import RoleName
from maya_un.values import Notice

LONGEST = 12 * 3600.0
"""Longest time for which a lease is valid without being renewed [s]."""

PATIENCE = 10.0
"""A lease that is not renewed within this time ends [s, real time]."""


@dataclass(frozen=True, slots=True)
class LeaseView:
    """The driver: name, source, time since the start [s], note; "" and 0 without a driver.

    An `implicit` lease lasts as long as one command or job. `expires_in` [s] is None if nothing has to be renewed.
    `yours` means that the caller holds it, under the lease in the request.
    """

    holder: str
    source: str
    since: float
    note: str
    implicit: bool
    expires_in: float | None
    offered_to: str | None
    asked_by: str | None
    yours: bool


@dataclass(frozen=True, slots=True)
class LeaseTaken:
    """The lease was taken: send its `id` with every request, and renew it within `expires_in` [s]."""

    id: str
    holder: str
    note: str
    expires_in: float


@dataclass(frozen=True, slots=True)
class TokenLine:
    """A token without its secret. Dates are in UTC; `expires` and `used` are "" for never."""

    id: str
    user: str
    note: str
    created: str
    expires: str
    used: str
    session: bool
    valid: bool


@dataclass(frozen=True, slots=True)
class UserLine:
    """A user: role, date of creation, whether a password is set, number of valid tokens, date of last use."""

    name: str
    role: RoleName
    created: str
    password: bool
    tokens: int
    used: str


@dataclass(frozen=True, slots=True)
class NewToken:
    """A new token; `token` is shown now and never again."""

    id: str
    user: str
    role: RoleName
    token: str
    note: str
    expires: str


@dataclass(frozen=True, slots=True)
class Me:
    """The caller: name, role, token, source. `users` is True if users exist."""

    name: str
    role: RoleName
    token: str
    source: str
    users: bool


@dataclass(frozen=True, slots=True)
class AuditLine:
    """A request: its caller, source, date (ISO 8601, UTC) and result; `code` is 0, or that of the error.

    `role` is "" if the caller is unknown.
    """

    number: int
    date: str
    who: str
    role: RoleName | Literal[""]
    source: str
    operation: str
    code: int
    detail: str


@dataclass(frozen=True, slots=True)
class Permissions:
    """The actions of a user by name: null if the caller may do it now, else the code and the reason of the refusal."""

    actions: dict[str, Notice | None]
