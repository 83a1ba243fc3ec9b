"""A private twin: the whole stack with its service, in a process that ends with this one."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

from dmc41x3.i18n import phrase
from maya_un.client.jobs import JobBuilder, JobLike, body_of
from maya_un.client.transport import ServiceAddress
from maya_un.errors import InternalError, from_notice

FAST = 50.0
"""Default speed of a twin: it runs this many times as fast as the machine."""

PATIENCE = 30.0
"""A twin that has not ended within this time is killed [s]."""


class TwinProcess:
    """`maya up` on a twin, in a separate process that ends with this one, even after a crash.

    The configuration and the taught places are copies of this user's, so the twin matches the robot, and the user's
    files stay unchanged. Queue and history start empty and are deleted at the end. `table` is a job whose parts stand
    on the table; `parts` gives them by name: x, y and perhaps z [m]. The twin runs `speed` times as fast as the
    machine; `seed` determines the position of the robot at power-up.
    """

    def __init__(
        self,
        *,
        speed: float = FAST,
        seed: int = 0,
        table: JobLike | None = None,
        parts: Mapping[str, Sequence[float]] | None = None,
    ) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="maya-twin-"))
        self._over = False
        try:
            self._process = self._started(["--speed", str(speed), "--seed", str(seed), *self._on_table(table, parts)])
            atexit.register(self.close)
            self.service = ServiceAddress(self._announced())
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """The id of the twin's process."""
        return self._process.pid

    def close(self) -> None:
        """End the twin and delete its files; further calls do nothing."""
        if self._over:
            return
        self._over = True
        atexit.unregister(self.close)
        process = getattr(self, "_process", None)
        if process is not None:
            _ended(process)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _started(self, options: list[str]) -> subprocess.Popen[str]:
        config = self._copied()
        arguments = ["up", "--json", "--port", "0", "--config", str(config), *options]
        places = {"MAYA_RUNTIME_DIR": "run", "MAYA_STATE_DIR": "state", "XDG_STATE_HOME": "state"}
        own = {name: str(self._folder / place) for name, place in places.items()}
        return subprocess.Popen(
            [sys.executable, "-m", "maya_un.cli.parent_watch", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, **own},
            start_new_session=True,
        )

    def _copied(self) -> Path:
        """Copy the current configuration and the taught places; return the path of the copied configuration."""
        from maya_un.config import default_path  # noqa: PLC0415 - only a private twin needs the configuration

        named = os.environ.get("MAYA_CONFIG")
        original = Path(named) if named else default_path()
        target = self._folder / "config.toml"
        target.touch()
        for source, copy in ((original, target), (original.with_name("poses.toml"), self._folder / "poses.toml")):
            with suppress(FileNotFoundError):
                shutil.copyfile(source, copy)
        return target

    def _on_table(self, table: JobLike | None, parts: Mapping[str, Sequence[float]] | None) -> list[str]:
        if table is None and not parts:
            return []
        builder = JobBuilder("table").home()
        for name, place in (parts or {}).items():
            builder = builder.part(name, *place)
        body = builder.body() if table is None else body_of(table)
        file = self._folder / "table.json"
        file.write_text(json.dumps(body), encoding="utf-8")
        return ["--table", str(file)]

    def _announced(self) -> str:
        """Return the URL that the twin prints when it is ready; raises the error of its start."""
        assert self._process.stdout is not None
        said = ""
        for line in self._process.stdout:
            said += line
            with suppress(ValueError):
                found = cast("dict[str, Any]", json.loads(said))
                if "url" in found:
                    return str(found["url"])
                raise from_notice(int(found["error"]["code"]), dict(found["error"]["details"]))
        raise InternalError(reason=phrase("the twin ended before it was ready: {output}", output=said.strip()[-200:]))


def _ended(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.close()
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    process.stdout.close()
