"""`maya lease` and `maya user`, with a service that stores its requests."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.loops import run
from maya_un import credentials, runtime
from maya_un.cli.access import files, lease
from maya_un.cli.access.users import reset
from maya_un.cli.main import main
from maya_un.cli.settings import OutputSettings
from maya_un.config.state_folder import queue_file
from maya_un.errors import LeaseLost
from maya_un.process.journal import file
from maya_un.runtime import Running
from maya_un.schema.encoding import to_data
from maya_un.schema.people import LeaseTaken, LeaseView, Me, NewToken, TokenLine, UserLine
from maya_un.service.access.operations import Role
from maya_un.service.access.users import Change, FileStore, User
from tests.unit.cli.servers import http_service

NOBODY = LeaseView("", "", 0.0, "", False, None, None, None, False)
OLGA = LeaseView("olga", "10.0.0.3", 130.0, "aligning", False, 7.6, "sam", "tom", True)
TOKEN = "maya_0123abcd_" + "f" * 48
OLD = "maya_89abcdef_" + "0" * 48
DAY = "2026-11-21T16:02:21+00:00"


class Kept:
    """Requests to the service, and its answers, by method and path."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, str, Any]] = []
        self.answers: dict[str, object] = {
            "GET /v1/me": Me("root", "admin", "0123abcd", "127.0.0.1", True),
            "GET /v1/lease": NOBODY,
            "POST /v1/lease": LeaseTaken("secret", "root", "", 10.0),
        }
        self.lost = 0

    def says(self, method: str, path: str, body: Any) -> tuple[int, object]:
        self.asked.append((method, path, body))
        if path == "/v1/lease/renew":
            self.lost -= 1
            if self.lost < 0:
                problem = LeaseLost(reason="broken")
                return 409, {"code": problem.code, "details": problem.details}
            return 200, to_data(OLGA)
        answer = self.answers[f"{method} {path}"]
        return 200, [to_data(one) for one in answer] if isinstance(answer, list) else to_data(answer)


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> Iterator[Kept]:
    found = Kept()
    with http_service(found.says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        yield found


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "own"))
    return queue_file()


