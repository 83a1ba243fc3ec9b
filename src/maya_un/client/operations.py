"""All operations of the service by name, and the request of an operation for given parameters.

The operations are the functions of `maya_un.client.requests`, which are generated from the routes. So this module needs
no change for a new operation.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from dmc41x3.i18n import phrase
from maya_un.client import requests
from maya_un.client.request import Request
from maya_un.errors import InvalidRequest

Operation = Callable[..., Request[Any]]

_KINDS: dict[str, tuple[type, ...]] = {"str": (str,), "int": (int,), "float": (int, float), "bool": (bool,)}
"""The Python types that JSON values of an annotated parameter have."""


def operations() -> dict[str, Operation]:
    """Return the operations by name, in the order of the reference page.

    Only those that answer in JSON are included.
    """
    found = {name: one for name, one in vars(requests).items() if inspect.isfunction(one)}
    return {name: one for name, one in found.items() if one.__module__ == requests.__name__ and _answers_json(one)}


def request_of(name: str, values: Mapping[str, Any]) -> Request[Any]:
    """Return the request of the operation `name` for parameters with JSON values. The service checks the values.

    Raises `InvalidRequest` for an unknown operation, an unknown or missing parameter, and a value of the wrong type.
    """
    operation = operation_named(name)
    parameters = inspect.signature(operation).parameters
    for key, value in values.items():
        if key not in parameters:
            names = ", ".join(parameters) or phrase("none")
            reason = phrase("{name} has the parameters {names}", name=name, names=names)
            raise InvalidRequest(key=key[:64], reason=reason)
        _check_type(key, value, str(parameters[key].annotation))
    missing = [key for key, one in parameters.items() if one.default is one.empty and key not in values]
    if missing:
        raise InvalidRequest(key=missing[0], reason=phrase("{name} needs {names}", name=name, names=", ".join(missing)))
    return operation(**values)


def operation_named(name: str) -> Operation:
    """Return the operation of this name; raises `InvalidRequest` if it is unknown."""
    operation = operations().get(name)
    if operation is None:
        raise InvalidRequest(
            key="operation", reason=phrase("{name!r} is unknown; `maya call` lists all operations", name=name[:64])
        )
    return operation


def _answers_json(operation: Operation) -> bool:
    return inspect.signature(operation).return_annotation not in {"Request[str]", "Request[bytes]"}


def _check_type(key: str, value: object, annotation: str) -> None:
    """Raise `InvalidRequest` if the value of a plain parameter has another type: it may become a part of the path."""
    kinds = _KINDS.get(annotation)
    if kinds is not None and (not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds)):
        raise InvalidRequest(key=key, reason=phrase("it is not of the type {type}", type=annotation))
