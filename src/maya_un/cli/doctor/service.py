"""Checks of the running service: its certificate, the robot, the queue and the control lease."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from http.client import HTTPConnection, HTTPException
from typing import Any, cast
from urllib.parse import urlsplit

from maya_un import __version__, runtime
from maya_un.cli.client import ServiceClient
from maya_un.cli.doctor.finding import Finding, fail, ok, skipped, warn
from maya_un.cli.doctor.host import ListeningProcess
from maya_un.client import requests
from maya_un.client.request import Request
from maya_un.errors import MayaError

CERTIFICATE_PATIENCE = 2.0
"""Longest wait for a handshake [s]."""

SOON = 30.0
"""A certificate that ends within this time causes a warning [days]."""

_EXPIRED = 10
"""X509_V_ERR_CERT_HAS_EXPIRED."""


def findings(there: Sequence[ListeningProcess], pid: int) -> Iterator[Finding]:
    """Check every port on which process `pid` listens with TLS."""
    for port in sorted({one.port for one in there if one.pid == pid}):
        shown = _shown(port)
        if shown is not None:
            yield _judged(port, shown)


def _shown(port: int) -> bytes | None:
    """Return the certificate at a port of this computer (DER), None without TLS."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    for host in _addresses():
        try:
            with (
                socket.create_connection((host, port), CERTIFICATE_PATIENCE) as plain,
                context.wrap_socket(plain) as spoken,
            ):
                return spoken.getpeercert(binary_form=True)
        except (OSError, ValueError):
            continue
    return None


def _addresses() -> list[str]:
    """Return addresses of this computer for a listener that serves other computers."""
    found = ["127.0.0.1"]
    with suppress(OSError):
        found += [str(one[4][0]) for one in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)]
    return list(dict.fromkeys(found))


def _judged(port: int, certificate: bytes) -> Finding:
    try:
        until = datetime.fromtimestamp(_end(port, certificate), UTC)
    except ssl.SSLCertVerificationError as error:
        key = "certificate_expired" if error.verify_code == _EXPIRED else "certificate_bad"
        return fail("certificate", key, port=port, reason=error.verify_message)
    except OSError as error:
        return warn("certificate", "certificate_bad", port=port, reason=str(error))
    days = (until - datetime.now(UTC)).total_seconds() / 86_400.0
    found, key = (ok, "certificate_good") if days > SOON else (warn, "certificate_soon")
    return found("certificate", key, port=port, until=until.date().isoformat(), days=days)


