"""The base and the branches of all errors, and the sentences of `dmc41x3` that name commands of `maya` here."""

from __future__ import annotations

from dmc41x3.errors import (
    CodedError,
    CommandRejected,
    ConnectFailed,
    EndedUnanswered,
    InternalError,
    LinkLost,
    MachineError,
    ProgramRuns,
    RequestError,
    WrongController,
    reword,
)

__all__ = ["MachineError", "MayaError", "RequestError"]

MayaError = CodedError
"""Base of all errors: `except MayaError` catches those of Maya and those of the controller."""

reword(
    LinkLost,
    "The connection to the controller at {address} was lost ({reason}). If Maya was moving the axes, the guard in the "
    "controller stops them on their path, unless safety.guard_time is 0. Check cable and power, then run "
    "`maya recover`.",
)
reword(
    ConnectFailed,
    "No controller answers at {address} ({reason}). Check power, cable and address, or start a twin with `maya "
    "dmc serve`.",
)
reword(
    EndedUnanswered,
    "The device at {address} ended the connection before it answered ({reason}). It may be no Galil controller, "
    "or have no free handle (TH). Find the controllers with `maya dmc find`, or end a program that is connected to "
    "this one.",
)
reword(
    CommandRejected,
    "The controller refused {command!r} with code {tc} ({reason}). If you did not send this command "
    "yourself, this program has a defect, or another program uses the controller. Read the log (`maya "
    "logs`).",
)
reword(
    WrongController,
    "The device at {address} is {found}; Maya needs a DMC-41x3 with three axes. Check the address.",
)
reword(
    ProgramRuns,
    "A program runs in the controller, so no other can be downloaded. If it is Maya's watchdog program "
    "(the guard), end `maya up`; halt other programs with HX. Then download again.",
)
reword(
    InternalError,
    "An internal error happened ({reason}). This is a defect of this program: please report it with the log.",
)
