"""A twin of one's own: the whole stack with its service, in a process that ends with this one."""

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

from maya_un.client.jobs import JobBuilder, JobLike, body_of
from maya_un.client.transport import ServiceAddress
from maya_un.errors import InternalError, from_notice

FAST = 50.0
"""How many times as fast as the machine a twin runs where nothing is said."""

PATIENCE = 30.0
"""A twin that is asked to end and is not over after so long is killed [s]."""


class TwinProcess:
    """`maya up` on a twin, in a process of its own that ends with this one, however this one ends.

    The configuration and the taught places are copies of this user's, so that the twin is what the robot is and
    nothing of his is changed. Queue and history are empty, and gone afterwards. `table` is a job whose parts stand on
    the table, or the parts by name: x, y and perhaps z [m]. `speed` is how many times as fast as the machine it runs,
    `seed` draws where it powers up.
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
        """The number of its process."""
        return self._process.pid

    def close(self) -> None:
        """End the twin and forget its files; once is enough."""
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
        """Copy the configuration in force, and the taught places beside it; return where the copy is."""
        from maya_un.config import default_path  # noqa: PLC0415 - only a twin of one's own needs the configuration

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
        """Return the URL that it prints once it is ready; raises why it could not start."""
        assert self._process.stdout is not None
        said = ""
        for line in self._process.stdout:
            said += line
            with suppress(ValueError):
                found = cast("dict[str, Any]", json.loads(said))
                if "url" in found:
                    return str(found["url"])
                raise from_notice(int(found["error"]["code"]), dict(found["error"]["details"]))
        raise InternalError(reason=f"the twin ended before it was ready: {said.strip()[-200:]}")


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