def _end(port: int, certificate: bytes) -> float:
    """Return the end of a certificate [s since 1970], by trusting it alone; raises `SSLCertVerificationError`."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    context.load_verify_locations(cadata=certificate)
    for host in _addresses():
        try:
            plain = socket.create_connection((host, port), CERTIFICATE_PATIENCE)
        except OSError:
            continue
        with plain, context.wrap_socket(plain) as spoken:
            found = spoken.getpeercert()
            assert found is not None
            return float(ssl.cert_time_to_seconds(str(found["notAfter"])))
    raise OSError("the port no longer accepts connections")


PATIENCE = 3.0
"""Longest wait for each answer [s]."""


class RunningService:
    """The running service, after it has answered."""

    def __init__(self, running: runtime.Running, client: ServiceClient, language: str) -> None:
        self.running = running
        self._client = client
        self._language = language

    def ask(self, request: Request[Any]) -> dict[str, Any]:
        """Return an answer; raises as `ServiceClient.ask`."""
        answer = self._client.ask(request, timeout=PATIENCE)
        return cast("dict[str, Any]", answer) if isinstance(answer, dict) else {}

    def findings(self) -> Iterator[Finding]:
        """Yield the results of all checks of the service."""
        yield ok("service", "service_runs", pid=self.running.pid, url=self.running.url)
        for look in (self._readiness, self._robot, self._lease, self._queue):
            try:
                yield from look()
            except MayaError as error:
                yield warn("service", "service_refuses", message=error.text(self._language))
                return

    def _readiness(self) -> Iterator[Finding]:
        reasons = _reasons(self.running.url, self._language)
        for reason in reasons:
            yield fail("service", "service_not_ready", message=reason)
        if not reasons:
            yield ok("service", "service_ready")

    def _robot(self) -> Iterator[Finding]:
        status = self.ask(requests.status())
        yield _version(str(status["version"]))
        state, address = status["state"], status["address"]
        if state["mode"] == "disconnected":
            yield fail("robot", "robot_disconnected", address=address)
            return
        if state["fault"] is not None:
            yield fail("robot", "robot_fault", **state["fault"])
        elif not state["homed"]:
            yield warn("robot", "robot_not_homed", address=address)
        else:
            yield ok("robot", "robot_well", address=address, mode=state["mode"])
        yield limits(state["forward_limit"], state["reverse_limit"])

    def _lease(self) -> Iterator[Finding]:
        lease = self.ask(requests.lease())
        if lease["holder"]:
            yield ok("lease", "lease_held", holder=lease["holder"], since=float(lease["since"]))
        else:
            yield ok("lease", "lease_free")

    def _queue(self) -> Iterator[Finding]:
        queue = self.ask(requests.queue())
        if queue["recovery"] is not None:
            yield warn("queue", "queue_asks", job=queue["recovery"]["job"])
        elif queue["mode"] == "paused":
            waiting = queue["counts"].get("queued", 0)
            yield warn("queue", "queue_paused", reason=queue["reason"], waiting=waiting)
        else:
            yield ok("queue", "queue_runs")


def limits(forward: list[bool], reverse: list[bool]) -> Finding:
    """Return the result for active switches."""
    both = [axis for axis, plus, minus in zip("abc", forward, reverse, strict=True) if plus and minus]
    if both:
        return fail("limits", "limits_both", axes=", ".join(both))
    sides = ((forward, "+"), (reverse, "−"))
    names = [axis + sign for side, sign in sides for axis, active in zip("abc", side, strict=True) if active]
    if names:
        return warn("limits", "limits_active", names=" ".join(names))
    return ok("limits", "limits_quiet")


def found(language: str) -> tuple[RunningService | None, list[Finding]]:
    """Return the running service, or the reason why it cannot be checked."""
    running = runtime.find()
    if running is None:
        return None, [skipped("service", "service_none")]
    try:
        client = ServiceClient(running.url, PATIENCE)
        ours = _marked(client)
    except MayaError:
        return None, [fail("service", "service_gone", pid=running.pid, url=running.url)]
    except (OSError, HTTPException) as error:
        if isinstance(error, ConnectionRefusedError):
            return None, [fail("service", "service_gone", pid=running.pid, url=running.url)]
        reason = str(error) or type(error).__name__
        return None, [fail("service", "service_hangs", pid=running.pid, url=running.url, reason=reason)]
    if not ours:
        return None, [fail("service", "service_stranger", url=running.url)]
    return RunningService(running, client, language), []


def _marked(client: ServiceClient) -> bool:
    """Return whether the answer comes from Maya: every answer of Maya has the header `Maya`."""
    connection = HTTPConnection(client.host, client.port, timeout=PATIENCE)
    try:
        connection.request("GET", requests.health().path)
        return connection.getresponse().headers["Maya"] is not None
    finally:
        connection.close()


def _reasons(url: str, language: str) -> list[str]:
    """Return the reasons why commands are refused, as text."""
    import json

    place = urlsplit(url)
    connection = HTTPConnection(place.hostname or "127.0.0.1", place.port or 80, timeout=PATIENCE)
    with suppress(OSError, HTTPException, ValueError, KeyError, TypeError):
        connection.request("GET", requests.ready().path, headers={"Accept-Language": language})
        found = json.loads(connection.getresponse().read())
        connection.close()
        return [str(reason["message"]) for reason in found["reasons"]]
    connection.close()
    return []


def _version(of_service: str) -> Finding:
    if of_service == __version__:
        return ok("version", "version_same", version=__version__)
    return warn("version", "version_differs", own=__version__, version=of_service)
