"""An MQTT broker of the tests: mosquitto on loopback, on a free port that it keeps when it starts again."""

from __future__ import annotations

import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import paho.mqtt.client as mqtt

from tests.ports import free_port


def disconnect(client: mqtt.Client) -> None:
    """Disconnect a client, and end its thread.

    A method of its owner as callback closes a cycle of references. The garbage collector would then finalise paho's
    sockets before paho closes them, and warn of it.
    """
    client.disconnect()
    client.loop_stop()
    client.on_message = client.on_connect = None


class Broker:
    """mosquitto, with what it stores in a folder."""

    def __init__(self, folder: Path, *lines: str) -> None:
        self.port = free_port()
        self.folder = folder
        self._configuration = folder / "mosquitto.conf"
        settings = (
            f"listener {self.port} 127.0.0.1",
            "allow_anonymous true",
            "persistence true",
            f"persistence_location {folder}/",
            "autosave_on_changes true",
            "autosave_interval 1",
            "set_tcp_nodelay true",
            "user root",
            *lines,
        )
        self._configuration.write_text("\n".join(settings) + "\n")
        self._log = folder / "mosquitto.log"
        self._popen: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        """Its address."""
        return f"mqtt://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start it; returns when it listens."""
        with self._log.open("ab") as log:
            self._popen = subprocess.Popen(
                ["/usr/sbin/mosquitto", "-c", str(self._configuration)], stdout=log, stderr=subprocess.STDOUT
            )
        until = time.monotonic() + 30.0
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), timeout=1.0).close()
            except OSError:
                assert time.monotonic() < until and self._popen.poll() is None, self._log.read_text()
            else:
                return

    def signal(self, number: int) -> None:
        """Send it a signal, like SIGSTOP, after which it answers nobody."""
        assert self._popen is not None
        self._popen.send_signal(number)

    def end(self) -> None:
        """End it as a service manager does: it stores what it has."""
        if self._popen is not None:
            self._popen.terminate()
            self._popen.wait(30.0)
            self._popen = None

    def kill(self) -> None:
        """Kill it with -9."""
        if self._popen is not None:
            self._popen.kill()
            self._popen.wait(30.0)
            self._popen = None


@contextmanager
def broker(folder: Path, *lines: str) -> Iterator[Broker]:
    """Run a broker while the block runs."""
    one = Broker(folder, *lines)
    one.start()
    try:
        yield one
    finally:
        one.kill()
