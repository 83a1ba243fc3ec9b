"""The dashboard in the default browser of this computer."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

_IN_TERMINAL = frozenset({"elinks", "links", "lynx", "w3m", "www-browser"})
"""The browsers of `webbrowser` that show a page as text."""


def show_page(url: str, failed: Callable[[], None]) -> None:
    """Open `url` in the default browser, in a thread of its own; call `failed` there if no browser opens.

    A browser can take seconds to answer, so neither the caller nor the end of the program waits for it.
    """
    threading.Thread(target=_show, args=(url, failed), name="maya-open", daemon=True).start()


def _show(url: str, failed: Callable[[], None]) -> None:
    opened = False
    with suppress(webbrowser.Error, OSError):
        browser = webbrowser.get()
        opened = not _in_terminal(browser) and browser.open(url)
    if not opened:
        failed()


def _in_terminal(browser: webbrowser.BaseBrowser) -> bool:
    """Return whether a browser would run in this terminal, where `maya up` prints."""
    return Path(getattr(browser, "name", "")).name in _IN_TERMINAL
