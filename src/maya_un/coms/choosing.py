"""Which transport a URL means."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from maya_un.coms.settings import Settings, where_of
from maya_un.coms.transport import Transport
from maya_un.errors import InvalidValue

if TYPE_CHECKING:
    from maya_un.coms.broker import Broker


def transport_of(settings: Settings) -> Transport:
    """Return the transport to the supervisors; raises `InvalidValue` for a URL that means none."""
    scheme = _scheme(settings.supervisors)
    if scheme in {"mqtt", "mqtts"}:
        from maya_un.coms.mqtt import Mqtt  # noqa: PLC0415 - each transport brings a library of its own

        return Mqtt(broker_of(settings))
    reason = "it must be the address of the supervisors' server, like mqtt://localhost:1883"
    raise InvalidValue(key="MAYA_COMS_URL", value=where_of(settings.supervisors), reason=reason)


def broker_of(settings: Settings, url: str | None = None) -> Broker:
    """Return the MQTT broker at a URL, by default that of the settings; raises `InvalidValue` for one that is none."""
    from maya_un.coms.broker import Broker, Credentials  # noqa: PLC0415 - as above

    url = settings.supervisors if url is None else url
    if _scheme(url) not in {"mqtt", "mqtts"}:
        reason = "it must be the address of an MQTT broker, like mqtt://localhost:1883"
        raise InvalidValue(key="MAYA_COMS_URL", value=where_of(url), reason=reason)
    shown = Credentials(
        settings.user, settings.password, settings.authority, settings.certificate, settings.certificate_key
    )
    return Broker(url, shown)


def _scheme(url: str) -> str:
    """Return the scheme of a URL with a host, "" for anything else."""
    try:
        parts = urlsplit(url)
        return parts.scheme if parts.hostname and parts.port != 0 else ""
    except ValueError:
        return ""
