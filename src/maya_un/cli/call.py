"""`maya call`: send any operation of the HTTP interface to the running robot by name."""

from __future__ import annotations

import inspect
import json
from collections.abc import Sequence
from typing import Any

from dmc41x3.i18n import phrase
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.settings import OutputSettings
from maya_un.client.operations import Operation, operations
from maya_un.client.request import Request
from maya_un.errors import InvalidCommandLine


def call(name: str | None, given: Sequence[str], settings: OutputSettings) -> int:
    """Send the operation `name` with parameters like "ratio=0.5", and print its answer as JSON.

    Without a name, list the operations. Raises `InvalidCommandLine` for an unknown operation or parameter, and the
    errors of the service.
    """
    if name is None:
        return _list(settings)
    operation = operations().get(name)
    if operation is None:
        raise _invalid(phrase("there is no operation {name}, and `maya call` lists all operations", name=name))
    request = request_of(name, operation, given)
    output.emit(ServiceClient.find().ask(request))
    return output.DONE


def request_of(name: str, operation: Operation, given: Sequence[str]) -> Request[Any]:
    """Return the request of an operation; raises `InvalidCommandLine` for unknown or missing parameters.

    A value is parsed as JSON. It stays text if it is not JSON or if the parameter is text.
    """
    parameters = inspect.signature(operation).parameters
    values: dict[str, Any] = {}
    for pair in given:
        key, is_pair, text = pair.partition("=")
        if not is_pair:
            raise _invalid(phrase("{pair} is not of the form NAME=VALUE", pair=pair))
        if key not in parameters:
            names = ", ".join(parameters) or phrase("none")
            raise _invalid(
                phrase("{name} has no parameter {key}; its parameters: {names}", name=name, key=key, names=names)
            )
        values[key] = _value(text, str(parameters[key].annotation))
    missing = [key for key, one in parameters.items() if one.default is one.empty and key not in values]
    if missing:
        raise _invalid(phrase("{name} needs {names}", name=name, names=", ".join(missing)))
    return operation(**values)


def _list(settings: OutputSettings) -> int:
    rows = [(name, list(inspect.signature(one).parameters), _summary(one)) for name, one in operations().items()]
    listed = [{"operation": name, "parameters": keys, "help": summary} for name, keys, summary in rows]
    lines = [" ".join([name, *(f"{key}=" for key in keys)]) + f"\n    {summary}" for name, keys, summary in rows]
    return output.answer({"operations": listed}, "\n".join(lines), settings)


def _summary(operation: Operation) -> str:
    return (inspect.getdoc(operation) or "").partition("\n")[0]


def _value(text: str, annotation: str) -> Any:
    if annotation.startswith(("str", "Literal")):
        return text
    try:
        return json.loads(text)
    except ValueError:
        return text


def _invalid(reason: str) -> InvalidCommandLine:
    return InvalidCommandLine(reason=reason, command="maya call")
