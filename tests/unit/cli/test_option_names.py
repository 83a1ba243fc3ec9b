"""An error names the given option, not the key of the request."""

from __future__ import annotations

import pytest

from maya_un.cli.client import called
from maya_un.errors import InvalidRequest, InvalidValue, NotHomed


@pytest.mark.parametrize(
    ("refusal", "key"),
    [
        (InvalidValue(key="patience", value=0.0, reason="it is 1 s to 43200 s"), "--for"),
        (InvalidRequest(key="patience", reason="it is missing"), "--for"),
        (InvalidValue(key="name", value="x", reason="no"), "name"),
    ],
)
def test_error_names_the_given_option(refusal: InvalidValue | InvalidRequest, key: str) -> None:
    with pytest.raises(type(refusal)) as found, called({"patience": "--for"}):
        raise refusal
    assert found.value.details == {**refusal.details, "key": key}
    assert key in str(found.value)


def test_everything_else_passes() -> None:
    with pytest.raises(NotHomed), called({"patience": "--for"}):
        raise NotHomed(command="maya home")
