"""The hostile commands of tests/system/coms_hostile.py in Firestore, and those that only it can hold.

Each goes to the server of the tests, and to Google's emulator with the rules of the documentation. The supervisor
speaks plain REST.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any
from urllib.parse import quote

import httpx
import pytest

from maya_un.errors import InvalidMessage, InvalidRequest, InvalidValue, StepExpired, StepNotBegun, UnknownName
from tests.system import coms_hostile
from tests.system.coms_hostile import NEAR, PLACE, below
from tests.system.firestore_emulator import HTTP, RULES, emulator, needs_emulator
from tests.system.processes import Process, running
from tests.system.rtdb.server import realtime_database
from tests.system.test_coms import UP, call, url_in
from tests.system.test_coms_rtdb import admit

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

DOCUMENTS = "projects/demo/databases/(default)/documents"
ROBOT = f"{DOCUMENTS}/robots/MAYA"
OWNER = "owner"
"""The token of somebody above all rules, at an emulator."""


class Typed(dict[str, Any]):
    """A value in the form of Firestore's protocol."""


def at(**x: Any) -> dict[str, Any]:
    """Return a command to go to a place with this x."""
    return {**NEAR, "args": {**PLACE, "x": Typed(x)}}


REFUSED: coms_hostile.Refused = {
    **coms_hostile.REFUSED,
    "nothing": ({}, InvalidRequest.code),
    "no number": (at(doubleValue="NaN"), InvalidValue.code),
    "no limit": (at(doubleValue="-Infinity"), InvalidValue.code),
    "date as x": (at(timestampValue="2001-01-01T00:00:00Z"), InvalidValue.code),
    "place as x": (at(geoPointValue={"latitude": 1.0, "longitude": 2.0}), InvalidValue.code),
    "place as args": ({**NEAR, "args": Typed(geoPointValue={"latitude": 1.0, "longitude": 2.0})}, InvalidRequest.code),
    "bytes as command": ({"command": Typed(bytesValue="aG9tZQ==")}, UnknownName.code),
    "reference as command": ({"command": Typed(referenceValue=f"{ROBOT}/commands/home")}, UnknownName.code),
    "late date": ({**NEAR, "deadline": Typed(timestampValue="2001-01-01T00:00:00.5Z")}, StepExpired.code),
    "odd fields": ({"command": "dance", "a.b": 1, "`": 2, "__a": 3}, UnknownName.code),
    "\u00e4" * 600: ({"command": "dance"}, InvalidRequest.code),
}

TOO_MUCH: coms_hostile.Refused = {
    "10 MB": ({"command": "home", "args": {"x": "x" * 10_000_000}}, InvalidMessage.code),
    "deep": ({"command": "home", "args": below(100)}, InvalidMessage.code),
    "__proto__": ({"command": "dance"}, UnknownName.code),
}
"""Firestore itself refuses these; the server of the tests does not."""


class FirestoreSetup(coms_hostile.DatabaseSetup):
    """Firestore with a robot; `token` is that of a supervisor."""

    def __init__(self, port: int, token: str, link: str, service: str) -> None:
        super().__init__(link, service)
        self._url = f"http://127.0.0.1:{port}/v1/"
        self._token = token

    def write(self, documents: Mapping[str, Any], token: str = "") -> httpx.Response:
        """Replace documents by their path in one commit; None stands for a removal."""
        writes = [_write(f"{DOCUMENTS}/{path}", one) for path, one in documents.items()]
        return self._asked(f"{DOCUMENTS}:commit", {"writes": writes}, token)

    def send_all(self, commands: Mapping[str, Any]) -> None:
        """Write commands, 100 in a commit."""
        left = {f"robots/MAYA/commands/{key}": command for key, command in commands.items()}
        while left:
            answer = self.write({path: left.pop(path) for path in list(left)[:100]})
            assert answer.is_success, answer.text

    def found(self, key: str) -> dict[str, Any] | None:
        """Return the result of a command."""
        answer = self._asked(f"{ROBOT}/results/{quote(key, safe='')}")
        return _data(answer.json()) if answer.is_success else None

    def results(self) -> dict[str, dict[str, Any]]:
        """Return all results."""
        return {one["name"].rpartition("/")[2]: _data(one) for one in self._below("results", 2000)}

    def open(self) -> set[str]:
        """Return the keys of at most 50 open commands."""
        return {one["name"].rpartition("/")[2] for one in self._below("commands", 50)}

    def clear(self) -> None:
        """Remove all results."""
        for key in self.results():
            assert self.write({f"robots/MAYA/results/{key}": None}).is_success

    def _below(self, collection: str, most: int) -> list[dict[str, Any]]:
        query = {"structuredQuery": {"from": [{"collectionId": collection}], "limit": most}}
        return [one["document"] for one in self._asked(f"{ROBOT}:runQuery", query).json() if "document" in one]

    def _asked(self, path: str, body: object = None, token: str = "") -> httpx.Response:
        headers = {"Authorization": f"Bearer {token or self._token}"}
        method = "GET" if body is None else "POST"
        return HTTP.request(method, self._url + path, json=body, headers=headers)


def _write(name: str, data: Any) -> dict[str, Any]:
    return {"delete": name} if data is None else {"update": {"name": name, "fields": _fields(data)}}


def _fields(data: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _value(one) for name, one in data.items()}


