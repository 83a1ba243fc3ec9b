"""Writes the goldens of tests/goldens: everything outside the code that users and other programs rely on.

A golden is a frozen copy. With --check it writes nothing, prints how each one differs, and returns 1 if one does. A
difference is either an improvement, which CHANGELOG.md lists, or a defect.
"""

from __future__ import annotations

import asyncio
import json
import re
import sys
from collections.abc import Callable, Iterator
from difflib import unified_diff
from functools import partial
from pathlib import Path
from typing import Any, cast

import client_page
import typer

from dmc41x3.i18n import LANGUAGES
from maya_ros.graph import types
from maya_ros.graph.table import TABLE, Kind
from maya_un.cli.app import app
from maya_un.cli.configure import parts_of
from maya_un.cli.help import OVERVIEW, QUICK, quick_help
from maya_un.cli.settings import OutputSettings
from maya_un.config import Config
from maya_un.errors import by_code
from maya_un.events import DECLARED
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.openapi import document
from maya_un.process.process import Process
from maya_un.process.spec.job import load_job
from maya_un.robot.robot import MayaRobot
from maya_un.testing import Rig, rig, run_virtual

ROOT = Path(__file__).resolve().parent.parent
GOLDENS = ROOT / "tests" / "goldens"
EXAMPLES = ("01_pick_and_place", "02_sort_grid", "05_pallet")
MOST_LINES = 40
"""Lines of a difference that are shown."""

_LEFT_OUT = re.compile(r"MG|QR\b|\\?TC1$|maya(who\d|pid|beat)")
"""Commands that only ask, and those that tell the controller which process this is."""


def main(arguments: list[str]) -> int:
    """Write or check all goldens."""
    found = {name: render() for name, render in RENDERED.items()}
    if "--check" not in arguments:
        for name, text in found.items():
            (GOLDENS / name).write_text(text, encoding="utf-8")
        return 0
    differences = [difference for name, text in found.items() if (difference := different(name, text))]
    print("\n".join(differences), end="")
    return 1 if differences else 0


def different(name: str, text: str) -> str:
    """Return how a golden differs from what it should be, "" if it does not."""
    golden = (GOLDENS / name).read_text(encoding="utf-8").splitlines()
    lines = list(unified_diff(golden, text.splitlines(), f"tests/goldens/{name}", "now", lineterm="", n=1))
    return "\n".join([*lines[:MOST_LINES], *[f"… {len(lines)} lines in all"] * (len(lines) > MOST_LINES), ""])


def as_json(data: object) -> str:
    """Return data as JSON text in a fixed order."""
    return json.dumps(data, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def openapi() -> str:
    """Return the document of the HTTP interface, one line for each operation and each schema."""
    served = create_app(Bridge(cast("asyncio.AbstractEventLoop", None), cast("Any", None)))
    data = json.loads(json.dumps(document(served)))
    lines = {f"{path} {method}": one for path, methods in data["paths"].items() for method, one in methods.items()}
    lines |= {f"{kind} {name}": one for kind, named in data["components"].items() for name, one in named.items()}
    lines |= {key: one for key, one in data.items() if key not in {"paths", "components"}}
    return "".join(f"{key}: {json.dumps(lines[key], sort_keys=True, ensure_ascii=False)}\n" for key in sorted(lines))


def helps() -> str:
    """Return the help of every command, each as it is on a terminal of 100 columns."""
    pages = dict(commands(typer.main.get_command(app), ("maya",)))
    pages |= {"maya": OVERVIEW} | {f"maya {name}": quick_help(name) for name in QUICK}
    return "".join(f"$ {name} --help\n{pages[name].rstrip()}\n\n" for name in sorted(pages))


def commands(command: Any, path: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Return the help of a command and of those below it."""
    context = command.make_context(path[-1], [], resilient_parsing=True)
    context.info_name = " ".join(path)
    context.terminal_width = 100
    yield " ".join(path), command.get_help(context)
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below, (*path, name))


def sentences() -> str:
    """Return every sentence of errors and events in every language."""
    declared = {"errors": by_code().items(), "events": DECLARED.items()}
    return as_json(
        {
            f"{kind}.{language}": {key: one.template(language) for key, one in items}
            for kind, items in declared.items()
            for language in LANGUAGES
        }
    )


def graph() -> str:
    """Return the rows of the ROS graph, and text and md5 of every type in it."""
    rows = [f"{row.form.name.lower()} {row.name} {row.type}" for row in TABLE]
    kinds = sorted({row.type for row in TABLE if row.form is Kind.TOPIC})
    actions = sorted({row.type for row in TABLE if row.form is Kind.ACTION})
    kinds += [f"{action}{part}" for action in actions for part in ("Goal", "Result", "Feedback")]
    services = sorted({row.type for row in TABLE if row.form is Kind.SERVICE})
    return as_json(
        {
            "rows": rows,
            "messages": {kind: [types.md5sum(kind), types.text(kind)] for kind in kinds},
            "services": {kind: [types.service_md5sum(kind), types.service_text(kind)] for kind in services},
        }
    )


def wire(name: str) -> str:
    """Return what an example sends to the controller, homing included; see `_LEFT_OUT`."""
    sent = run_virtual(_carried_out(ROOT / "examples" / f"{name}.yaml"))
    text = sent.decode("latin-1")
    token = re.search(r"_ZAB=(\d{3,})", text)
    text = text.replace(token[1], "TOKEN") if token else text
    lines = (line.strip() for line in re.split(r"[\r;]", text))
    return "".join(f"{line}\n" for line in lines if line and not _LEFT_OUT.match(line))


async def _carried_out(path: Path) -> bytes:
    job, config = load_job(path), Config()
    async with rig(config, parts=parts_of(job, config, OutputSettings())) as bench:
        return await _sent(bench, Process(MayaRobot(bench.controller, config), bench.controller, config), job)


async def _sent(bench: Rig, process: Process, job: Any) -> bytes:
    try:
        await bench.controller.home()
        await process.result(await process.submit(job))
        return bytes(bench.sent)
    finally:
        await process.close()


RENDERED: dict[str, Callable[[], str]] = {
    "openapi.txt": openapi,
    "help.txt": helps,
    "python-client.md": client_page.page,
    "sentences.json": sentences,
    "graph.json": graph,
    **{f"wire-{name}.txt": partial(wire, name) for name in EXAMPLES},
}

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
