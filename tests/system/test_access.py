"""A laboratory's day by the commands that people type, with a robot that runs in a process of its own."""

from __future__ import annotations

import json
import signal

import pytest

from maya_un import credentials
from tests.system.processes import CALM, done, running

pytestmark = pytest.mark.system

UP = f"up --port 0 --speed 50 {CALM}"


class Shell:
    """Somebody's terminal: his token, and nothing else of his."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, token: str | None) -> None:
        self._monkeypatch = monkeypatch
        self._token = token

    def __call__(self, line: str, code: int = 0) -> str:
        """Type a command and return its output."""
        if self._token is None:
            self._monkeypatch.delenv("MAYA_TOKEN", raising=False)
        else:
            self._monkeypatch.setenv("MAYA_TOKEN", self._token)
        found, text = done(line)
        assert found == code, text
        return text

    def token_of(self, line: str) -> str:
        """Type what makes a token and return that."""
        return json.loads(self(f"{line} --json"))["token"]


def test_a_day_of_a_laboratory(monkeypatch: pytest.MonkeyPatch) -> None:
    owner, nobody = Shell(monkeypatch, None), Shell(monkeypatch, "")
    with running(UP) as up:
        up.until("maya home")
        assert "No users exist" in owner("user")
        owner("user add root --role admin")
        assert credentials.token().startswith("maya_")
        olga = Shell(monkeypatch, owner.token_of("user add olga --role operator"))
        sam = Shell(monkeypatch, owner.token_of("user add sam"))
        assert "error 4101" in nobody("status", code=2)
        assert "Nothing was moving" in nobody("stop")
        assert "error 4102" in sam("lease take --for 1min", code=2)
        assert "error 4104" in olga("speed 50%", code=2)
        assert "You drive for" in olga("lease take --for 10min --note aligning")
        assert "olga has been driving for" in sam("lease")
        olga("speed 50%")
        olga("lease offer sam")
        assert "You drive for" in sam("lease take --for 10min")
        sam("speed 100%")
        assert "error 4103" in olga("speed 50%", code=2)
        assert "You drive for" in olga("lease take --force --for 1min")
        up.send(signal.SIGTERM)
        assert up.end()[0] == 0


@pytest.mark.waits("2 s until the next heartbeat of `maya lease take` learns that the lease is lost")
def test_the_heartbeat_is_the_command_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    owner = Shell(monkeypatch, None)
    with running(UP) as up:
        up.until("maya home")
        with running("lease take") as driver:
            driver.until("You drive now")
            assert "You hold this lease, on this machine." in owner("lease")
            driver.send(signal.SIGTERM)
            code, said = driver.end()
            assert (code, "You gave the lease back" in said) == (0, True)
        assert "Nobody drives" in owner("lease")
        with running("lease take") as driver:
            driver.until("You drive now")
            owner("lease take --force --for 1min")
            code, said = driver.end()
            assert (code, "error 4105" in said) == (2, True)
        assert "You hold this lease, on this machine." in owner("lease")
        owner("lease release")


def test_users_outlive_the_robot_and_the_owner_of_its_file_gets_in(monkeypatch: pytest.MonkeyPatch) -> None:
    owner, nobody = Shell(monkeypatch, None), Shell(monkeypatch, "")
    with running(UP) as up:
        up.until("maya home")
        old = Shell(monkeypatch, owner.token_of("user add root --role admin"))
        sam = Shell(monkeypatch, owner.token_of("user add sam"))
        assert "error 5010" in owner("user reset root", code=2)
        up.kill()
    new = Shell(monkeypatch, owner.token_of("user reset root"))
    with running(UP) as up:
        up.until("maya home")
        assert "error 4101" in nobody("user", code=2)
        assert "error 4101" in old("user", code=2)
        assert "You are root (admin)" in new("user")
        assert "You are sam (student)" in sam("user")
        up.send(signal.SIGTERM)
        up.end()
