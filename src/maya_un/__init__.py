"""Maya-UN: control software of the robot Maya, on a Galil DMC-41x3 or its virtual twin.

`maya_un.Client` and `maya_un.AsyncClient` connect to a running Maya, `maya_un.JobBuilder` builds jobs for it. They are
loaded at their first use, so a program without them starts faster.
"""

from __future__ import annotations

from importlib import import_module

from dmc41x3 import __version__
from dmc41x3.i18n import add_catalogue

__all__ = ["__version__"]

add_catalogue("maya_un")

_CLIENT = ("AsyncClient", "Client", "JobBuilder")


def __getattr__(name: str) -> object:
    if name in _CLIENT:
        return getattr(import_module("maya_un.client"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_CLIENT})
