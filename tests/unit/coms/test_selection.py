"""The transport and its credentials, as the settings of `maya coms` select them."""

from __future__ import annotations

import pytest

from maya_un.coms.database import FixedToken, masked
from maya_un.coms.firestore import Firestore
from maya_un.coms.mqtt import Broker, Credentials
from maya_un.coms.selection import broker_of, transport_of
from maya_un.coms.settings import AgentSettings, plain_token
from maya_un.errors import InvalidValue, MayaError, SupervisorsNotReached


@pytest.mark.parametrize("host", ["lab..local", "a" * 64 + ".lab", ".lab", ""])
@pytest.mark.parametrize("scheme", ["mqtt", "mqtts", "https", "firestore"])
def test_host_that_no_network_can_have_is_refused(scheme: str, host: str) -> None:
    settings = AgentSettings(name="MAYA", supervisors=f"{scheme}://{host}")
    with pytest.raises(InvalidValue, match="MAYA_COMS_URL"):
        transport_of(settings)
    with pytest.raises(InvalidValue, match="MAYA_COMS_URL"):
        broker_of(settings)


@pytest.mark.parametrize(
    "url", ["mqtt://lab.", "mqtt://l\u00e4b", "mqtt://[::1]:1883", "mqtt://a_b", "firestore://demo-1"]
)
def test_host_is_accepted(url: str) -> None:
    assert transport_of(AgentSettings(name="MAYA", supervisors=url)).where == url


def test_token_is_used_without_the_line_end_of_its_file() -> None:
    assert plain_token("MAYA_TOKEN", " secret\n") == "secret"


@pytest.mark.parametrize("token", ["s\u00e4cret", "secret\nX-Other: 1", "secret\udcff"])
@pytest.mark.parametrize("url", ["https://demo.firebaseio.com", "firestore://demo"])
def test_token_that_no_header_can_hold_is_refused_and_not_shown(url: str, token: str) -> None:
    of_user = AgentSettings(name="MAYA", supervisors=url, user="maya@example.org", password="x", api_key=token)
    for settings in (AgentSettings(name="MAYA", supervisors=url, password=token), of_user):
        with pytest.raises(InvalidValue, match=r"MAYA_COMS_\w+ = \*\*\*.* ASCII") as found:
            transport_of(settings)
        assert "cret" not in str(found.value)


@pytest.mark.parametrize("shown", ["a 'b\n", "a%20%27b%0A", r"a 'b\n", 'b"a \'b\\n"'])
def test_secret_is_masked_in_every_form(shown: str) -> None:
    assert "'b" not in masked(f"bad header {shown}.", ("a 'b\n",)).replace("%27", "'")


@pytest.mark.parametrize(("emulator", "token"), [("localhost:80 80", ""), ("127.0.0.1:1", "s\u00e4cret")])
async def test_firestore_that_cannot_be_asked_is_not_reached(
    emulator: str, token: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRESTORE_EMULATOR_HOST", emulator)
    with pytest.raises(SupervisorsNotReached) as found:
        async with Firestore("firestore://demo", FixedToken(token)).connected("MAYA", "journal"):
            pass
    assert "cret" not in str(found.value)


async def test_user_that_cannot_be_encoded_is_not_reached() -> None:
    with pytest.raises(MayaError) as found:
        async with Broker("mqtt://127.0.0.1:1", Credentials(user="l\udcffb", password="secret")).connected("name"):
            pass
    assert (found.type, "secret" in str(found.value)) == (SupervisorsNotReached, False)