def printed(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    capsys.readouterr()
    assert main(line.split()[1:]) == code
    out, err = capsys.readouterr()
    return out + err


def users_in(path: Path) -> tuple[list[User], dict[str, list[str]]]:
    """Return the users in a file, and the ids of their tokens."""

    async def read() -> tuple[list[User], dict[str, list[str]]]:
        store = FileStore(path)
        users, tokens = await store.load()
        await store.close()
        return users, {user.name: [token.id for token in tokens if token.user == user.name] for user in users}

    return run(read())


def test_current_driver_is_shown(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    assert printed("maya lease", capsys) == "Nobody drives. `maya lease take` takes the lease.\n"
    kept.answers["GET /v1/lease"] = OLGA
    assert printed("maya lease", capsys).splitlines() == [
        "olga has been driving for 2 min (10.0.0.3): aligning.",
        "You hold this lease, on this machine.",
        "It ends in 8 s unless it is renewed.",
        "It is offered to sam.",
        "tom would like to drive.",
    ]
    assert "olga conduce desde hace 2 min" in printed("maya lease --lang es", capsys)
    assert json.loads(printed("maya lease --json", capsys))["asked_by"] == "tom"


def test_a_lease_for_a_time_is_kept_and_shown_and_given_back(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    answer = json.loads(printed("maya lease take --for 10min --note aligning --json", capsys))
    assert "id" not in answer
    assert kept.asked[-1] == ("POST", "/v1/lease", {"note": "aligning", "patience": 600.0})
    place = runtime.folder() / credentials.LEASE_FILE
    assert place.stat().st_mode & 0o777 == 0o600
    held = credentials.held()
    assert held is not None
    assert (held.id, credentials.headers(held.url)["Maya-Lease"]) == ("secret", "secret")
    kept.answers["DELETE /v1/lease"] = NOBODY
    assert printed("maya lease release", capsys) == "You gave the lease back. Nobody drives now.\n"
    assert credentials.held() is None


def test_lost_lease_is_reported_and_forgotten(
    kept: Kept, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lease, "HEARTBEAT", 0.001)
    kept.lost = 3
    text = printed("maya lease take --force", capsys, code=2)
    assert text.startswith(
        "You drive now. Ctrl-C gives the lease back.\nmaya: error 4105: Your control lease has ended (broken)"
    )
    assert [path for _, path, _ in kept.asked] == ["/v1/lease"] + ["/v1/lease/renew"] * 4
    assert kept.asked[0][2] == {"force": True}
    assert credentials.held() is None


def test_lease_is_offered_and_requested(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    kept.answers["POST /v1/lease/offer"] = kept.answers["POST /v1/lease/ask"] = OLGA
    assert "You offered the lease to sam" in printed("maya lease offer sam", capsys)
    assert kept.asked[-1][2] == {"to": "sam"}
    assert printed("maya lease ask", capsys) == "You asked for the lease. olga sees the request.\n"
    kept.answers["POST /v1/lease/ask"] = NOBODY
    assert "operators see the request" in printed("maya lease ask", capsys)


@pytest.mark.parametrize("text", ["soon", "10", "-5min", "1e9d"])
def test_durations_have_units(text: str, kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    code = 0 if text in {"10", "-5min", "1e9d"} else 2  # the service bounds it
    printed(f"maya lease take --for {text}", capsys, code=code)


def test_the_first_administrator_is_this_user(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    kept.answers["GET /v1/me"] = Me("local", "admin", "", "127.0.0.1", False)
    kept.answers["POST /v1/users"] = NewToken("0123abcd", "root", "admin", TOKEN, "first", "")
    assert "No users exist" in printed("maya user", capsys)
    text = printed("maya user add root --role admin", capsys)
    assert text.splitlines()[:2] == ["root is admin now.", TOKEN]
    assert "This token is stored in" in text
    assert credentials.token() == TOKEN
    assert credentials.token_file().stat().st_mode & 0o777 == 0o600


def test_the_tokens_of_others_are_shown_and_not_kept(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    kept.answers["POST /v1/users"] = NewToken("0123abcd", "sam", "student", TOKEN, "first", "")
    assert TOKEN in printed("maya user add sam", capsys)
    assert kept.asked[-1][2] == {"name": "sam", "role": "student"}
    assert credentials.token() == ""


def test_users_and_tokens_are_listed(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    kept.answers["GET /v1/users"] = []
    assert "No users exist" in printed("maya user list", capsys)
    kept.answers["GET /v1/users"] = [UserLine("sam", "student", DAY, True, 2, DAY)]
    assert printed("maya user list", capsys).splitlines()[1].split() == [
        "sam", "student", "2026-11-21", "yes", "2", "2026-11-21", "16:02",
    ]  # fmt: skip
    kept.answers["GET /v1/users/root/tokens"] = [TokenLine("0a", "root", "10.0.0.1", DAY, DAY, "", True, False)]
    assert "session 10.0.0.1" in printed("maya user tokens", capsys)
    kept.answers["GET /v1/users/root/tokens"] = []
    assert printed("maya user tokens", capsys) == "root has no tokens.\n"
    assert printed("maya user", capsys) == "You are root (admin), by token 0123abcd, from 127.0.0.1.\n"


def test_token_lasts_for_the_given_time(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    kept.answers["POST /v1/users/root/tokens"] = NewToken("0a", "root", "admin", TOKEN, "", "")
    printed("maya user token --expires 2099-01-31 --note notebook", capsys)
    assert kept.asked[-1][2] == {"note": "notebook", "expires": "2099-01-31"}
    printed("maya user token --for 30d", capsys)
    left = datetime.fromisoformat(kept.asked[-1][2]["expires"]) - datetime.now(UTC)
    assert timedelta(days=29, hours=23) < left <= timedelta(days=30)
    assert "error 4008" in printed("maya user token --for 30d --expires 2099-01-31", capsys, code=2)
    assert "error 4001" in printed("maya user token --for 1e9d", capsys, code=2)


def test_a_token_is_revoked_by_its_id_or_as_it_is(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    kept.answers["DELETE /v1/tokens/0123abcd"] = {"removed": "0123abcd"}
    for text in ("0123abcd", TOKEN):
        assert printed(f"maya user revoke {text}", capsys) == "Token 0123abcd is no longer valid.\n"


def test_roles_and_removal(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    kept.answers["PATCH /v1/users/sam"] = UserLine("sam", "operator", DAY, False, 1, "")
    assert printed("maya user role sam operator", capsys) == "sam is operator.\n"
    assert kept.asked[-1][2] == {"role": "operator"}
    kept.answers["DELETE /v1/users/sam"] = {"removed": "sam"}
    assert "sam is removed" in printed("maya user remove sam", capsys)
    assert "error 4008" in printed("maya user role sam king", capsys, code=2)


def test_passwords_are_read_from_the_input_and_never_from_the_line(
    kept: Kept, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept.answers["PATCH /v1/users/root"] = UserLine("root", "admin", DAY, True, 1, "")
    monkeypatch.setattr(sys, "stdin", io.StringIO("correct horse battery\n"))
    printed("maya user password", capsys)
    assert kept.asked[-1][2] == {"password": "correct horse battery"}
    kept.answers["GET /v1/me"] = Me("root", "student", "0a", "127.0.0.1", True)
    monkeypatch.setattr(sys, "stdin", io.StringIO("the old one\nthe new one\n"))
    printed("maya user password", capsys)
    assert kept.asked[-1][2] == {"old": "the old one", "password": "the new one"}
    monkeypatch.setattr(sys, "stdin", io.StringIO("the old one\n"))
    printed("maya user password --none", capsys)
    assert kept.asked[-1][2] == {"old": "the old one", "password": ""}


@pytest.mark.parametrize("line", ["maya user password", "maya user add kim --password"])
def test_an_empty_password_is_refused_and_nothing_is_sent(
    line: str, kept: Kept, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    assert "it is empty; --none removes a password" in printed(line, capsys, code=2)
    assert [method for method, *_ in kept.asked if method != "GET"] == []


def test_a_reset_keeps_the_token_private_whatever_file_was_there(state: Path) -> None:
    place = files.keep_token(OLD)
    place.chmod(0o644)
    files.keep_token(TOKEN)
    assert (place.stat().st_mode & 0o777, credentials.token()) == (0o600, TOKEN)


def test_first_user_replaces_an_old_token_and_sets_it_aside(
    kept: Kept, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept.answers["GET /v1/me"] = Me("local", "admin", "", "127.0.0.1", False)
    kept.answers["POST /v1/users"] = NewToken("0123abcd", "root", "admin", TOKEN, "first", "")
    place = files.keep_token(OLD)
    aside = place.with_name("token.old")
    text = printed("maya user add root --role admin", capsys)
    assert credentials.token() == TOKEN
    assert f"The former token is in {aside} now." in text
    assert aside.read_text() == f"{OLD}\n"
    assert aside.stat().st_mode & 0o777 == 0o600
    assert "another token" not in text
    monkeypatch.setenv("MAYA_TOKEN", OLD)
    assert "$MAYA_TOKEN holds another token" in printed("maya user add root --role admin", capsys)
    assert place.read_text() == f"{TOKEN}\n"


def test_refused_token_is_reported_with_its_origin(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(*_: object) -> tuple[int, object]:
        return 401, {"code": 4101, "details": {"reason": "it is wrong"}}

    with http_service(refuses) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        assert "the token shown" not in printed("maya user", capsys, code=2)
        place = files.keep_token(OLD)
        assert f"it is wrong; it comes from {place}" in printed("maya user", capsys, code=2)
        monkeypatch.setenv("MAYA_TOKEN", OLD)
        assert "it comes from $MAYA_TOKEN" in printed("maya user", capsys, code=2)


def test_the_owner_of_the_file_gets_in_again(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first = json.loads(printed("maya user reset root --json", capsys))
    again = json.loads(printed("maya user reset root --json", capsys))
    printed("maya user reset ann", capsys)
    users, tokens = users_in(state)
    assert [(user.name, user.role) for user in users] == [("ann", Role.ADMIN), ("root", Role.ADMIN)]
    assert tokens["root"] == [again["id"]]
    assert first["token"] != again["token"]
    assert credentials.token().startswith(f"maya_{tokens['ann'][0]}_")
    assert state.stat().st_mode & 0o077 == 0
    text = printed("maya user reset --all", capsys)
    assert "are removed" in text
    assert f"Your token in {credentials.token_file()} was one of them" in text
    assert users_in(state) == ([], {})
    assert not credentials.token_file().exists()


@pytest.mark.parametrize("other", [OLD, "no token at all", "\x80"])
def test_reset_all_leaves_a_token_of_another_robot(state: Path, capsys: pytest.CaptureFixture[str], other: str) -> None:
    printed("maya user reset root", capsys)
    credentials.token_file().write_bytes(other.encode("latin-1"))
    assert "was one of them" not in printed("maya user reset --all", capsys)
    assert credentials.token_file().read_bytes() == other.encode("latin-1")


def test_a_reset_keeps_the_password_and_raises_the_role(state: Path) -> None:
    state.parent.mkdir()

    async def fill() -> None:
        store = FileStore(state)
        await store.load()
        await store.apply(Change(users=(User("sam", Role.STUDENT, DAY, "hash"),)))
        await store.close()

    run(fill())
    assert reset("sam", None, OutputSettings(json=True)) == 0
    assert users_in(state)[0] == [User("sam", Role.ADMIN, DAY, "hash")]


def test_the_file_of_the_queue_may_be_another(state: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    named = tmp_path / "other" / "queue.db"
    printed(f"maya user reset ann --journal {named}", capsys)
    assert [user.name for user in users_in(named)[0]] == ["ann"]
    assert not state.exists()


def test_running_service_prevents_a_reset(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    state.parent.mkdir()
    lock = file.JournalLock(state)
    try:
        for request in ("root", "--all"):
            assert "error 5010" in printed(f"maya user reset {request}", capsys, code=2)
    finally:
        lock.release()
    assert not state.exists()
    for request in ("", "root --all", "Root"):
        assert "error 400" in printed(f"maya user reset {request}", capsys, code=2)
