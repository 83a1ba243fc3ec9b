"""Selection of the transport for a URL."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from dmc41x3.i18n import phrase
from maya_un.coms.settings import AgentSettings, plain_token, where_of
from maya_un.coms.transport import SupervisorTransport
from maya_un.errors import InvalidValue

if TYPE_CHECKING:
    from maya_un.coms.database import TokenSource
    from maya_un.coms.mqtt import Broker


def transport_of(settings: AgentSettings) -> SupervisorTransport:
    """Return the transport to the supervisors; raises `InvalidValue` for a URL without a transport."""
    scheme = _scheme(settings.supervisors)
    if scheme in {"mqtt", "mqtts"}:
        from maya_un.coms.mqtt import Mqtt  # noqa: PLC0415 - each transport imports a library of its own

        return Mqtt(broker_of(settings))
    if scheme in {"http", "https"}:
        from maya_un.coms.rtdb import Rtdb  # noqa: PLC0415

        return Rtdb(settings.supervisors, _tokens_of(settings))
    if scheme == "firestore":
        from maya_un.coms.firestore import Firestore  # noqa: PLC0415

        return Firestore(settings.supervisors, _tokens_of(settings))
    reason = phrase(
        "it must be the address of the supervisors' server, like mqtt://localhost:1883 or https://NAME.firebaseio.com"
    )
    raise InvalidValue(key="MAYA_COMS_URL", value=where_of(settings.supervisors), reason=reason)


def broker_of(settings: AgentSettings, url: str | None = None) -> Broker:
    """Return the MQTT broker at a URL, by default that of the settings; raises `InvalidValue` for any other URL."""
    from maya_un.coms.mqtt import Broker, Credentials  # noqa: PLC0415 - as above

    url = settings.supervisors if url is None else url
    if _scheme(url) not in {"mqtt", "mqtts"}:
        reason = phrase("it must be the address of an MQTT broker, like mqtt://localhost:1883")
        raise InvalidValue(key="MAYA_COMS_URL", value=where_of(url), reason=reason)
    if urlsplit(url).password is not None:  # every user of this computer can see a command line
        reason = phrase("it must hold no password: put that into MAYA_COMS_PASSWORD_FILE")
        raise InvalidValue(key="MAYA_COMS_URL", value=where_of(url), reason=reason)
    shown = Credentials(
        settings.user, settings.password, settings.authority, settings.certificate, settings.certificate_key
    )
    return Broker(url, shown)


def _tokens_of(settings: AgentSettings) -> TokenSource:
    """Return the credentials for a Firebase database: those of a user, or a token, which is set as the password."""
    from maya_un.coms.database import FirebaseUser, FixedToken  # noqa: PLC0415

    if not settings.user:
        return FixedToken(plain_token("MAYA_COMS_PASSWORD", settings.password))
    if not settings.api_key:
        reason = phrase("MAYA_COMS_USER needs the API key of the Firebase project to sign in")
        raise InvalidValue(key="MAYA_COMS_API_KEY", value="", reason=reason)
    return FirebaseUser(settings.user, settings.password, plain_token("MAYA_COMS_API_KEY", settings.api_key))


def _scheme(url: str) -> str:
    """Return the scheme of a URL with a valid host, "" for anything else."""
    try:
        parts = urlsplit(url)
        is_host = bool((parts.hostname or "").encode("idna"))  # it raises for an empty label or one that is too long
        return parts.scheme if is_host and parts.port != 0 else ""
    except ValueError:
        return ""
