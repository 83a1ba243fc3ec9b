"""Parameters: a tree that is read by name."""

from __future__ import annotations

import asyncio
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph.bus import BusParameters

NAMES = st.lists(st.sampled_from("abc"), min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))


async def test_set_parameter_and_its_parents_are_found() -> None:
    parameters = BusParameters()
    await parameters.set("/maya/speed", 5)
    await parameters.set("maya/config", {"axes": {"a": {"letter": "A"}}, "zones": []})
    assert await parameters.get("/maya/speed") == 5
    assert await parameters.get("/maya/config/axes/a/letter") == "A"
    assert await parameters.get("/maya/config/axes") == {"a": {"letter": "A"}}
    assert await parameters.get("/maya/none", "x") == "x"
    assert await parameters.get("/maya/speed/below", "x") == "x"
    assert sorted(await parameters.names()) == ["/maya/config/axes/a/letter", "/maya/config/zones", "/maya/speed"]


async def test_deleted_parameter_is_gone_with_its_children() -> None:
    parameters = BusParameters()
    await parameters.set("/", {"a": {"b": 1}, "c": 2})
    await parameters.delete("/a")
    await parameters.delete("/nowhere/at/all")
    assert await parameters.get("/") == {"c": 2}
    assert await parameters.names() == ["/c"]
    await parameters.delete("/")
    assert await parameters.names() == []


async def test_name_without_remaining_values_is_unset() -> None:
    parameters = BusParameters()
    await parameters.set("/a/b/c", 1)
    await parameters.set("/d", {})
    await parameters.delete("/a/b/c")
    assert await parameters.names() == []
    assert await parameters.get("/a") == {"b": {}}


async def test_values_are_nobodys_to_change() -> None:
    parameters = BusParameters()
    value = {"a": [1]}
    await parameters.set("/x", value)
    value["a"].append(2)
    (await parameters.get("/x"))["a"].append(3)
    assert await parameters.get("/x/a") == [1]


@given(st.lists(st.tuples(NAMES, st.integers() | st.none())))
def test_last_assignment_of_a_name_wins(changes: list[tuple[str, int | None]]) -> None:
    async def change() -> None:
        parameters, model = BusParameters(), dict[str, Any]()
        for name, value in changes:
            within = [known for known in model if known.startswith(name + "/") or name.startswith(known + "/")]
            if value is None:
                await parameters.delete(name)
                within = [known for known in within if known.startswith(name + "/")]
                model.pop(name, None)
            else:
                await parameters.set(name, value)
                model[name] = value
            for known in within:
                del model[known]
        for name, value in model.items():
            assert await parameters.get(name) == value
        assert set(await parameters.names()) == set(model)

    asyncio.run(change())
