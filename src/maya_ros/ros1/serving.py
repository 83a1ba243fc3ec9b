"""The endpoint of the node rosbridge: the graph carries out what its clients request as the graph's own user."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from functools import cache, partial

from maya_ros.graph.access import SharedGuest, TokenChecker
from maya_ros.graph.protocol import Graph
from maya_ros.rosbridge.endpoint import Endpoint
from maya_un.client.operations import operations
from maya_un.errors import InvalidValue
from maya_un.http.origins import OriginPolicy, host_of, origin_of
from maya_un.service.access.operations import Operation


@cache
def asked_by_operation() -> Mapping[str, Operation]:
    """Return what each operation of /call_operation asks for, by its name. For a thread: it loads all routes once.

    Of several rights, one of which a route needs, it is the most powerful: the others are to what is one's own.
    """
    from maya_un.http.app import all_routes  # noqa: PLC0415

    rules = {handler.__name__: rule.operations for handler, rule in all_routes().rules.items()}
    found = {name: rules[name if name in rules else name.rpartition("_")[0]] for name in operations()}
    return {name: needed[0] if needed else Operation.READ for name, needed in found.items()}


def edge_of(pages: object) -> OriginPolicy:
    """Return the policy with these pages, one text or a list of texts; raises `InvalidValue`."""
    listed = [pages] if isinstance(pages, str) else pages
    if not isinstance(listed, list) or not all(isinstance(page, str) for page in listed):
        raise InvalidValue(key="origins", value=repr(pages), reason="it must be a text or a list of texts")
    origins = frozenset(map(origin_of, listed))
    return OriginPolicy(hosts=frozenset(map(host_of, origins)), origins=origins)


def endpoint_of(graph: Graph, now: Callable[[], float], edge: OriginPolicy, users: TokenChecker) -> Endpoint:
    """Return the endpoint for all clients of a graph that has one user; see `Endpoint`."""

    async def asked() -> Mapping[str, Operation]:
        return await asyncio.get_running_loop().run_in_executor(None, asked_by_operation)

    return Endpoint(lambda _: nullcontext(graph), now, edge, admission=users, guest=partial(SharedGuest, asked))
