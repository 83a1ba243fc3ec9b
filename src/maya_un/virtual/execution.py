"""One command, from whoever sent it: a mnemonic with its arguments, or an assignment."""

from __future__ import annotations

import re

from maya_un.galil.codes import ErrorCode
from maya_un.galil.commands import TOO_LONG
from maya_un.virtual.arguments import QUERY
from maya_un.virtual.commands import TABLE
from maya_un.virtual.context import Answer, Context
from maya_un.virtual.expressions import ONE, evaluate, is_name
from maya_un.virtual.refusal import Refused

MOST_VARIABLES = 510

_ASSIGNMENT = re.compile(r"([A-Za-z][A-Za-z0-9]*)\s*=(?!=)\s*(.*)")


def execute(context: Context, text: str) -> Answer:
    """Execute one command; raises `Refused`."""
    handler = TABLE.get(text[:2])
    if handler is not None:
        return handler(context, text[2:])
    if not text or text[0] == "'":
        return None
    if text.startswith(TOO_LONG):
        raise Refused(ErrorCode.INPUT_BUFFER_FULL)
    assignment = _ASSIGNMENT.fullmatch(text)
    if assignment is None:
        raise Refused(ErrorCode.UNRECOGNIZED_COMMAND)
    return _assign(context, *assignment.groups())


def _assign(context: Context, name: str, value: str) -> Answer:
    """Set a variable, or print it for `v=` and `v=?`."""
    if not is_name(name) or name == "TIME":
        raise Refused(ErrorCode.VARIABLE_ERROR)
    unit = context.unit
    if value in ("", QUERY):
        return unit.value_text(context.names.variable(name) / ONE)
    result = evaluate(value, context.names)
    if name not in unit.variables and len(unit.variables) >= MOST_VARIABLES:
        raise Refused(ErrorCode.TOO_MANY_VARIABLES)
    unit.variables[name] = result
    return None
