"""Streams of both clients over real websockets, that break, lag, refuse, or are left in the middle."""

from __future__ import annotations

import gc
import json
import ssl
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from dmc41x3.loops import run
from maya_un import AsyncClient, Client
from maya_un.errors import CertificateRefused, NotSignedIn, ServiceNotRunning
from maya_un.values import State, StopReport
from tests.ports import free_port
from tests.unit.client.service_stub import service
from tests.unit.client.test_streaming import event, hello, state

Handler = Callable[[ServerConnection, int], None]


@contextmanager
def stream(handler: Handler, secret: ssl.SSLContext | None = None) -> Iterator[str]:
    """Serve websockets while the block runs; the handler gets the number of the connection, from 0."""
    number = count()

    def handle(socket: ServerConnection) -> None:
        with suppress(ConnectionClosed):
            handler(socket, next(number))

    with serve(handle, "127.0.0.1", 0, compression=None, ssl=secret) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"{'http' if secret is None else 'https'}://127.0.0.1:{server.socket.getsockname()[1]}"
        finally:
            server.shutdown()
            thread.join()


def breaking(socket: ServerConnection, number: int) -> None:
    """Greet, answer with two events behind the one that was asked for, and break the connection without a word."""
    socket.send(hello(last=10))
    since = json.loads(socket.recv())["events"]["since"]
    for seq in (since + 1, since + 2):
        socket.send(event(seq))
    if number < 3:
        socket.socket.close()


def stating(socket: ServerConnection, _number: int) -> None:
    """Greet, and send states for as long as somebody listens."""
    socket.send(hello())
    socket.recv()
    for time in count():
        socket.send(state(float(time)))


def test_events_continue_after_the_last_one_when_the_connection_breaks() -> None:
    async def later(url: str) -> list[int]:
        found: list[int] = []
        async with AsyncClient(url) as client:
            async for one in client.events():
                found.append(one.seq)
                if len(found) == 6:
                    return found
        return found

    with stream(breaking) as url, Client(url) as client:
        events = client.events()
        assert [next(events).seq for _ in range(6)] == [11, 12, 13, 14, 15, 16]
    with stream(breaking) as url:
        assert run(later(url)) == [11, 12, 13, 14, 15, 16]


@pytest.mark.waits("2 s: two clients give a stream 1 s each to close")
def test_a_stream_that_is_left_in_the_middle_leaves_nothing_open() -> None:
    async def later(url: str) -> State:
        async with AsyncClient(url) as client:
            async for one in client.states():
                return one
        raise AssertionError

    with stream(stating) as url:
        with Client(url) as client:
            for one in client.states():
                assert one.homed
                break
        assert run(later(url)).homed
        gc.collect()


def test_a_slow_reader_gets_the_newest_state_and_not_all_of_them() -> None:
    many = threading.Event()

    def hasty(socket: ServerConnection, _number: int) -> None:
        socket.send(hello())
        socket.recv()
        for time in range(100):
            socket.send(state(float(time)))
        many.set()
        socket.recv()

    with stream(hasty) as url, Client(url) as client:
        states = client.states()
        times = [next(states).time]
        assert many.wait(20.0)
        while times[-1] < 99.0:
            times.append(next(states).time)
    assert times == sorted(set(times))
    assert len(times) < 100


def test_the_token_is_shown_and_a_refusal_is_raised_as_it_is() -> None:
    shown: list[str | None] = []

    def refusing(socket: ServerConnection, _number: int) -> None:
        assert socket.request is not None
        shown.append(socket.request.headers.get("Authorization"))
        details = {"code": 4101, "message": "", "details": {"reason": "it has expired"}}
        socket.send(json.dumps({"type": "error", **details}))

    async def later(url: str) -> None:
        async with AsyncClient(url, token="maya_t") as client:
            with pytest.raises(NotSignedIn, match="expired"):
                await anext(client.events())

    with stream(refusing) as url:
        with Client(url, token="maya_t") as client, pytest.raises(NotSignedIn, match="expired"):
            next(client.events())
        run(later(url))
    assert shown == ["Bearer maya_t"] * 2


def test_stream_without_a_server_fails_after_its_timeout() -> None:
    url = f"http://127.0.0.1:{free_port()}"

    async def later() -> None:
        async with AsyncClient(url) as client:
            with pytest.raises(ServiceNotRunning):
                await anext(client.states(patience=0.1))

    with Client(url) as client, pytest.raises(ServiceNotRunning):
        next(client.events(patience=0.1))
    run(later())


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certificate of this machine's own, with its key."""
    place = tmp_path_factory.mktemp("tls") / "both.pem"
    command = (
        "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext subjectAltName=IP:127.0.0.1"
    )
    subprocess.run([*command.split(), "-keyout", place, "-out", f"{place}.crt"], check=True, capture_output=True)
    place.write_bytes(place.read_bytes() + Path(f"{place}.crt").read_bytes())
    return place


@pytest.mark.waits("2 s: two clients give a stream 1 s each to close")
def test_self_signed_certificate_is_trusted_when_named(certificate: Path) -> None:
    secret = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    secret.load_cert_chain(certificate)
    stopping = StopReport(False, 0.0, (0.0, 0.0, 0.0))

    async def later(service: str, stream_url: str) -> None:
        async with AsyncClient(service, ca=certificate) as client:
            assert await client.stop() == stopping
        async with AsyncClient(stream_url, ca=certificate) as client:
            assert (await anext(client.states())).homed

    with service(lambda _: stopping, secret) as stand, stream(stating, secret) as url:
        with Client(stand.url, ca=certificate) as client:
            assert client.stop() == stopping
        with Client(url, ca=certificate) as client:
            assert next(client.states()).homed
        run(later(stand.url, url))
        with Client(stand.url) as client, pytest.raises(CertificateRefused, match="certificate") as refused:
            client.stop()
        assert "maya stop" not in str(refused.value)
        with Client(url) as client, pytest.raises(CertificateRefused, match="certificate"):
            next(client.states())


def test_service_without_tls_does_not_stop_the_robot() -> None:
    with service(lambda _: StopReport(False, 0.0, (0.0, 0.0, 0.0))) as stand:
        secure = stand.url.replace("http:", "https:")
        with Client(secure) as client, pytest.raises(CertificateRefused):
            client.stop()
