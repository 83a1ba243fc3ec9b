"""Reasons for data that pydantic refuses, in the words of this project. They replace pydantic's, which are English."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from dmc41x3.i18n import PHRASE, marked, phrase
from maya_un.errors import InvalidRequest, InvalidValue

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails, ValidationError

_MISSING = phrase("it is missing")
UNKNOWN = phrase("there is no such key")
"""Why a key is refused that a mapping does not have."""

_TRUTH = phrase("it must be true or false")
WHOLE = phrase("it must be a whole number")
"""Why a value is refused that is no whole number."""

_NUMBER = phrase("it must be a number")
_TEXT = phrase("it must be a text")
_LIST = phrase("it must be a list")
_OBJECT = phrase("it must be an object")
_CHOICES = marked("it must be one of {choices}", PHRASE)
_LEAST = marked("its length must be at least {min_length}", PHRASE)
_MOST = marked("its length must be at most {max_length}", PHRASE)

_TEMPLATES = {
    "missing": _MISSING,
    "missing_argument": _MISSING,
    "extra_forbidden": UNKNOWN,
    "unexpected_keyword_argument": UNKNOWN,
    "greater_than": marked("it must be greater than {gt}", PHRASE),
    "greater_than_equal": marked("it must be at least {ge}", PHRASE),
    "less_than": marked("it must be less than {lt}", PHRASE),
    "less_than_equal": marked("it must be at most {le}", PHRASE),
    "finite_number": phrase("it must be a finite number"),
    "int_type": WHOLE,
    "int_parsing": WHOLE,
    "int_parsing_size": phrase("it has too many digits"),
    "int_from_float": WHOLE,
    "float_type": _NUMBER,
    "float_parsing": _NUMBER,
    "bool_type": _TRUTH,
    "bool_parsing": _TRUTH,
    "string_type": _TEXT,
    "string_unicode": phrase("it must be text that can be encoded"),
    "string_too_short": _LEAST,
    "string_too_long": _MOST,
    "string_pattern_mismatch": marked("it must have the form {pattern}", PHRASE),
    "list_type": _LIST,
    "tuple_type": _LIST,
    "too_short": _LEAST,
    "too_long": _MOST,
    "dict_type": _OBJECT,
    "mapping_type": _OBJECT,
    "model_type": _OBJECT,
    "model_attributes_type": _OBJECT,
    "dataclass_type": _OBJECT,
    "dataclass_exact_type": _OBJECT,
    "none_required": phrase("it must be null"),
    "invalid_key": phrase("a key must be a text"),
    "literal_error": _CHOICES,
    "enum": _CHOICES,
    "json_invalid": marked("it is not JSON ({error})", PHRASE),
}
"""Our template for each kind of error of pydantic. The placeholders are pydantic's, and `choices`."""


def reason_of(error: ErrorDetails | Mapping[str, Any]) -> str:
    """Return why pydantic refused a value. A validator of ours gave its own reason."""
    context = error.get("ctx", {})
    if error["type"] == "value_error":
        return str(context["error"])
    template = _TEMPLATES.get(error["type"])
    if template is None:  # a kind of error that no message of ours causes
        return error["msg"]
    choices = str(context.get("expected", "")).replace(" or ", ", ")
    return template.format(**context, choices=choices)


def refusal_of(error: ValidationError, *place: str) -> InvalidRequest | InvalidValue:
    """Return Maya's error for the first error that pydantic found in the value at `place` of a body."""
    first = error.errors(include_url=False)[0]
    key = ".".join((*place, *map(str, first["loc"]))) or "body"
    if first["type"] in {"missing", "unexpected_keyword_argument", "extra_forbidden"}:
        return InvalidRequest(key=key, reason=reason_of(first))
    return InvalidValue(key=key, value=repr(first["input"])[:64], reason=reason_of(first))


_CLOSE = 0.8
"""Similarity of a misspelt key and the one that was meant."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the one of the `known` names that was probably meant by a misspelt one, None if none is near."""
    from difflib import get_close_matches  # noqa: PLC0415 - only for a mistake

    return next(iter(get_close_matches(name, tuple(known), 1, _CLOSE)), None)
