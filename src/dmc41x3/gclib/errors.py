"""Errors with the numbers and texts of the public header gclib_errors.h; scripts compare the texts."""

from __future__ import annotations

from enum import IntEnum

from dmc41x3.errors import CodedError, ConnectFailed, InvalidValue, LinkTimeout


class Code(IntEnum):
    """Return codes of gclib functions."""

    NON_BLOCKING_READ_EMPTY = -4
    TIMEOUT = -1100
    OPEN_ERROR = -1101
    ILLEGAL_COMMAND = -1106
    DATA_RECORD_ERROR = -1107
    UNSUPPORTED_FUNCTION = -1109
    FIRMWARE_LOAD_NOT_SUPPORTED = -1110
    ARRAY_NOT_DIMENSIONED = -1200
    CONNECTION_NOT_ESTABLISHED = -1201
    ILLEGAL_DATA_IN_PROGRAM = -1202
    UNABLE_TO_COMPRESS = -1203
    INVALID_PREPROCESSOR_OPTIONS = -1204
    QUESTION_MARK = -10000
    VALUE_RANGE = -10002
    LOST_DATA = -10004
    FILE = -10005
    ADDRESS = -10006


TEXTS: dict[Code, str] = {
    Code.NON_BLOCKING_READ_EMPTY: "data was not waiting for a zero-timeout read",
    Code.TIMEOUT: "device timed out",
    Code.OPEN_ERROR: "device failed to open",
    Code.ILLEGAL_COMMAND: "illegal command passed to command call",
    Code.DATA_RECORD_ERROR: "data record error",
    Code.UNSUPPORTED_FUNCTION: "function not supported on this communication bus",
    Code.FIRMWARE_LOAD_NOT_SUPPORTED: "firmware cannot be loaded on this communication bus to this hardware",
    Code.ARRAY_NOT_DIMENSIONED: "array not dimensioned on controller or wrong size",
    Code.CONNECTION_NOT_ESTABLISHED: "connection to hardware not established",
    Code.ILLEGAL_DATA_IN_PROGRAM: "illegal ASCII character in program",
    Code.UNABLE_TO_COMPRESS: "program cannot be compressed to fit on the controller",
    Code.INVALID_PREPROCESSOR_OPTIONS: "preprocessor did not recognize options",
    Code.QUESTION_MARK: "question mark returned by controller",
    Code.VALUE_RANGE: "value passed to function was bad or out of range",
    Code.LOST_DATA: "data was lost due to buffer or fifo limitations",
    Code.FILE: "file was not found, contents are invalid, or write failed",
    Code.ADDRESS: "a bad address was specified in open",
}
"""The texts of gclib for its codes; a script may compare them."""


class GclibError(Exception):
    """A gclib function failed. The message and `code` are gclib's; `detail` is an explanation by this package."""

    def __init__(self, code: Code | str, detail: str = "") -> None:
        self.code = code if isinstance(code, Code) else None
        self.detail = detail
        super().__init__(TEXTS[code] if isinstance(code, Code) else code)


def translated(error: CodedError) -> GclibError:
    """Return the error of gclib for an error of this package."""
    if isinstance(error, InvalidValue):
        return GclibError(Code.VALUE_RANGE, str(error))
    if isinstance(error, ConnectFailed):
        return GclibError(Code.OPEN_ERROR, str(error))
    if isinstance(error, LinkTimeout):
        return GclibError(Code.TIMEOUT, str(error))
    return GclibError(Code.CONNECTION_NOT_ESTABLISHED, str(error))
