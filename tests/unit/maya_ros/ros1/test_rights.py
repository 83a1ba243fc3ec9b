"""The rights of a graph, by the users that another process keeps in a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from dmc41x3.loops import run
from maya_ros.ros1 import rights
from maya_ros.ros1.rights import TOKEN_FILE, FolderTokenChecker, GraphRights, token_of_graph
from maya_un.config.state_folder import queue_file, state_folder
from maya_un.errors import FileUnreadable, MayaError
from maya_un.service.access import callers
from maya_un.service.access.callers import Hasher
from maya_un.service.access.operations import ROS, RULES, STOPPING, Caller, Operation, Role
from maya_un.service.access.users import Change, FileStore, Token, User
from tests.virtual_time import turn

SHOWN = callers.PresentedToken("0123abcd", "f" * 48)
TODAY = "2026-11-21T16:02:21+00:00"
HASHED = Hasher(memory=8, passes=1).hash_now(SHOWN.secret)


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "state"))
    (tmp_path / "state").mkdir()


async def keep(change: Change) -> None:
    """Write a change as the process does that keeps the users."""
    store = FileStore(queue_file())
    await store.load()
    await store.apply(change)
    await store.close()


def somebody(role: Role, expires: str = "") -> Change:
    """Return what makes somebody of a role be kept, whose token is `SHOWN`."""
    token = Token(SHOWN.id, "bench", HASHED, "", TODAY, expires)
    return Change(users=(User("bench", role, TODAY),), tokens=(token,))


def code_of(of: GraphRights, operation: Operation) -> int:
    try:
        of.permit(operation)
    except MayaError as refusal:
        return refusal.code
    return 0


async def seen(token: str = SHOWN.text) -> GraphRights:
    """Return the rights of a graph as a node finds them at its start."""
    users = FolderTokenChecker(1.0)
    await users.open()
    found = GraphRights(users.callers, token)
    await found.look()
    return found


def test_graph_may_everything_while_no_users_are_kept() -> None:
    async def main() -> None:
        found = await seen("")
        assert {code_of(found, one) for one in Operation} == {0}
        assert await found.who() == ROS

    run(main())


@pytest.mark.parametrize("token", ["", f"maya_0123abcd_{'0' * 48}", "nonsense"])
def test_graph_without_a_valid_token_stops_and_nothing_else(token: str) -> None:
    async def main() -> None:
        await keep(somebody(Role.ADMIN))
        found = await seen(token)
        assert {one for one in Operation if code_of(found, one) == 0} == STOPPING
        assert {code_of(found, one) for one in Operation} == {0, 4101}
        assert await found.who() == Caller("ros", Role.VIEWER, "ros")

    run(main())


@pytest.mark.parametrize("role", list(Role))
def test_graph_has_the_role_of_its_token_and_drives_as_an_operator(role: Role) -> None:
    async def main() -> None:
        await keep(somebody(role))
        found = await seen()
        for operation, rule in RULES.items():
            least = max(rule.role, Role.OPERATOR) if rule.drives else rule.role
            assert code_of(found, operation) == (0 if role >= least or operation in STOPPING else 4102), operation
        who = await found.who()
        assert (who.name, who.role, who.implicit, who.source) == ("bench", role, role >= Role.OPERATOR, "ros")

    run(main())


def test_expired_token_is_invalid() -> None:
    async def main() -> None:
        await keep(somebody(Role.ADMIN, expires="2001-01-01T00:00:00+00:00"))
        assert code_of(await seen(), Operation.COMMAND) == 4101

    run(main())


def test_users_are_looked_at_again_as_they_change(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rights, "LOOK_AGAIN", 0.01)
    monkeypatch.setenv(TOKEN_FILE, str(state_folder() / "token"))
    (state_folder() / "token").touch(mode=0o600)
    (state_folder() / "token").write_text(SHOWN.text)

    async def main() -> None:
        async with rights.rights_of_node(1.0) as found:
            for change, code in (
                (somebody(Role.ADMIN), 0),
                (Change(users=(User("bench", Role.VIEWER, TODAY),)), 4102),
                (somebody(Role.OPERATOR), 0),
                (Change(without_tokens=(SHOWN.id,)), 4101),
            ):
                await keep(change)
                while (code_of(found, Operation.RECOVER), found_kept(found)) != (code, True):
                    await turn()

    run(main())


def found_kept(of: GraphRights) -> bool:
    """Tell whether the graph knows that users are kept."""
    return of._callers.kept


@pytest.mark.parametrize(("mode", "text"), [(0o644, SHOWN.text), (0o600, "")])
def test_token_file_readable_by_others_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int, text: str
) -> None:
    file = tmp_path / "token"
    monkeypatch.setenv(TOKEN_FILE, str(file))
    with pytest.raises(FileUnreadable):
        token_of_graph()
    file.write_text(text)
    file.chmod(mode)
    with pytest.raises(FileUnreadable, match="chmod 600"):
        token_of_graph()
    monkeypatch.delenv(TOKEN_FILE)
    assert token_of_graph() == ""
