"""The broker of docs/how-to/supervisors-by-mqtt.md: TLS, users, and a list of who may command which robot."""

from __future__ import annotations

import asyncio
import json
import os
import re
import subprocess
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import pytest

from maya_un.coms.selection import broker_of
from maya_un.coms.settings import from_environment
from maya_un.errors import BrokerRefused, InvalidValue, SupervisorsNotReached
from maya_un.supervisor import Supervisor
from tests.secrecy import secret
from tests.system.brokers import Broker, broker
from tests.system.processes import Process, done
from tests.system.test_coms import call, robot, url_in
from tests.waiting import eventually

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

ROOT = Path(__file__).resolve().parents[2]
FILES = ROOT / "contrib" / "mosquitto"
USERS = {user: secret(f"password of {user}") for user in ("MAYA", "MAYA2", "anna", "wall")}


def made(*line: str | Path) -> None:
    subprocess.run([str(word) for word in line], check=True, capture_output=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an authority, the broker's certificate, that of a client, and the files of passwords."""
    folder = tmp_path_factory.mktemp("rules")
    key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    made("openssl", "req", "-x509", *key, "-subj", "/CN=lab", "-keyout", folder / "ca.key", "-out", folder / "ca.crt")
    for name, subject in (("server", "/CN=127.0.0.1"), ("client", "/CN=anna")):
        request, extra = folder / f"{name}.csr", folder / f"{name}.ext"
        extra.write_text("subjectAltName=IP:127.0.0.1\n")
        made("openssl", "req", *key, "-subj", subject, "-keyout", folder / f"{name}.key", "-out", request)
        made(
            "openssl", "x509", "-req", "-in", request, "-CA", folder / "ca.crt", "-CAkey", folder / "ca.key",
            "-CAcreateserial", "-extfile", extra, "-out", folder / f"{name}.crt",
        )  # fmt: skip
    passwords = folder / "maya.passwd"
    passwords.touch()
    for user, password in USERS.items():
        made("mosquitto_passwd", "-b", passwords, user, password)
        kept = folder / f"{user}.secret"
        kept.write_text(f"{password}\n")
        kept.chmod(0o600)
    return folder


@contextmanager
def ruled(folder: Path, *more: str, rules: Path = FILES / "maya.acl") -> Iterator[Broker]:
    """Run a broker with the configuration of the page, at a port and with files of the test; it begins empty."""
    text = (FILES / "maya.conf").read_text()
    lines = [line for line in text.splitlines() if line.startswith(("cafile", "certfile", "keyfile", "password_file"))]
    lines = [re.sub(r"/etc/mosquitto/(certs/)?", f"{folder}/", line) for line in lines]
    (folder / "mosquitto.db").unlink(missing_ok=True)
    with broker(folder, *lines, f"acl_file {rules}", "allow_anonymous false", *more) as one:
        yield one


def surroundings(broker: Broker, folder: Path, user: str, **more: str) -> dict[str, str]:
    """Return the environment of a user."""
    return {
        "MAYA_COMS_URL": broker.url.replace("mqtt:", "mqtts:"),
        "MAYA_COMS_USER": user,
        "MAYA_COMS_PASSWORD_FILE": str(folder / f"{user}.secret"),
        "MAYA_COMS_CA": str(folder / "ca.crt"),
        **more,
    }


def run_story(story: Callable[[Supervisor], Awaitable[None]], surroundings: dict[str, str]) -> None:
    async def main() -> None:
        async with asyncio.timeout(60.0), Supervisor() as lab:
            await story(lab)

    with mock.patch.dict(os.environ, surroundings):
        asyncio.run(main())


async def nothing(lab: Supervisor) -> None:
    del lab


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_a_supervisor_commands_its_robot_over_tls_and_no_other(folder: Path) -> None:
    with ruled(folder) as one, robot() as rosbridge:
        link = Process(f"coms --port 0 --connect --rosbridge {rosbridge}", env=surroundings(one, folder, "MAYA"))
        other = Process("coms --port 0 --connect --name MAYA2", env=surroundings(one, folder, "MAYA2"))
        anna, wall = surroundings(one, folder, "anna"), surroundings(one, folder, "wall")
        try:
            link.until("http://")
            other.until("http://")
            watching = Process("fleet watch --json", env=wall)
            try:
                watching.until('"robot": "MAYA2"')
                code, said = done("fleet send MAYA home", env=anna)
                assert code == 0, said
                watching.until('"kind": "results"')
            finally:
                watching.kill()
            code, said = done("fleet send MAYA2 home", env=anna)
            assert (code, "1052" in said) == (1, True), said
            code, said = done("fleet send MAYA home", env=wall)
            assert (code, "1052" in said) == (1, True), said
        finally:
            link.kill()
            other.kill()


def test_a_robot_cannot_be_another(folder: Path) -> None:
    with ruled(folder) as one:
        link = Process("coms --port 0 --connect --name MAYA", env=surroundings(one, folder, "MAYA2"))
        try:
            url = url_in(link.until("http://"))
            eventually(
                lambda: "authori" in str(call("GET", url, "/status")["supervisors"]["waits_for"]), "it is refused"
            )
        finally:
            link.kill()

        async def story(lab: Supervisor) -> None:
            assert lab.robots == {}

        run_story(story, surroundings(one, folder, "wall"))


@pytest.mark.parametrize("uncommented", [False, True])
def test_the_dashboard_of_a_robot_sees_steps_of_others_where_the_rules_let_it(folder: Path, uncommented: bool) -> None:
    rules, text = folder / "fleet.acl", (FILES / "maya.acl").read_text()
    rules.write_text(re.sub(r"# (user MAYA\n)# (topic read)", r"\1\2", text) if uncommented else text)
    with ruled(folder, rules=rules) as one:
        other = Process("coms --port 0 --connect --name MAYA2", env=surroundings(one, folder, "MAYA2"))
        seen = [Process("fleet list --follow --json", env=surroundings(one, folder, user)) for user in ("wall", "MAYA")]
        try:
            for display in seen:
                display.until('"MAYA2","state":"idle"')
            asyncio.run(publish(one, folder, "MAYA2", "progress", {"id": "1", "state": "executing", "date": "now"}))
            seen[0].until('"MAYA2","state":"working"')
            other.kill()
            found = seen[1].until('"MAYA2","state":"lost"')
            assert ('"executing"' in found) is uncommented
        finally:
            for process in (other, *seen):
                process.kill()


async def publish(broker: Broker, folder: Path, user: str, kind: str, data: object) -> None:
    """Publish a message on a topic of the robot with the name of the user."""
    with mock.patch.dict(os.environ, surroundings(broker, folder, user)):
        at = broker_of(from_environment())
    async with at.connected(f"test-{user}", session=0) as client:
        await client.publish_checked(f"maya/v1/{user}/{kind}", json.dumps(data))


def test_a_display_says_that_the_broker_refuses_to_show_steps(tmp_path: Path) -> None:
    """The plug-in of mosquitto for dynamic rules refuses subscriptions; the file of rules only drops messages."""
    kinds = ("subscribe", "unsubscribe", "publishClientSend", "publishClientReceive")
    hidden = {"acltype": "subscribePattern", "topic": "maya/v1/+/commands", "priority": 1, "allow": False}
    rules = {
        "defaultACLAccess": dict.fromkeys(kinds, True),
        "roles": [{"rolename": "display", "acls": [hidden]}],
        "groups": [{"groupname": "everybody", "roles": [{"rolename": "display"}]}],
        "anonymousGroup": "everybody",
    }
    (tmp_path / "rules.json").write_text(json.dumps(rules))
    plugin = next(Path("/usr/lib").glob("*/mosquitto_dynamic_security.so"))
    with broker(tmp_path, f"plugin {plugin}", f"plugin_opt_config_file {tmp_path}/rules.json") as one:
        display = Process(f"fleet list --follow --json --url {one.url}")
        try:
            assert '"link":"connected"' in display.until('"refused":true')
        finally:
            display.kill()


def test_a_stranger_is_refused_and_no_secret_is_shown(folder: Path) -> None:
    with ruled(folder) as one:
        mallory = surroundings(one, folder, "anna", MAYA_COMS_USER="mallory")
        with pytest.raises(SupervisorsNotReached, match=r"not authorised|Not authorized") as error:
            run_story(nothing, mallory)
        assert USERS["anna"] not in str(error.value)
        code, said = done("fleet list", env=surroundings(one, folder, "anna", MAYA_COMS_CA=""))
        assert (code, "certificate" in said, USERS["anna"] in said) == (1, True, False)
        with pytest.raises(InvalidValue, match="TLS"):
            run_story(nothing, surroundings(one, folder, "anna", MAYA_COMS_CA=str(folder / "none.crt")))


@pytest.mark.waits("10 s until the MQTT library gives up a connection that the broker has refused")
def test_client_certificate_is_requested(folder: Path) -> None:
    with ruled(folder, "require_certificate true") as one:
        anna = surroundings(one, folder, "anna")
        code, said = done("fleet list", env=anna)
        assert (code, "1051" in said) == (1, True)
        certificate = {"MAYA_COMS_CERT": str(folder / "client.crt"), "MAYA_COMS_KEY": str(folder / "client.key")}
        run_story(nothing, anna | certificate)


@pytest.mark.waits("1 s in which the step of a robot that is not there gets no answer")
def test_a_refused_step_raises_and_the_next_one_is_sent(folder: Path) -> None:
    async def story(lab: Supervisor) -> None:
        with pytest.raises(BrokerRefused):
            await lab.robot("MAYA2").home()
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.0):
                await lab.robot("MAYA").home()  # MAYA is not there
        assert lab.trouble is None

    with ruled(folder) as one:
        run_story(story, surroundings(one, folder, "anna"))


def test_the_page_shows_the_files() -> None:
    page = (ROOT / "docs" / "how-to" / "supervisors-by-mqtt.md").read_text()
    for name in ("maya.conf", "maya.acl"):
        assert (FILES / name).read_text() in page
