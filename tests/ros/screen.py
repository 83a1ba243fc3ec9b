"""The dashboard in a process of its own, driven by lines of JSON (`dashboard_driver`, in rqt `rqt_driver`)."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

DRIVER = Path(__file__).with_name("dashboard_driver.py")
RQT_DRIVER = Path(__file__).with_name("rqt_driver.py")


class Screen:
    """A dashboard that is looked at and touched; every method returns when it has happened."""

    def __init__(self, python: Path, env: Mapping[str, str], log: Path, *arguments: str, driver: Path = DRIVER) -> None:
        self._log = log.open("ab")
        self._process = subprocess.Popen(
            [python, driver, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "PYTHONDONTWRITEBYTECODE": "1", **env},
            text=True,
        )
        assert self._answer() == "ready"

    def __enter__(self) -> Screen:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        stdout, stdin = self._process.stdout, self._process.stdin
        assert stdin is not None
        assert stdout is not None
        stdin.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            raise
        finally:
            stdout.close()
            self._log.close()

    def kill(self) -> None:
        """End it as a crash does."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._log):
            assert pipe is not None
            pipe.close()

    def ask(self, do: str, **details: Any) -> Any:
        """Have the driver do something and return its answer."""
        stdin = self._process.stdin
        assert stdin is not None
        stdin.write(json.dumps({"do": do, **details}) + "\n")
        stdin.flush()
        answer = self._answer()
        assert not (isinstance(answer, dict) and "error" in answer), answer
        return answer

    def click(self, *names: str) -> None:
        """Click on parts, one after the other."""
        for name in names:
            self.ask("click", name=name)

    def read(self, name: str) -> dict[str, Any]:
        """Return what a part shows."""
        return self.ask("read", name=name)

    def text(self, name: str) -> str:
        """Return the text of a part."""
        return self.read(name)["text"]

    def wait(self, name: str, text: str = "", **wanted: Any) -> dict[str, Any]:
        """Return what a part shows as soon as its text holds `text` and it is as wanted."""
        return self.ask("wait", name=name, text=text, **wanted)

    def tell(self, fact: str, **fields: Any) -> None:
        """Have the stand-in tell a fact."""
        self.ask("tell", fact=fact, **fields)

    def asked(self) -> list[Any]:
        """Return what the stand-in was asked for since this was last called."""
        return self.ask("asked")

    def rows(self, name: str) -> list[Any]:
        """Return the rows of a list."""
        return self.ask("rows", name=name)

    def type(self, **fields: str) -> None:
        """Type into fields: `x="410"`."""
        for axis, text in fields.items():
            self.ask("type", name=f"field_{axis}", text=text)

    def _answer(self) -> Any:
        stdout = self._process.stdout
        assert stdout is not None
        line = stdout.readline()
        assert line, f"the dashboard has ended; see {self._log.name}"
        return json.loads(line)
