"""The trunk of the tree of errors, which is that of `dmc41x3`."""

from __future__ import annotations

from dmc41x3.errors import CodedError, MachineError, RequestError

__all__ = ["MachineError", "MayaError", "RequestError"]

MayaError = CodedError
"""Base of all errors: `except MayaError` catches those of Maya and those of the controller."""
