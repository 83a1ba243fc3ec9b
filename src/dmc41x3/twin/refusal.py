"""How the virtual controller says no: inside as an exception, on the wire as `?` and a code for TC."""

from __future__ import annotations

from dmc41x3.language.codes import ErrorCode


class Rejection(Exception):
    """A command is answered `?`; `code` is what TC then reports."""

    def __init__(self, code: ErrorCode) -> None:
        self.code = code
        super().__init__(code.name)
