"""Tokens as they are written: `maya_<id>_<secret>`. The id is public and says which it is; the secret is shown once."""

from __future__ import annotations

import re
import secrets
from typing import NamedTuple

PREFIX = "maya"
_FORM = re.compile(r"maya_([0-9a-f]{8})_([0-9a-f]{48})", re.ASCII)
_SCHEME = "bearer"


class PresentedToken(NamedTuple):
    """A token as somebody shows it."""

    id: str
    secret: str

    @property
    def text(self) -> str:
        """The token whole."""
        return f"{PREFIX}_{self.id}_{self.secret}"


def new() -> PresentedToken:
    """Return a token that nobody can guess: 192 random bits."""
    return PresentedToken(secrets.token_hex(4), secrets.token_hex(24))


def parse(text: str) -> PresentedToken | None:
    """Return the parts of a token, None for what is none."""
    found = _FORM.fullmatch(text)
    return None if found is None else PresentedToken(found[1], found[2])


def of_header(authorization: str | None) -> str | None:
    """Return what `Authorization: Bearer …` carries, None where it carries nothing of the kind."""
    scheme, _, rest = (authorization or "").strip().partition(" ")
    return rest.strip() or None if scheme.lower() == _SCHEME else None


def hidden(text: str) -> str:
    """Return a text with the secrets of the tokens in it left out, for a log."""
    return _FORM.sub(r"maya_\1_…", text)
