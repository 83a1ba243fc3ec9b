"""Checks of the certificates that other computers see."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Iterable, Iterator
from contextlib import suppress
from datetime import UTC, datetime

from dmc41x3.i18n import phrase
from maya_un.http.doctor.finding import Finding, fail, ok, warn

CERTIFICATE_PATIENCE = 2.0
"""Longest wait for a handshake [s]."""

SOON = 30.0
"""A certificate that ends within this time causes a warning [days]."""

_EXPIRED = 10
"""X509_V_ERR_CERT_HAS_EXPIRED."""


def certificates(ports: Iterable[int]) -> Iterator[Finding]:
    """Check the certificate at each of the ports of this computer that use TLS."""
    for port in sorted(set(ports)):
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
    raise OSError(phrase("the port no longer accepts connections"))
