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
from maya_un.client.operations import Operation, operation_named, operations, request_of
from maya_un.client.request import Request
from maya_un.errors import InvalidCommandLine, InvalidRequest


def call(name: str | None, given: Sequence[str], settings: OutputSettings) -> int:
    """Send the operation `name` with parameters like "ratio=0.5", and print its answer as JSON.

    Without a name, list the operations. Raises `InvalidCommandLine` for an unknown operation or parameter, and the
    errors of the service.
    """
    if name is None:
        return _list(settings)
    request = request_from(name, given)
    output.emit(ServiceClient.find().ask(request))
    return output.DONE


def request_from(name: str, given: Sequence[str]) -> Request[Any]:
    """Return the request of the operation `name` for parameters like "ratio=0.5"; raises `InvalidCommandLine`.

    A value is parsed as JSON. It stays text if it is not JSON or if the parameter is text.
    """
    try:
        parameters = inspect.signature(operation_named(name)).parameters
        texts = dict(map(_pair, given))
        kinds = {key: str(one.annotation) for key, one in parameters.items()}
        return request_of(name, {key: _value(text, kinds.get(key, "")) for key, text in texts.items()})
    except InvalidRequest as refused:
        key, reason = refused.details["key"], refused.details["reason"]
        raise _invalid(phrase("{key}: {reason}", key=key, reason=reason)) from refused


def _pair(text: str) -> tuple[str, str]:
    key, is_pair, value = text.partition("=")
    if not is_pair:
        raise _invalid(phrase("{pair} is not of the form NAME=VALUE", pair=text))
    return key, value


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
