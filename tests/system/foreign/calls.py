"""Which functions of a module were called, noticed from outside."""

from __future__ import annotations

import inspect
import sys
from types import FrameType, ModuleType


class Calls:
    """Notes every call into `module` from when it is made."""

    def __init__(self, module: ModuleType) -> None:
        self._module = module
        self._file = module.__file__
        self._called: set[str] = set()
        sys.setprofile(self._notice)

    def _notice(self, frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename == self._file:
            self._called.add(frame.f_code.co_qualname)

    def missing(self, *classes: type) -> list[str]:
        """Return the public functions of classes that were never called."""
        return [
            f"{owner.__name__}.{name}"
            for owner in classes
            for name, member in vars(owner).items()
            if inspect.isfunction(inspect.unwrap(getattr(member, "fget", member) or member))
            and not name.startswith("_")
            and f"{owner.__name__}.{name}" not in self._called
        ]
