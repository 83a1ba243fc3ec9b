from __future__ import annotations

import socket
from dataclasses import replace

import pytest

from maya_un.cli.service.listeners import PORT, RemoteAccess, host_and_port, require_users
from maya_un.errors import InvalidCommandLine, InvalidValue
from maya_un.http.origins import CLIENTS_EACH, FAR, Rate
from maya_un.http.sockets import ListeningSocket, bound_socket


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("maya", ("maya", PORT)),
        ("0.0.0.0:80", ("0.0.0.0", 80)),
        ("[::]", ("::", PORT)),
        ("[2001:db8::1]:443", ("2001:db8::1", 443)),
    ],
)
def test_listening_addresses(text: str, place: tuple[str, int]) -> None:
    assert host_and_port(text) == place


@pytest.mark.parametrize("text", ["", ":80", "maya:", "maya:x", "maya:70000", "::1", "[::1", "[::1]80", "a:1:2"])
def test_invalid_place_is_refused(text: str) -> None:
    with pytest.raises(InvalidValue):
        host_and_port(text)


def test_other_machines_are_let_in_by_tls_or_by_saying_so() -> None:
    RemoteAccess().check()
    RemoteAccess(listen="maya", plain=True).check()
    RemoteAccess(listen="maya", certificate="c", key="k").check()
    RemoteAccess(origins=["https://panel"]).check()


@pytest.mark.parametrize(
    "remote",
    [
        RemoteAccess(listen="maya"),
        RemoteAccess(listen="maya", certificate="c"),
        RemoteAccess(listen="maya", key="k"),
        RemoteAccess(listen="maya", certificate="c", key="k", plain=True),
        RemoteAccess(plain=True),
        RemoteAccess(certificate="c", key="k"),
    ],
)
def test_conflicting_options_are_refused(remote: RemoteAccess) -> None:
    with pytest.raises(InvalidCommandLine):
        remote.check()


def test_other_machines_need_users() -> None:
    require_users(kept=False, listen=None)
    require_users(kept=True, listen="maya")
    with pytest.raises(InvalidCommandLine, match="maya user add"):
        require_users(kept=False, listen="maya")


def test_error_names_the_given_option() -> None:
    here = socket.gethostname().lower()
    assert RemoteAccess().edge().hosts == frozenset()
    assert not RemoteAccess(origins=["https://panel.example.org"]).edge().remote
    edge = RemoteAccess(listen="Robot.lab:1", plain=True, origins=["https://panel.example.org:8443"]).edge()
    assert edge.remote
    assert edge.hosts == {"robot.lab", "panel.example.org", here, f"{here}.local"}
    assert edge.origins == {"https://panel.example.org:8443"}
    assert "0.0.0.0" not in RemoteAccess(listen="0.0.0.0", plain=True).edge().hosts


def test_limits_of_an_address_grow_with_the_clients_behind_it() -> None:
    usual, crowded = (RemoteAccess(listen="127.0.0.1:0", plain=True, clients=clients) for clients in (16, 32))
    assert usual.edge().far == FAR
    assert usual.edge() == replace(crowded.edge(), far=FAR, readers=CLIENTS_EACH)
    assert crowded.edge().far == Rate(2 * FAR.per_second, 2 * FAR.burst)
    assert crowded.edge().readers == 32
    listeners = [access.listener() for access in (usual, crowded)]
    for listener in listeners:
        assert listener is not None
        listener.socket.close()
    assert [(one.most, one.most_each) for one in listeners if one] == [(256, 32), (416, 192)]


@pytest.mark.parametrize("host", ["192.0.2.7", "maya.lab"])
def test_named_address_is_the_one_for_others(host: str) -> None:
    with _listening() as listener:
        port = listener.getsockname()[1]
        found = RemoteAccess(listen=f"{host}:{port}", plain=True).addresses(ListeningSocket(listener))
    assert found == (f"http://{host}:{port}",)


@pytest.mark.parametrize("anywhere", ["0.0.0.0", "[::]"])
def test_listener_everywhere_has_addresses_that_others_can_use(anywhere: str) -> None:
    with _listening() as listener:
        port = listener.getsockname()[1]
        found = RemoteAccess(listen=anywhere, plain=True).addresses(ListeningSocket(listener))
    assert f"http://{socket.gethostname().lower()}:{port}" in found
    assert not any(host in url for url in found for host in ("0.0.0.0", "[::]"))


def test_without_a_listener_there_is_no_address_for_others() -> None:
    assert RemoteAccess().addresses(None) == ()


def _listening() -> socket.socket:
    return bound_socket(0)
