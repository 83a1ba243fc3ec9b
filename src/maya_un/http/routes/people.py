"""Routes of people: sessions, users, tokens and the control lease."""

from __future__ import annotations

from typing import Annotated

from fastapi import Request, Response

from maya_un.errors import (
    LastAdministrator,
    LeaseHeld,
    LeaseLost,
    LeaseNeeded,
    NameTaken,
    NotFound,
    NotSignedIn,
    StorageFailed,
    TooManyRequests,
    UnknownName,
)
from maya_un.http.bridge import Bridge
from maya_un.http.connections import source_of
from maya_un.http.exchange import answer, sent
from maya_un.http.request_context import Ask
from maya_un.http.routing import Routes
from maya_un.schema.bodies import Offering, Removed, SigningIn, Taking, TokenRequest, UserChange, UserRequest
from maya_un.schema.people import LeaseTaken, LeaseView, Me, NewToken, Permissions, TokenLine, UserLine
from maya_un.service.access.operations import Operation
from maya_un.service.permissions import as_permissions
from maya_un.service.service import Service

_TAG = "lease"
_OWN_LEASE = (LeaseLost, LeaseNeeded, LeaseHeld)

TakingBody = Annotated[Taking, sent(Taking, optional=True)]
OfferingBody = Annotated[Offering, sent(Offering)]


def add_lease(routes: Routes) -> None:
    """Add the routes of the control lease."""

    @routes.add("GET", "/v1/lease", Operation.READ, tag=_TAG, gives=LeaseView, client="lease.view")
    async def lease(ask: Ask) -> Response:
        """Return the holder of the control lease.

        Return also the time since it was taken, the note, and whether the caller holds it.
        """
        return answer(await ask(lambda service: service.lease.view(ask.caller)))

    notes = {"with a note": {"note": "aligning the tray"}, "take it from the holder": {"force": True}}

    @routes.add(
        "POST",
        "/v1/lease",
        Operation.LEND,
        Operation.LEASE,
        tag=_TAG,
        gives=LeaseTaken,
        refuses=(LeaseHeld,),
        examples=notes,
    )
    async def take_lease(ask: Ask, body: TakingBody) -> Response:
        """Take the control lease.

        Send the `id` in the response with further requests, in the header `Maya-Lease`.
        """
        taken = ask(
            lambda service: service.lease.take(ask.caller, note=body.note, patience=body.patience, force=body.force),
            subject="take",
        )
        return answer(await taken)

    @routes.add("POST", "/v1/lease/renew", Operation.RENEW, tag=_TAG, gives=LeaseView, refuses=_OWN_LEASE)
    async def renew_lease(ask: Ask) -> Response:
        """Renew the control lease."""
        return answer(await ask(lambda service: service.lease.renew(ask.caller)))

    @routes.add("DELETE", "/v1/lease", Operation.LEASE, tag=_TAG, gives=LeaseView, refuses=_OWN_LEASE)
    async def release_lease(ask: Ask) -> Response:
        """Release the control lease."""
        return answer(await ask(lambda service: service.lease.release(ask.caller)))

    offers = {"to a student": {"to": "ana"}}
    offering = (LeaseHeld, UnknownName)

    @routes.add(
        "POST",
        "/v1/lease/offer",
        Operation.LEND,
        tag=_TAG,
        gives=LeaseView,
        refuses=offering,
        examples=offers,
        client="lease.offer",
    )
    async def offer_lease(ask: Ask, body: OfferingBody) -> Response:
        """Offer the control lease to a user, who may take it within a minute."""
        return answer(await ask(lambda service: service.lease.offer(body.to, ask.caller)))

    @routes.add("POST", "/v1/lease/ask", Operation.LEASE, tag=_TAG, gives=LeaseView, client="lease.ask")
    async def ask_for_lease(ask: Ask) -> Response:
        """Ask the holder for the control lease."""
        return answer(await ask(lambda service: service.lease.ask(ask.caller), subject="ask"))


_ME = "oneself"
_USERS = "users"
_OWN = (Operation.USERS, Operation.ME)

SigningInBody = Annotated[SigningIn, sent(SigningIn)]
UserBody = Annotated[UserRequest, sent(UserRequest)]
ChangeBody = Annotated[UserChange, sent(UserChange)]
TokenBody = Annotated[TokenRequest, sent(TokenRequest, optional=True)]


