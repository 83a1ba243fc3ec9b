"""A terminal of a fixed size that nobody sits at: keys in, the picture out. For tests and for pictures of the docs."""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

PATIENCE = 20.0
"""Longest wait for something to show [s]; an own server on a busy machine needs a few."""

_LOOK = 0.03
_RUN = 'trap : INT; "$@"; echo "ended with exit code $?"; exec cat'
_ENDED = re.compile(r"^ended with exit code ([0-9]+)$", re.MULTILINE)


class Pane:
    """One command in a terminal of its own; made by `pane`."""

    def __init__(self, server: str) -> None:
        self._server = server

    def type(self, text: str) -> None:
        """Type text as it is, without an end of line."""
        _tmux(self._server, "send-keys", "-l", text)

    def press(self, *keys: str) -> None:
        """Press keys by their names in tmux: Enter, Tab, C-c, F12."""
        _tmux(self._server, "send-keys", *keys)

    def enter(self, text: str) -> None:
        """Type a line and press Enter once it shows."""
        self.type(text)
        self.until(text)
        self.press("Enter")

    def picture(self, *, colours: bool = False) -> str:
        """Return what shows, as text; with colours as the escape sequences that made it."""
        return _tmux(self._server, "capture-pane", "-p", *(["-e"] if colours else []))

    def ended(self) -> int:
        """Wait until the command has ended and return its exit code."""
        found = _ENDED.search(self.until_true(lambda picture: _ENDED.search(picture) is not None, "its end"))
        assert found is not None
        return int(found[1])

    def history(self) -> str:
        """Return what has scrolled away and what shows, as text."""
        return _tmux(self._server, "capture-pane", "-p", "-S", "-")

    def until(self, text: str) -> str:
        """Wait until `text` shows and return the picture; raises `AssertionError` with it where it never does."""
        return self.until_true(lambda picture: text in picture, repr(text))

    def until_true(self, holds: Callable[[str], bool], words: str) -> str:
        """Wait until `holds` of the picture and return it; `words` say what was waited for where it never does."""
        end = time.monotonic() + PATIENCE
        look = threading.Event()
        while not holds(picture := self.picture()):
            if time.monotonic() > end:
                raise AssertionError(f"never showed {words}, but:\n{picture}")
            look.wait(_LOOK)
        return picture


@contextmanager
def pane(
    command: Sequence[str], *, width: int, height: int, environment: Mapping[str, str] | None = None
) -> Iterator[Pane]:
    """Run a command in a terminal while the block runs; its picture stays when it ends."""
    with tempfile.TemporaryDirectory(prefix="tmux-", ignore_cleanup_errors=True) as folder:
        yield from _own_server(f"{folder}/server", command, (width, height), environment or {})


def _own_server(server: str, command: Sequence[str], size: tuple[int, int], place: Mapping[str, str]) -> Iterator[Pane]:
    surroundings = [word for name, value in place.items() for word in ("-e", f"{name}={value}")]
    sized = ("-x", str(size[0]), "-y", str(size[1]))
    _tmux(server, "-f", os.devnull, "new-session", "-d", *sized, *surroundings, "cat")
    try:
        _tmux(server, "set-option", "-g", "default-terminal", "tmux-256color")
        _tmux(server, "respawn-pane", "-k", *surroundings, "sh", "-c", _RUN, "sh", *command)
        yield Pane(server)
    finally:
        _tmux(server, "kill-server")


def _tmux(server: str, *words: str) -> str:
    surroundings = {**os.environ, "LC_ALL": "C.UTF-8"}
    done = subprocess.run(
        ["tmux", "-u", "-S", server, *words], capture_output=True, encoding="utf-8", check=False, env=surroundings
    )
    if done.returncode:
        raise RuntimeError(f"tmux {' '.join(words)}: {done.stderr.strip()}")
    return done.stdout
