"""Until when certificates are good that a service shows; the system's openssl makes them."""

from __future__ import annotations

import shutil
import socket
import ssl
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from maya_un.http.doctor.certificate import certificates
from maya_un.http.doctor.finding import Finding
from maya_un.schema.diagnosis import FindingOutcome

OPENSSL = shutil.which("openssl")

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="there is no openssl")


def made(folder: Path, days: int) -> ssl.SSLContext:
    """Return the context of a server with a certificate of its own that ends so many days from now."""
    key, shown = folder / "key.pem", folder / "certificate.pem"
    words = f"req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj /CN=maya -days {days}".split()
    command = [str(OPENSSL), *words, "-keyout", str(key), "-out", str(shown)]
    subprocess.run(command, capture_output=True, check=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(shown, key)
    return context


def expired(folder: Path) -> ssl.SSLContext:
    """Return a context whose certificate ended in 2020."""
    key, shown_, request = folder / "old.key", folder / "old.pem", folder / "old.csr"
    words = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj", "/CN=maya"]
    subprocess.run(
        [str(OPENSSL), "req", *words, "-keyout", str(key), "-out", str(request)], capture_output=True, check=True
    )
    dates = ["-startdate", "20190101000000Z", "-enddate", "20200101000000Z"]
    (folder / "index").touch()
    (folder / "serial").write_text("01\n")
    (folder / "ca.cnf").write_text(
        "[ca]\ndefault_ca = own\n[own]\n"
        f"dir = {folder}\ndatabase = {folder}/index\nserial = {folder}/serial\nnew_certs_dir = {folder}\n"
        "default_md = sha256\npolicy = any\n[any]\ncommonName = supplied\n"
    )
    subprocess.run(
        [
            str(OPENSSL),
            *("ca", "-batch", "-selfsign", "-config", str(folder / "ca.cnf"), "-keyfile", str(key)),
            *("-in", str(request), "-out", str(shown_), "-notext", *dates),
        ],
        capture_output=True,
        check=True,
    )
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(shown_, key)
    return context


@contextmanager
def shown(context: ssl.SSLContext | None) -> Iterator[int]:
    """Listen on a port, with TLS or without, while the block runs."""
    over = threading.Event()

    def serve() -> None:
        while not over.is_set():
            connection, _ = listener.accept()
            with connection, suppress(OSError):
                connection.settimeout(2.0)
                if context is None:
                    connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
                    connection.recv(1)
                else:
                    with context.wrap_socket(connection, server_side=True) as spoken:
                        spoken.recv(1)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve)
        thread.start()
        port = listener.getsockname()[1]
        try:
            yield port
        finally:
            over.set()
            socket.create_connection(("127.0.0.1", port)).close()
            thread.join()


def found(port: int) -> list[Finding]:
    return list(certificates([port]))


@pytest.mark.parametrize(
    ("days", "key", "outcome"),
    [(400, "certificate_good", FindingOutcome.OK), (5, "certificate_soon", FindingOutcome.WARN)],
)
def test_a_certificate_is_good_for_long_or_ends_soon(
    tmp_path: Path, days: int, key: str, outcome: FindingOutcome
) -> None:
    with shown(made(tmp_path, days)) as port:
        (finding,) = found(port)
    assert (finding.key, finding.outcome, finding.details["port"]) == (key, outcome, port)
    assert finding.details["days"] == pytest.approx(days, abs=1.0)


def test_one_that_has_expired_fails(tmp_path: Path) -> None:
    with shown(expired(tmp_path)) as port:
        (finding,) = found(port)
    assert (finding.key, finding.outcome) == ("certificate_expired", FindingOutcome.FAIL)


def test_a_port_without_tls_has_none() -> None:
    with shown(None) as port:
        assert found(port) == []
