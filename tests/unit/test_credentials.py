"""Automatic credentials of a client on this machine."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from maya_un import credentials, runtime

SHOWN = "maya_0123abcd_" + "f" * 48
URL = "http://127.0.0.1:4133"


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.delenv("MAYA_TOKEN", raising=False)
    monkeypatch.delenv("MAYA_TOKEN_FILE", raising=False)
    (tmp_path / "run").mkdir(mode=0o700)


@pytest.fixture
def kept() -> Path:
    place = credentials.token_file()
    place.parent.mkdir(parents=True)
    place.write_text(f"{SHOWN}\n")
    place.chmod(0o600)
    return place


def hold(lease: object) -> None:
    (runtime.folder() / credentials.LEASE_FILE).write_text(json.dumps(lease))


def test_without_credentials_none_are_sent() -> None:
    assert credentials.headers(URL) == {}


def test_the_token_of_the_file_is_shown(kept: Path) -> None:
    assert kept.name == "token"
    assert credentials.headers(URL) == {"Authorization": f"Bearer {SHOWN}"}


def test_variable_takes_precedence_over_the_file_even_if_empty(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_TOKEN", "maya_other")
    assert credentials.token() == "maya_other"
    monkeypatch.setenv("MAYA_TOKEN", "")
    assert credentials.token() == ""
    assert kept.exists()


def test_another_file_may_be_named(kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_TOKEN_FILE", str(tmp_path / "nobody"))
    assert credentials.token() == ""
    assert kept.exists()


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o622])
def test_a_file_that_others_can_read_or_write_is_not_used(kept: Path, mode: int) -> None:
    kept.chmod(mode)
    assert credentials.token() == ""


@pytest.mark.parametrize("text", ["a\r\nHost: evil", "a\nb", "ñ", "\x00", ""])
def test_token_invalid_in_a_header_is_not_sent(kept: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kept.write_text(text, encoding="utf-8")
    assert credentials.token() == ""
    if "\x00" not in text:
        monkeypatch.setenv("MAYA_TOKEN", text)
        assert credentials.token() == ""


def test_without_a_home_there_is_no_token(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("no home")

    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.setattr(Path, "home", homeless)
    assert credentials.token() == ""


def test_a_lease_is_shown_to_the_service_that_gave_it_and_to_no_other() -> None:
    hold({"id": "abc", "url": URL})
    assert credentials.headers(URL) == {"Maya-Lease": "abc"}
    assert credentials.headers("http://127.0.0.1:9") == {}
    credentials.forget("an earlier one")
    assert credentials.headers(URL) == {"Maya-Lease": "abc"}
    credentials.forget("abc")
    assert credentials.headers(URL) == {}
    credentials.forget("abc")


@pytest.mark.parametrize("lease", [None, [], {}, {"id": "abc"}, {"id": "a\nb", "url": URL}, 7])
def test_invalid_lease_is_not_sent(lease: object) -> None:
    hold(lease)
    assert credentials.headers(URL) == {}
