"""The configuration over a graph: the controller's node decides its values, and the layers above wait for them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any

from dmc41x3.address import REAL, SIM
from dmc41x3.address import parse as parse_address
from maya_ros.graph.protocol import ParameterServer
from maya_un.config import Config, load
from maya_un.config.files import parse
from maya_un.errors import InvalidConfig, InvalidValue, MasterGone

CONFIG = "/maya/config"
"""The parameter with the configuration: first the values from a launch file, then all values."""

_LOOK = 0.2
_GIVEN = "/maya/config_given"
_SETTLED = "/maya/config_settled"


async def settle(parameters: ParameterServer) -> Config:
    """Return the user's configuration with the parameters under `CONFIG` laid over it, and write all of it there.

    Only the values that an earlier node had been given are laid over the file, not those that it wrote. Raises
    `InvalidConfig` and `FileUnreadable`.
    """
    given = await parameters.get(CONFIG, {})
    if given and given == await parameters.get(_SETTLED, {}):
        given = await parameters.get(_GIVEN, {})
    if not isinstance(given, Mapping):
        raise InvalidConfig(key=CONFIG, value=given, reason="it is no group of keys")
    config = parse(_laid(_plain(load()), given))
    settled = _plain(config)
    await parameters.set(_GIVEN, given)
    await parameters.set(CONFIG, settled)
    await parameters.set(_SETTLED, settled)
    return config


@asynccontextmanager
async def configured(parameters: ParameterServer) -> AsyncGenerator[Config]:
    """Yield the settled configuration while the block runs; raises as `settle` does."""
    config = await settle(parameters)
    try:
        yield config
    finally:
        with suppress(MasterGone):
            await unsettle(parameters)


async def unsettle(parameters: ParameterServer) -> None:
    """Delete the configuration except the given values; the next node reads the file again."""
    given = await parameters.get(_GIVEN, {})
    for name in (CONFIG, _GIVEN, _SETTLED):
        await parameters.delete(name)
    if given:
        await parameters.set(CONFIG, given)


async def awaited(
    parameters: ParameterServer, *, speed: float = 1.0, waiting: Callable[[], None] | None = None
) -> Config:
    """Return the configuration once the controller's node has settled it; before a wait, call `waiting`.

    `speed` is how fast the loop's clock runs.
    """
    while (found := await settled(parameters)) is None:
        if waiting is not None:
            waiting()
            waiting = None
        await asyncio.sleep(_LOOK * speed)
    return found


async def settled(parameters: ParameterServer) -> Config | None:
    """Return the configuration that the controller's node settled, None before."""
    found = await parameters.get(CONFIG, {})
    return parse(found) if found and found == await parameters.get(_SETTLED, {}) else None


def checked(address: object) -> str:
    """Return a parameter as an address; raises `InvalidValue` if it is none."""
    said = str(address)
    if said not in {SIM, REAL}:
        try:
            parse_address(said)
        except ValueError as error:
            raise InvalidValue(key="address", value=said, reason=str(error)) from None
    return said


def _plain(config: Config) -> dict[str, Any]:
    return config.model_dump(mode="json", exclude_none=True)


def _laid(base: Mapping[str, Any], top: Mapping[str, Any]) -> dict[str, Any]:
    laid = dict(base)
    for key, value in top.items():
        below = laid.get(key)
        laid[key] = _laid(below, value) if isinstance(below, Mapping) and isinstance(value, Mapping) else value
    return laid
