"""What is refused is called as it was said: by the option of the command line, not by the key of the request."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from maya_un.errors import InvalidRequest, InvalidValue


@contextmanager
def called(options: Mapping[str, str]) -> Iterator[None]:
    """Have refusals of the block name an option, where `options` has one for the key that they name."""
    try:
        yield
    except (InvalidValue, InvalidRequest) as refusal:
        option = options.get(str(refusal.details.get("key")))
        if option is None:
            raise
        raise refusal.copy(key=option) from None
