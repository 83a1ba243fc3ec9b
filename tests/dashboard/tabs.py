"""A page of the dashboard in a browser: what a test looks at, and what must never happen in it."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import BrowserContext, ConsoleMessage, Request, expect

from tests.waiting import eventually

ELSEWHERE = "elsewhere.example"
"""A name of this machine that only the browser knows: pages of it are of another site."""

BROWSER = "chromium-headless-shell"
"""Of Debian: Chromium without windows."""

FLAGS = (
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--js-flags=--no-opt --no-maglev",
    f"--host-resolver-rules=MAP {ELSEWHERE} 127.0.0.1",
)
"""Of the browser. It draws in software, and composes the page in software too unless it is said like this.

Its optimising compilers are off: no page lives long enough here to gain by what they cost.
"""

SIZES = {"phone": (390, 844), "tablet": (820, 1180), "desktop": (1440, 900)}
"""Widths and heights of screens [px]."""

LANGUAGES = ("en", "es")
THEMES = ("dark", "light")

DRIVER = ("GL Driver Message", "GPU stall", "[.WebGL")
"""Warnings of the graphics driver say these; they are no mistakes of the page. A shader with a mistake is one."""

PATIENCE = 60.0
"""Longest wait for something on a page [s]; a busy machine is slow."""

expect.set_options(timeout=PATIENCE * 1e3)

GONE = (
    *("ERR_CONNECTION_REFUSED", "ERR_CONNECTION_RESET", "ERR_EMPTY_RESPONSE"),
    "error occurred when fetching the script",
)
"""The browser itself writes these to the console about a service that is not there."""

OWN = ("blob:", "data:")
"""Addresses that lead nowhere."""

VIOLATIONS = (
    "addEventListener('securitypolicyviolation',"
    " (broken) => console.error('policy', broken.violatedDirective, broken.blockedURI))"
)

NO_WORKER = "delete Navigator.prototype.serviceWorker"
"""Makes a browser like one that reaches the robot over http: it offers no service workers."""

SHOW_PAGE = """(address) => {
    const stays = location.pathname === new URL(address, location).pathname;
    window.headingBefore = stays ? null : document.querySelector('main h1');
    history.pushState(null, '', address);
    dispatchEvent(new PopStateEvent('popstate'));
}"""
"""Does what a link of the page does."""

VISIBILITY = """(hidden) => {
    Object.defineProperty(document, 'hidden', { configurable: true, get: () => hidden });
    document.dispatchEvent(new Event('visibilitychange'));
}"""
"""The browser of the tests shows all its tabs."""


class Tab:
    """A tab with the dashboard. `problems` are its console errors, its exceptions, and its requests to elsewhere."""

    def __init__(self, context: BrowserContext, url: str) -> None:
        self.page = context.new_page()
        self.page.set_default_timeout(PATIENCE * 1e3)
        self.problems: list[str] = []
        self.addresses: list[str] = []
        self._url = url
        self._home: tuple[str, ...] = (url, *OWN)
        self._forgiven: tuple[str, ...] = ()
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.problems.append(f"exception: {error}"))
        self.page.on("request", self._asked)
        self.page.on("websocket", lambda socket: self._reached(socket.url.replace("ws://", "http://")))

    def forgive(self, *texts: str) -> None:
        """Let console errors pass that hold one of these texts, for example about a service that was killed."""
        self._forgiven = texts

    def open(self, path: str = "/") -> None:
        """Load a page and wait until it shows the robot's state."""
        self.page.goto(self._url + path)
        self.until_live()

    def go(self, path: str) -> None:
        """Show another page as a link does, without loading it again; dialogues that are open are closed."""
        while self.get("document.querySelector('dialog[open]') !== null"):
            self.page.keyboard.press("Escape")
        self.page.evaluate(SHOW_PAGE, path)
        self.until(
            "![null, headingBefore].includes(document.querySelector('main h1'))", f"the page {path} has a heading"
        )

    def until_live(self) -> None:
        """Wait until the page is connected and has a heading."""
        self.until(
            "document.querySelector('main h1') && document.querySelector('[data-state].pill:is(.ok,.warn,.busy,.bad)')"
        )

    def until(self, expression: str, what: str = "") -> None:
        """Wait until an expression of JavaScript holds; the policy of the pages forbids the browser's own way."""
        eventually(lambda: self.page.evaluate(f"Boolean({expression})"), what or expression, PATIENCE, self.text)

    def jump(self, time: float) -> None:
        """Wait until the page is connected, then move its clock forward by a time [s].

        The page gives up a connection that takes longer than 5 s of its clock, and the browser warns of that.
        """
        self.until_live()
        self.page.clock.fast_forward(round(time * 1e3))

    def get(self, expression: str) -> Any:
        """Return the value of an expression of JavaScript."""
        return self.page.evaluate(expression)

    def text(self) -> str:
        """Return what is to be read on the page, and its problems."""
        return "\n".join([self.page.evaluate("document.body.innerText"), *self.problems])

    def sign_in(self, name: str, password: str) -> None:
        """Sign in by the dialogue that the page shows to people whom it does not know."""
        self.page.fill("dialog input[autocomplete=username]", name)
        self.page.fill("dialog input[type=password]", password)
        self.page.keyboard.press("Enter")
        self.until("!document.querySelector('dialog[open]')")
        self.until_live()

    def press(self, name: str) -> None:
        """Click the button within `data-<name>` as soon as it is on: the element around it takes clicks at any time."""
        self.page.click(f"[data-{name}] button:not([aria-disabled])")

    def choose(self, language: str, theme: str) -> None:
        """Choose language and theme for the next page that is loaded."""
        self.page.evaluate(
            "([language, theme]) => { localStorage['maya.language'] = language; localStorage['maya.theme'] = theme }",
            [language, theme],
        )

    def _said(self, message: ConsoleMessage) -> None:
        bad = message.type in {"error", "warning"}
        if bad and not any(text in message.text for text in (*DRIVER, *self._forgiven)):
            self.problems.append(f"{message.type}: {message.text}")

    def _asked(self, request: Request) -> None:
        self._reached(request.url)

    def leave(self) -> None:
        """Let requests to elsewhere pass: the tab shows a page of another site."""
        self._home = ("",)

    def allow(self, url: str) -> None:
        """Let requests to another address pass: that of a camera."""
        self._home = (*self._home, url)

    def hide(self, hidden: bool = True) -> None:
        """Tell the page that nobody sees it, or that somebody does."""
        self.page.evaluate(VISIBILITY, hidden)

    def _reached(self, url: str) -> None:
        self.addresses.append(url)
        if not url.startswith(self._home):
            self.problems.append(f"request to {url}")


def stop_in_sight(tab: Tab) -> None:
    """Fail unless a stop button is to be seen, in the window, with nothing over it but that of a dialogue."""
    found = tab.get(
        """[...document.querySelectorAll('button.stop')].filter((one) => one.getClientRects().length).map((one) => {
            const box = one.getBoundingClientRect();
            const hit = ([x, y]) => document.elementFromPoint(box.left + x * box.width, box.top + y * box.height);
            return [[0.5, 0.5], [0.1, 0.2], [0.9, 0.8]].every((point) => hit(point)?.closest('button.stop'));
        })"""
    )
    assert found
    assert all(found)
