"""The address of the service."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from maya_un import runtime
from maya_un.cli.client import ServiceClient
from maya_un.client.transport import ServiceAddress, finder, trusted
from maya_un.errors import InvalidValue, ServiceNotRunning


@pytest.fixture(autouse=True)
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("MAYA_URL", raising=False)
    monkeypatch.delenv("MAYA_TOKEN", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))


def test_the_running_service_of_this_user_is_found_wherever_it_is_now() -> None:
    find = finder(None, None)
    with pytest.raises(ServiceNotRunning):
        find()
    with runtime.claimed():
        for port in (4133, 4134):
            runtime.publish(runtime.Running(f"http://127.0.0.1:{port}", os.getpid(), None))
            assert find() == ServiceAddress(f"http://127.0.0.1:{port}")


def test_the_address_of_a_service_that_was_killed_gets_no_token() -> None:
    runtime.publish(runtime.Running("http://127.0.0.1:4133", os.getpid(), None))
    assert runtime.find() is not None
    with pytest.raises(ServiceNotRunning):
        finder(None, None)()
    with pytest.raises(ServiceNotRunning):
        ServiceClient.find()
    with runtime.claimed():
        runtime.publish(runtime.Running("http://127.0.0.1:4133", os.getpid() + 1, None))
        with pytest.raises(ServiceNotRunning):
            finder(None, None)()


def test_given_address_takes_precedence_over_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_URL", "http://robot:1/")
    monkeypatch.setenv("MAYA_TOKEN", "maya_env")
    assert finder(None, None)() == ServiceAddress("http://robot:1", "maya_env")
    assert finder("https://other:2", "maya_own")() == ServiceAddress("https://other:2", "maya_own")
    assert finder(None, "")() == ServiceAddress("http://robot:1")


def test_token_of_the_user_and_lease_of_the_shell_are_sent(tmp_path: Path) -> None:
    token = tmp_path / "maya" / "token"
    token.parent.mkdir()
    token.write_text("maya_file\n", encoding="ascii")
    token.chmod(0o600)
    runtime.write("lease.json", {"id": "lease 1", "url": "http://robot:1"})
    assert finder("http://robot:1", None)() == ServiceAddress("http://robot:1", "maya_file", "lease 1")
    assert finder("http://robot:2", None)() == ServiceAddress("http://robot:2", "maya_file")


@pytest.mark.parametrize("url", ["robot:4133", "ftp://robot", "http://", "http://[", "http://robot:x"])
def test_invalid_address_is_refused_at_once(url: str) -> None:
    with pytest.raises(InvalidValue, match="like http"):
        finder(url, None)


def test_a_certificate_is_read_from_its_file(tmp_path: Path) -> None:
    with pytest.raises(InvalidValue, match="No such file"):
        trusted(tmp_path / "ca.pem")
    (tmp_path / "bad.pem").write_text("no certificate", encoding="utf-8")
    with pytest.raises(InvalidValue):
        trusted(tmp_path / "bad.pem")
    assert trusted(None).check_hostname
