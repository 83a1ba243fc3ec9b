"""Serve `maya coms` until Ctrl-C or SIGTERM."""

from __future__ import annotations

import asyncio
import socket
import sys
from dataclasses import replace

from maya_un.cli import output
from maya_un.cli.settings import Settings
from maya_un.coms import settings as environment
from maya_un.coms.agent import Agent
from maya_un.coms.choosing import transport_of
from maya_un.coms.robot import Rosbridge
from maya_un.coms.server import Switch, serve
from maya_un.server import dates
from maya_un.server.doors import bound_socket


def coms(
    settings: Settings, *, connect: bool, url: str | None, port: int | None, rosbridge: str | None, name: str | None
) -> int:
    """Serve; options outweigh the environment. Raises `AddressInUse`, and `InvalidValue` for a bad setting."""
    del settings
    found = environment.from_environment()
    wanted = {"supervisors": url, "port": port, "rosbridge": rosbridge, "name": name}
    found = replace(found, **{key: value for key, value in wanted.items() if value is not None})
    with bound_socket(found.port) as door:
        asyncio.run(_serve(found, door, connect=connect))
    return output.DONE


async def _serve(found: environment.Settings, door: socket.socket, *, connect: bool) -> None:
    def agent() -> Agent:
        robot = Rosbridge(found.rosbridge, found.token, found.namespace)
        return Agent(found.name, robot, transport_of(found), dates.now)

    clear = environment.password_in_clear(found)
    if clear:
        where = environment.where_of(found.supervisors)
        warning = f"The password goes to {where} without encryption. Anyone on the network can read it: use mqtts://."
        print(f"maya: {warning}", file=sys.stderr, flush=True)
    switch = Switch(agent, password_in_clear=clear)
    if connect:
        switch.connect()
    host, port = door.getsockname()[:2]
    output.say(f"Listening at http://{host}:{port}: POST /connect, POST /disconnect, GET /status.")
    await serve(switch, door)