def _value(data: Any) -> dict[str, Any]:
    """Return a value in the form of Firestore's protocol."""
    if isinstance(data, Typed):
        return data
    if isinstance(data, dict):
        return {"mapValue": {"fields": _fields(data)}}
    if isinstance(data, list):
        return {"arrayValue": {"values": [_value(one) for one in data]}}
    kinds = {bool: "booleanValue", int: "integerValue", float: "doubleValue", str: "stringValue"}
    return {kinds[type(data)]: data}


def _data(document: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a result; only its warnings and its content are no plain values."""
    return {name: next(iter(value.values())) for name, value in document["fields"].items()}


@pytest.fixture(
    scope="module", params=["server of the tests", pytest.param("emulator", marks=[needs_emulator, pytest.mark.long])]
)
def firestore_setup(request: pytest.FixtureRequest) -> Iterator[FirestoreSetup]:
    with ExitStack() as held:
        database = held.enter_context(realtime_database())
        emulated = request.param == "emulator"
        port = held.enter_context(emulator(RULES)) if emulated else database.port
        up = held.enter_context(running(UP))
        service, rosbridge = url_in(up.until("Service:")), url_in(up.until("ws://"))
        environment = {"FIRESTORE_EMULATOR_HOST": f"127.0.0.1:{port}", **admit(database)}
        link = Process(f"coms --port 0 --url firestore://demo --rosbridge {rosbridge} --connect", env=environment)
        held.callback(link.kill)
        one = FirestoreSetup(port, database.store.sign_in("lab"), url_in(link.until("http://")), service)
        accounts = {"accounts/maya": {"robot": "MAYA"}, "accounts/lab": {"commands": ["MAYA"]}}
        assert one.write({**accounts, "robots/MAYA": {}}, OWNER).is_success
        one.send_all({"home": {"command": "home"}})
        assert one.result("home")["success"]
        yield one


@pytest.mark.waits("about 16 s: the link asks Firestore every 0.5 s, and 33 commands come one after the other")
def test_each_hostile_command_gets_its_refusal(firestore_setup: FirestoreSetup) -> None:
    coms_hostile.require_each_is_refused(firestore_setup, REFUSED)


def test_all_hostile_commands_at_once_get_their_refusals(firestore_setup: FirestoreSetup) -> None:
    coms_hostile.require_all_are_refused(firestore_setup, REFUSED, {})


def test_write_that_firestore_may_refuse_disturbs_nothing(firestore_setup: FirestoreSetup) -> None:
    for key, (command, code) in TOO_MUCH.items():
        if firestore_setup.write({f"robots/MAYA/commands/{key}": command}).is_success:
            assert firestore_setup.result(key)["code"] == str(code), key
    firestore_setup.require_well("after too much")


def test_commands_with_the_longest_keys_do_not_hide_others(firestore_setup: FirestoreSetup) -> None:
    firestore_setup.clear()
    keys = [f"{number:03}{'k' * 1497}" for number in range(640)]  # together over 1 MiB
    assert call("POST", firestore_setup.link, "/disconnect")["state"] == "idle"
    firestore_setup.send_all({key: {"command": "home"} for key in keys})
    assert call("POST", firestore_setup.link, "/connect")["status"] == 200
    assert firestore_setup.result(keys[0])["code"] == str(InvalidRequest.code)
    for part in (keys[:320], keys[320:]):
        assert firestore_setup.write({f"robots/MAYA/commands/{key}": None for key in part}, OWNER).is_success
    firestore_setup.require_well("behind long keys")


@pytest.mark.parametrize("nonsense", [7, "home", ["home", {"a": False}], {"x": True}, Typed(bytesValue="AAAA")])
def test_nonsense_in_other_documents_disturbs_nothing(nonsense: Any, firestore_setup: FirestoreSetup) -> None:
    key = f"after {type(nonsense).__name__}"
    fields = {"state": nonsense, "at": nonsense, "id": nonsense, "default_command": nonsense}
    places = ("", "/state/presence", f"/progress/{key}", f"/progress/{key}/deeper/one", f"/commands/{key}/deeper/one")
    assert firestore_setup.write({f"robots/MAYA{place}": fields for place in places}, OWNER).is_success
    firestore_setup.require_well(key)


@pytest.mark.waits("3 s: twice the time for which no step may come after a stop")
def test_a_command_that_was_there_before_a_stop_does_not_begin_after_it(firestore_setup: FirestoreSetup) -> None:
    firestore_setup.clear()
    firestore_setup.send_all({"first": {**NEAR, "args": {**PLACE, "z": 1.0}}})
    firestore_setup.result("first")
    firestore_setup.send_all({"second": NEAR})
    firestore_setup.stop()
    assert firestore_setup.result("second")["code"] == str(StepNotBegun.code)
    firestore_setup.wait_after_stop()
    firestore_setup.require_well("after the stop")


@pytest.mark.waits("3 s: twice the time for which no step may come after a stop")
@pytest.mark.long  # the Realtime Database has the same test in every run
@pytest.mark.parametrize("firestore_setup", ["server of the tests"], indirect=True)
def test_more_commands_at_once_than_may_wait_delay_no_stop(firestore_setup: FirestoreSetup) -> None:
    coms_hostile.require_no_stop_is_delayed(firestore_setup)
