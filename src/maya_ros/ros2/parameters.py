"""The parameters of a robot in ROS 2: its configuration, as the six services of rcl_interfaces.

The names are those of the configuration file below `config`, like config.geometry.length, and `address`, `sim_mode`,
`speed` and `use_sim_time`. The configuration is fixed while the program runs. A new value is checked with all others
and written to the file for the next start, by the operation `put_config`, so it needs the right to that operation.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from dmc41x3.i18n import phrase
from maya_ros.graph.outcome import call_service
from maya_ros.graph.protocol import Graph, Message
from maya_ros.graph.table import CALL_OPERATION
from maya_un.config.settings import flat, nested
from maya_un.errors import InvalidValue, MayaError

CONFIG = "config."
"""Begins the names of the settings."""

_FIELDS = {
    1: "bool_value", 2: "integer_value", 3: "double_value", 4: "string_value", 6: "bool_array_value",
    7: "integer_array_value", 8: "double_array_value", 9: "string_array_value",
}  # fmt: skip
"""The field of a ParameterValue for each type (rcl_interfaces/ParameterType); 5 are bytes, which no setting is."""

_NOT_SET = 0
_TYPES: Sequence[tuple[type, int]] = ((bool, 1), (int, 2), (float, 3), (str, 4))
_ARRAYS = 5
"""An array has the type of its items plus this."""


class Parameters:
    """The parameters of one node; `graph` is that of the programs of ROS 2, with their rights."""

    def __init__(self, graph: Graph, *, sim_time: bool) -> None:
        self._graph = graph
        self._sim_time = sim_time

    async def answer(self, service: str, request: Message) -> Message:
        """Answer a request to one of `names.PARAMETER_SERVICES`."""
        match service:
            case "list_parameters":
                return {"result": _listed(await self._values(), request)}
            case "get_parameters":
                values = await self._values()
                return {"values": [_value(values.get(name)) for name in request["names"]]}
            case "get_parameter_types":
                values = await self._values()
                return {"types": [_type(values.get(name)) for name in request["names"]]}
            case "describe_parameters":
                values = await self._values()
                return {"descriptors": [_described(name, values.get(name)) for name in request["names"]]}
            case "set_parameters":
                return {"results": [await self._set([one]) for one in request["parameters"]]}
            case _:
                return {"result": await self._set(request["parameters"])}

    async def _values(self) -> Mapping[str, Any]:
        known = dict(await self._graph.parameters.get("/maya", {}))
        settings = {f"{CONFIG}{name}": value for name, value in flat(known.pop("config", {})).items()}
        single = {name: value for name, value in known.items() if not isinstance(value, Mapping)}
        return {**settings, **single, "use_sim_time": self._sim_time}

    async def _set(self, parameters: Sequence[Message]) -> Message:
        """Write settings for the next start, all or none."""
        try:
            arguments = json.dumps({"config": {"settings": _settings(parameters)}})
            await call_service(self._graph, CALL_OPERATION, {"operation": "put_config", "arguments": arguments})
        except MayaError as error:
            return {"successful": False, "reason": f"{error.code}: {error}"}
        return {"successful": True, "reason": "written to the configuration file, for the next start"}


def _listed(values: Mapping[str, Any], request: Message) -> Message:
    """Return rcl_interfaces/ListParametersResult: the names below some prefixes, at most `depth` levels deep."""
    prefixes, depth = request["prefixes"], request["depth"]
    found = [
        name
        for name in values
        if (not prefixes and _within(name, depth))
        or any(name == one or (name.startswith(f"{one}.") and _within(name[len(one) + 1 :], depth)) for one in prefixes)
    ]
    return {"names": found, "prefixes": sorted({name.rpartition(".")[0] for name in found if "." in name})}


def _within(name: str, depth: int) -> bool:
    return depth == 0 or name.count(".") < depth


def _type(value: Any) -> int:
    """Return the type of a value; what ROS has no type for is text, as JSON."""
    if value is None:
        return _NOT_SET
    one = next((number for kind, number in _TYPES if isinstance(value, kind)), 0)
    if one or not isinstance(value, list):
        return one or 4
    items = {_type(item) for item in value}
    return items.pop() + _ARRAYS if len(items) == 1 and items <= {1, 2, 3, 4} else 4


def _value(value: Any) -> Message:
    """Return a value as rcl_interfaces/ParameterValue."""
    kind = _type(value)
    if kind == _NOT_SET:
        return {"type": kind}
    fits = kind != 4 or isinstance(value, str)
    return {"type": kind, _FIELDS[kind]: value if fits else json.dumps(value)}


def _described(name: str, value: Any) -> Message:
    fixed = "" if name.startswith(CONFIG) else "fixed while the program runs"
    constraints = fixed or "a new value is in force from the next start"
    return {"name": name, "type": _type(value), "additional_constraints": constraints, "read_only": bool(fixed)}


def _settings(parameters: Sequence[Message]) -> dict[str, Any]:
    """Return rcl_interfaces/Parameter of settings as nested tables; raises `InvalidValue`."""
    values = {_setting(one["name"]): _written(one["value"]) for one in parameters}
    try:
        return nested(values)
    except ValueError as error:
        raise InvalidValue(key="name", value=str(error), reason="a part of it is a setting and no section") from error


def _setting(name: str) -> str:
    if not name.startswith(CONFIG):
        reason = phrase("only settings, below {prefix}, can be changed", prefix=CONFIG)
        raise InvalidValue(key="name", value=name, reason=reason)
    return name.removeprefix(CONFIG)


def _written(value: Message) -> Any:
    """Return a rcl_interfaces/ParameterValue as plain data, None for a value that is not set."""
    field = _FIELDS.get(value["type"])
    return None if field is None else value[field]
