"""`maya coms`: connect a robot to its supervisors.

It serves until Ctrl-C or SIGTERM. Started by `maya up`, it is a separate process that ends with `maya up`.
"""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from urllib.parse import urlsplit

from dmc41x3.i18n import translate
from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.settings import OutputSettings
from maya_un.coms import settings as environment
from maya_un.coms.agent import Agent
from maya_un.coms.robot import Rosbridge
from maya_un.coms.selection import transport_of
from maya_un.coms.server import AgentSwitch, serve
from maya_un.config.model import ComsConfig
from maya_un.http import dates
from maya_un.http.sockets import bound_socket

_PATIENCE = 5.0
"""Longest wait for the end of the process [s]."""


@contextmanager
def coms_beside(rosbridge: str, config: ComsConfig, language: str) -> Iterator[None]:
    """Run `maya coms` for the robot behind a rosbridge while the block runs, even if the block raises an error.

    It connects at once if MAYA_COMS_URL names the supervisors' server.
    """
    port = urlsplit(config.server_address).port
    line = ["coms", "--rosbridge", rosbridge, "--name", config.name, "--port", str(80 if port is None else port)]
    line += ["--lang", language]
    if os.environ.get("MAYA_COMS_URL"):
        line.append("--connect")
    process = subprocess.Popen([sys.executable, "-m", "maya_un.cli.parent_watch", *line], stdin=subprocess.PIPE)
    try:
        yield
    finally:
        assert process.stdin is not None
        process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            process.wait(_PATIENCE)
        process.kill()
        process.wait()


def coms(
    settings: OutputSettings,
    *,
    connect: bool,
    url: str | None,
    port: int | None,
    rosbridge: str | None,
    name: str | None,
) -> int:
    """Serve; options override the environment, which overrides the configuration.

    Raises `AddressInUse`, `InvalidValue` for an invalid setting, and `FileUnreadable` and `InvalidConfig` if the name
    is in neither of the first two.
    """
    found = environment.from_environment()
    if name is None and not os.environ.get("NAME"):
        name = configuration(settings).coms.name
    wanted = {"supervisors": url, "port": port, "rosbridge": rosbridge, "name": name}
    found = replace(found, **{key: value for key, value in wanted.items() if value is not None})
    with bound_socket(found.port) as listener:
        asyncio.run(_serve(found, listener, settings.language, connect=connect))
    return output.DONE


async def _serve(found: environment.AgentSettings, listener: socket.socket, language: str, *, connect: bool) -> None:
    def agent() -> Agent:
        robot = Rosbridge(found.rosbridge, environment.plain_token("MAYA_TOKEN", found.token), found.namespace)
        return Agent(found.name, robot, transport_of(found), dates.now)

    warning = environment.password_warning(found, language)
    if warning is not None:
        print(f"maya: {warning}", file=sys.stderr, flush=True)
    switch = AgentSwitch(agent, found.name, password_in_clear=warning is not None)
    if connect:
        switch.connect()
    host, port = listener.getsockname()[:2]
    url = f"http://{host}:{port}"
    output.say(translate("Listening at {url}: POST /connect, POST /disconnect, GET /status.", language, url=url))
    await serve(switch, listener)
