"""Settings of `maya coms` from its environment and its options.

The manual names PORT, IP and NAME. A password or token is in a file or in the environment, never in a displayed URL:
`where_of` removes the part before the @ and the part after the question mark.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit, urlunsplit

from dmc41x3.i18n import phrase, translate
from maya_un.credentials import kept_in
from maya_un.errors import InvalidValue
from maya_un.namespace import robot_name

PORT = 3000
ROSBRIDGE = "ws://localhost:9090"


@dataclass(frozen=True, slots=True)
class AgentSettings:
    """Addresses of the server, of the robot's rosbridge and of its supervisors, and the robot's name.

    `supervisors` is a URL, "" if none is set: mqtt://, mqtts://, that of a Realtime Database (http:// or https://), or
    firestore://. The agent sends `user` and `password`, or a client certificate with its key, to this server, and
    `token` to the rosbridge. `authority` is a file with the certificates that sign the server's certificate, "" for
    those of the system. `api_key` belongs to the Firebase project where `user` signs in.
    """

    port: int = PORT
    rosbridge: str = ROSBRIDGE
    name: str = field(default_factory=robot_name)
    supervisors: str = ""
    namespace: str = ""
    user: str = ""
    password: str = ""
    token: str = ""
    authority: str = ""
    certificate: str = ""
    certificate_key: str = ""
    api_key: str = ""


def from_environment(environment: Mapping[str, str] = os.environ) -> AgentSettings:
    """Return the settings from the environment; raises `InvalidValue` for an invalid one."""
    password = environment.get("MAYA_COMS_PASSWORD", "")
    named = environment.get("MAYA_COMS_PASSWORD_FILE")
    if named:
        password = _secret("MAYA_COMS_PASSWORD_FILE", Path(named))
    return AgentSettings(
        port=_port(environment.get("PORT", str(PORT))),
        rosbridge=environment.get("IP") or ROSBRIDGE,
        name=environment.get("NAME") or robot_name(),
        supervisors=environment.get("MAYA_COMS_URL", ""),
        namespace=environment.get("MAYA_COMS_NAMESPACE", ""),
        user=environment.get("MAYA_COMS_USER", ""),
        password=password,
        token=environment.get("MAYA_TOKEN", ""),
        authority=environment.get("MAYA_COMS_CA", ""),
        certificate=environment.get("MAYA_COMS_CERT", ""),
        certificate_key=environment.get("MAYA_COMS_KEY", ""),
        api_key=environment.get("MAYA_COMS_API_KEY", ""),
    )


def password_warning(settings: AgentSettings, language: str = "en") -> str | None:
    """Return a warning if the password goes to the supervisors' server unencrypted over a network, else None."""
    parts = urlsplit(settings.supervisors)
    near = parts.hostname in {"localhost", "::1"} or (parts.hostname or "").startswith("127.")
    if not settings.password or parts.scheme not in {"mqtt", "http"} or near:
        return None
    return translate(
        "The password goes to {address} without encryption. Anyone on the network can read it: use mqtts://.",
        language,
        address=where_of(settings.supervisors),
    )


def plain_token(key: str, text: str) -> str:
    """Return a token without blanks around it; raises `InvalidValue` for one that no header can hold."""
    token = text.strip()
    if token.isascii() and token.isprintable():
        return token
    raise InvalidValue(key=key, value="***", reason="it must be printable ASCII, without spaces around it")


def where_of(url: str) -> str:
    """Return a URL without user, password, query and fragment; "" for an invalid URL."""
    try:
        parts = urlsplit(url)
    except ValueError:
        return ""
    return urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2], query="", fragment=""))


def _port(text: str) -> int:
    if text.isascii() and text.isdigit() and int(text) <= 65_535:
        return int(text)
    raise InvalidValue(key="PORT", value=text[:20], reason="it must be a port, 0 to 65535")


def _secret(key: str, place: Path) -> str:
    found = kept_in(place)
    if not found:
        reason = phrase("it must be a file of yours with one line that others cannot read (chmod 600)")
        raise InvalidValue(key=key, value=str(place), reason=reason)
    return found
