"""Messages as JSON."""

from __future__ import annotations

import pytest
from pydantic import TypeAdapter

from maya_un.schema.encoding import to_json
from maya_un.values import Joints


@pytest.mark.parametrize("count", [0, 1, 3])
def test_a_list_of_messages_is_encoded_as_pydantic_encodes_it(count: int) -> None:
    messages = [Joints(0.5, 1.0, number / 3.0) for number in range(count)]
    assert to_json(messages) == TypeAdapter(list[Joints]).dump_json(messages)
    assert to_json([messages, messages]) == TypeAdapter(list[list[Joints]]).dump_json([messages, messages])
