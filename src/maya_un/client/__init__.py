"""Python clients of a running Maya, over HTTP and websocket: `maya_un.Client` and `maya_un.AsyncClient`.

Each method is defined once, as a plan (`plans`); one of two thin drivers (`blocking`, `awaiting`) executes it. The
names are loaded at their first use, so that the command line can import the requests alone.
"""

from __future__ import annotations

from importlib import import_module

_MODULES = {
    "AsyncClient": "async_client",
    "AsyncJobHandle": "resources",
    "Client": "client",
    "Event": "plans.streaming",
    "JobBuilder": "jobs",
    "JobHandle": "resources",
    "Picture": "pictures",
    "StillWaiting": "plans.jobs",
}

__all__ = [*_MODULES]  # noqa: PLE0604  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    if name in _MODULES:
        return getattr(import_module(f"maya_un.client.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES})