def add_sessions(routes: Routes) -> None:
    """Add the routes of the caller: identity and session."""

    @routes.add("GET", "/v1/me", Operation.READ, tag=_ME, gives=Me, client="users.me")
    async def me(ask: Ask) -> Response:
        """Return the caller: name, role, token and source."""
        return answer(await ask(lambda service: service.users.me(ask.caller)))

    @routes.add("GET", "/v1/me/can", Operation.READ, tag=_ME, gives=Permissions, client="users.can")
    async def can(ask: Ask) -> Response:
        """Return which actions the caller may do now, and why not the others.

        It is a forecast: every action checks again when it begins.
        """

        async def found(service: Service) -> Permissions:
            return as_permissions(service.refusals(ask.caller), ask.language)

        return answer(await ask(found))

    @routes.add(
        "POST",
        "/v1/session",
        tag=_ME,
        gives=NewToken,
        refuses=(NotSignedIn, TooManyRequests, StorageFailed),
        examples={"by name and password": {"name": "ana", "password": "correct horse battery"}},
        client="users.sign_in",
    )
    async def sign_in(request: Request, body: SigningInBody) -> Response:
        """Sign in by name and password; return the token of the session."""
        source = source_of(request)
        bridge: Bridge = request.app.state.bridge
        return answer(await bridge.asked(lambda service: service.users.sign_in(body.name, body.password, source)))

    @routes.add(
        "DELETE",
        "/v1/session",
        Operation.ME,
        tag=_ME,
        gives=Removed,
        refuses=(NotFound, StorageFailed),
        client="users.sign_out",
    )
    async def sign_out(ask: Ask) -> Response:
        """Sign out: revoke the token of this request."""
        await ask(lambda service: service.users.sign_out(ask.caller))
        return answer(Removed(ask.caller.token))


def add_users(routes: Routes) -> None:
    """Add the routes of users."""

    @routes.add("GET", "/v1/users", Operation.USERS, tag=_USERS, gives=list[UserLine], client="users.all")
    async def users(ask: Ask) -> Response:
        """Return all users."""
        return answer(await ask(lambda service: service.users.list()))

    @routes.add(
        "POST",
        "/v1/users",
        Operation.USERS,
        tag=_USERS,
        gives=NewToken,
        status=201,
        refuses=(NameTaken, StorageFailed),
        examples={"a student": {"name": "ana", "role": "student"}},
        client="users.add",
    )
    async def add_user(ask: Ask, body: UserBody) -> Response:
        """Add a user. Return the user's first token; Maya never returns this token again."""
        return answer(await ask(lambda service: service.users.add(body.name, body.role, body.password)), 201)

    @routes.add(
        "PATCH",
        "/v1/users/{name}",
        *_OWN,
        tag=_USERS,
        gives=UserLine,
        refuses=(UnknownName, LastAdministrator, StorageFailed),
        examples={
            "another role": {"role": "operator"},
            "own password": {"old": "correct horse battery", "password": "four words are enough"},
        },
        client="users.change",
    )
    async def change_user(ask: Ask, name: str, body: ChangeBody) -> Response:
        """Change the role or the password of a user. Every user may change their own password.

        An empty `password` removes the password. Users without the role admin must also send the `old` password.
        """
        changed = ask(
            lambda service: service.users.change(
                name, role=body.role, password=body.password, old=body.old, by=ask.caller
            ),
            subject="" if body.password is None else f"password of {name}",
        )
        return answer(await changed)

    @routes.add(
        "DELETE",
        "/v1/users/{name}",
        Operation.USERS,
        tag=_USERS,
        gives=Removed,
        refuses=(UnknownName, LastAdministrator, StorageFailed),
        client="users.remove",
    )
    async def remove_user(ask: Ask, name: str) -> Response:
        """Remove a user and all tokens of that user."""
        await ask(lambda service: service.users.remove(name))
        return answer(Removed(name))


def add_tokens(routes: Routes) -> None:
    """Add the routes of tokens."""

    @routes.add(
        "GET",
        "/v1/users/{name}/tokens",
        *_OWN,
        tag=_USERS,
        gives=list[TokenLine],
        refuses=(UnknownName,),
        client="users.tokens",
    )
    async def tokens(ask: Ask, name: str) -> Response:
        """Return the tokens of a user, without their secrets."""
        return answer(await ask(lambda service: service.users.tokens(name, ask.caller)))

    @routes.add(
        "POST",
        "/v1/users/{name}/tokens",
        *_OWN,
        tag=_USERS,
        gives=NewToken,
        status=201,
        refuses=(UnknownName, StorageFailed),
        examples={"with an expiry date": {"note": "notebook", "expires": "2099-01-31"}},
        client="users.add_token",
    )
    async def add_token(ask: Ask, name: str, body: TokenBody) -> Response:
        """Create a token for a user. Maya never returns this token again."""
        made = ask(
            lambda service: service.users.token(name, note=body.note, expires=body.expires, by=ask.caller),
            subject=f"new token of {name}",
        )
        return answer(await made, 201)

    @routes.add(
        "DELETE",
        "/v1/tokens/{token}",
        *_OWN,
        tag=_USERS,
        gives=Removed,
        refuses=(NotFound, StorageFailed),
        client="users.revoke_token",
    )
    async def revoke_token(ask: Ask, token: str) -> Response:
        """Revoke a token at once."""
        await ask(lambda service: service.users.revoke(token, ask.caller))
        return answer(Removed(token))
