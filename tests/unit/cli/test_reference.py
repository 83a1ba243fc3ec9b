"""The reference pages name what there is."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import cast

import typer
from fastapi.routing import APIRoute

from maya_un.cli import app
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.service.service import Service

PAGES = Path(__file__).resolve().parents[3] / "docs" / "reference"


def names(commands: typer.Typer) -> set[str]:
    """Return what the commands are called."""
    return {command.name or command.callback.__name__ for command in commands.registered_commands if command.callback}


def test_every_command_is_in_the_reference() -> None:
    page = (PAGES / "command-line.md").read_text(encoding="utf-8")
    missing = {name for name in names(app.app) | {"status", "stop"} if f"| `maya {name}" not in page}
    missing |= {name for name in names(app.dmc_tools) if f"| `maya dmc {name}" not in page}
    missing |= {name for name in names(app.plot) if f"| `maya plot {name}" not in page}
    missing |= {name for name in names(app.config) if name not in page.partition("`maya config ")[2].partition("`")[0]}
    assert missing == set()


def test_every_path_is_in_the_reference() -> None:
    page = (PAGES / "http.md").read_text(encoding="utf-8")
    bridge = Bridge(cast("asyncio.AbstractEventLoop", None), cast("Service", None))
    routes = [route for route in create_app(bridge).routes if isinstance(route, APIRoute)]
    assert len(routes) > 20
    asked = [f"{method} {route.path_format}" for route in routes for method in route.methods or ()]
    assert [request for request in asked if f"`{request}" not in page] == []
