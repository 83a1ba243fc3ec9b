"""Draws docs/images/node-red-mqtt.png and node-red-rtdb.png: the example flows in Node-RED's editor, a process done.

It needs Chromium and what tests/system/test_node_red.py needs, and looks at the real thing: Node-RED, mosquitto or a
database, `maya coms`, `maya up`.
"""

from __future__ import annotations

import asyncio
import base64
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.system.brokers import broker  # noqa: E402 - the path comes first
from tests.system.processes import Process, running  # noqa: E402
from tests.system.rtdb.server import realtime_database  # noqa: E402
from tests.system.test_coms import call, coms, url_in  # noqa: E402
from tests.system.test_coms_rtdb import coms as coms_of_database  # noqa: E402
from tests.system.test_node_red import UP, NodeRed, flow, flow_of_database, node_red  # noqa: E402

IMAGES = ROOT / "docs" / "images"
WIDTH, HEIGHT = 1280, 690
PATIENCE = 60.0
"""For the browser [s]."""

SHOWN = """(() => {
    const shown = document.querySelectorAll('.red-ui-flow-node').length > 10
        && document.body.textContent.includes('3 of 3 steps done');
    if (!shown || window.tidy) return shown && window.tidy > 20;
    RED.actions.invoke('core:toggle-palette', false);
    RED.actions.invoke('core:show-debug-tab');
    document.querySelectorAll('.red-ui-notification').forEach((one) => one.remove());
    window.tidy = 1;
    (function wait() { window.tidy += 1; requestAnimationFrame(wait); })();
})()"""
"""True when the flow, what its nodes show, and the debug sidebar are drawn."""


def main() -> int:
    """Draw both pictures."""
    with tempfile.TemporaryDirectory() as folder, running(UP) as up:
        place, rosbridge = Path(folder), url_in(up.until("ws://"))
        (place / "red").mkdir()
        with broker(place) as one:
            link = coms(one, rosbridge)
            _draw("node-red-mqtt.png", place / "red", link, lambda url: flow(one.port, url))
        with realtime_database() as database:
            link = coms_of_database(database, rosbridge)
            signs_in = "lab@example.org"
            _draw(
                "node-red-rtdb.png",
                place / "red",
                link,
                lambda url: flow_of_database(database, url).replace(signs_in, ""),
            )
    return 0


def _draw(name: str, folder: Path, link: Process, flow_with: Callable[[str], str]) -> None:
    """Have a flow carry out its example, and keep the picture of the editor."""
    try:
        url = url_in(link.until("http://"))
        with node_red(folder, flow_with(url)) as red:
            _connect(red, url)
            with browser(folder) as port:
                picture = asyncio.run(_seen(port, red))
        (IMAGES / name).write_bytes(picture)
    finally:
        link.kill()


def _connect(red: NodeRed, url: str) -> None:
    """Press the button that connects the robot, and wait until it is connected."""
    red.press("maya.connect")
    while call("GET", url, "/status")["state"] != "connected":
        pass


@contextmanager
def browser(folder: Path) -> Iterator[int]:
    """Run Chromium without a window; yield the port at which it is driven."""
    line = ["chromium-headless-shell", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"]
    line += [f"--user-data-dir={folder / 'browser'}", f"--window-size={WIDTH},{HEIGHT}", "about:blank"]
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        listens = next(words for words in process.stderr if "DevTools listening on" in words)
        yield int(listens.rpartition(":")[2].partition("/")[0])
    finally:
        process.kill()
        process.wait()


async def _seen(port: int, red: NodeRed) -> bytes:
    """Return the picture of the editor after the example, which is begun when the editor is there."""
    targets = await asyncio.to_thread(NodeRed(port).ask, "GET", "/json/list")
    page = next(one for one in targets if one["type"] == "page")
    async with asyncio.timeout(PATIENCE), connect(page["webSocketDebuggerUrl"], max_size=None) as socket:
        driven = Driven(socket)
        size = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
        await driven.do("Emulation.setDeviceMetricsOverride", **size)
        await driven.do("Page.navigate", url=f"http://127.0.0.1:{red.port}/")
        while not await driven.value("document.querySelectorAll('.red-ui-flow-node').length > 10"):
            pass
        await asyncio.to_thread(red.press, "maya.example")
        while not await driven.value(SHOWN):
            pass
        return base64.b64decode((await driven.do("Page.captureScreenshot"))["data"])


class Driven:
    """A page of the browser, driven by its protocol for developers."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._numbers = count(1)

    async def do(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Return what the browser answers."""
        number = next(self._numbers)
        await self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(await self._socket.recv())
            if answer.get("id") == number:
                result: dict[str, Any] = answer["result"]
                return result

    async def value(self, expression: str) -> Any:
        """Return the value of an expression."""
        answer = await self.do("Runtime.evaluate", expression=expression)
        return answer["result"].get("value")


if __name__ == "__main__":
    sys.exit(main())
