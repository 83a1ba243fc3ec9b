"""The services of rosapi, answered from the graph's directory, parameters and types."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Mapping

from dmc41x3.i18n import phrase
from maya_ros.graph import types
from maya_ros.graph.catalogue import is_base
from maya_ros.graph.protocol import Graph, Message, NodeInfo, Request, by_name, stamp
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.incoming import resolved, type_of
from maya_un.errors import InvalidMessage, InvalidRequest, UnknownInterface

PREFIX = "/rosapi/"
NODE = "/rosapi"
"""The node name under which the endpoint serves these services."""

HOST = "127.0.0.1"
"""The machine that serves them: the endpoint listens on the loopback only."""

Question = Callable[[Request], Awaitable[Message]]

Answer = Callable[[Message], Awaitable[Message]]

_ACTION = ("/goal", "/cancel", "/status", "/feedback", "/result")


class Rosapi:
    """Answers questions about a `graph`; `now` returns the date [s since the epoch]."""

    def __init__(self, graph: Graph, now: Callable[[], float]) -> None:
        self._graph = graph
        self._now = now
        asked: dict[str, tuple[str, Answer]] = {
            "topics": ("Topics", self._topics),
            "topic_type": ("TopicType", self._topic_type),
            "topics_for_type": ("TopicsForType", self._topics_for_type),
            "topics_and_raw_types": ("TopicsAndRawTypes", self._topics_and_raw_types),
            "services": ("Services", self._services),
            "service_type": ("ServiceType", self._service_type),
            "services_for_type": ("ServicesForType", self._services_for_type),
            "service_node": ("ServiceNode", self._service_node),
            "service_host": ("ServiceHost", self._service_host),
            "service_providers": ("ServiceProviders", self._service_providers),
            "service_request_details": ("ServiceRequestDetails", self._request_details),
            "service_response_details": ("ServiceResponseDetails", self._response_details),
            "message_details": ("MessageDetails", self._message_details),
            "nodes": ("Nodes", self._nodes),
            "node_details": ("NodeDetails", self._node_details),
            "publishers": ("Publishers", self._publishers),
            "subscribers": ("Subscribers", self._subscribers),
            "action_servers": ("GetActionServers", self._action_servers),
            "get_param": ("GetParam", self._get_param),
            "set_param": ("SetParam", self._set_param),
            "has_param": ("HasParam", self._has_param),
            "search_param": ("SearchParam", self._search_param),
            "delete_param": ("DeleteParam", self._delete_param),
            "get_param_names": ("GetParamNames", self._get_param_names),
            "get_time": ("GetTime", self._get_time),
        }
        self._asked = {PREFIX + name: (f"rosapi/{kind}", answer) for name, (kind, answer) in asked.items()}

    def question(self, service: str) -> Question | None:
        """Return the handler of a rosapi service, None for other services; it raises the errors of a request."""
        found = self._asked.get(service)
        if found is None:
            return None
        kind, answer = found
        request, _ = types.halves(kind)

        async def asked(arguments: Request) -> Message:
            named = by_name(request, types.fields(request), arguments)
            return await answer(types.conform(request, named, stamp=stamp(self._now())))

        return asked

    async def _topics(self, _: Message) -> Message:
        found = await self._graph.directory.topics()
        return {"topics": list(found), "types": list(found.values())}

    async def _topic_type(self, request: Message) -> Message:
        found = await self._graph.directory.topics()
        return {"type": found.get(_whole(request["topic"]), "")}

    async def _topics_for_type(self, request: Message) -> Message:
        kind = _kind(request["type"])
        found = await self._graph.directory.topics()
        return {"topics": [topic for topic, one in found.items() if one == kind]}

    async def _topics_and_raw_types(self, _: Message) -> Message:
        found = await self._graph.directory.topics()
        texts = [types.text(kind) if types.known(kind) else "" for kind in found.values()]
        return {"topics": list(found), "types": list(found.values()), "typedefs_full_text": texts}

    async def _all_services(self) -> Mapping[str, str]:
        ours = {name: kind for name, (kind, _) in self._asked.items()}
        return {**await self._graph.directory.services(), **ours}

    async def _services(self, _: Message) -> Message:
        return {"services": list(dict.fromkeys([*await self._graph.directory.service_names(), *self._asked]))}

    async def _service_type(self, request: Message) -> Message:
        service = _whole(request["service"])
        ours = self._asked.get(service)
        return {"type": await self._graph.directory.service_type(service) if ours is None else ours[0]}

    async def _services_for_type(self, request: Message) -> Message:
        kind, found = _kind(request["type"]), await self._all_services()
        return {"services": [service for service, one in found.items() if one == kind]}

    async def _all_nodes(self) -> Mapping[str, NodeInfo]:
        found = dict(await self._graph.directory.nodes())
        return {**found, NODE: NodeInfo(serves=tuple(self._asked))}

    async def _service_node(self, request: Message) -> Message:
        providers = await self._serving(request["service"])
        return {"node": providers[0] if providers else ""}

    async def _service_host(self, request: Message) -> Message:
        service = _whole(request["service"])
        return {"host": HOST if service in self._asked else await self._graph.directory.service_host(service)}

    async def _service_providers(self, request: Message) -> Message:
        """Return the nodes that serve a type, which the field "service" holds; a service is accepted too."""
        service = request["service"]
        providers = await self._serving(service)
        if not providers and not service.startswith("/"):
            kind = _kind(service)
            names = {name for name, one in (await self._all_services()).items() if one == kind}
            providers = [node for node, one in (await self._all_nodes()).items() if names.intersection(one.serves)]
        return {"providers": providers}

    async def _serving(self, service: str) -> list[str]:
        name = _whole(service)
        return [node for node, one in (await self._all_nodes()).items() if name in one.serves]

    async def _request_details(self, request: Message) -> Message:
        return {"typedefs": _details(types.halves(_kind(request["type"]))[0])}

    async def _response_details(self, request: Message) -> Message:
        return {"typedefs": _details(types.halves(_kind(request["type"]))[1])}

    async def _message_details(self, request: Message) -> Message:
        kind = request["type"]
        return {"typedefs": _details(kind if is_base(kind) else _kind(kind))}

    async def _nodes(self, _: Message) -> Message:
        return {"nodes": list(await self._all_nodes())}

    async def _node_details(self, request: Message) -> Message:
        name = _whole(request["node"])
        node = (await self._all_nodes()).get(name)
        if node is None:
            raise UnknownInterface(form="node", name=name)
        return {
            "subscribing": list(node.subscribes),
            "publishing": list(node.publishes),
            "services": list(node.serves),
        }

    async def _publishers(self, request: Message) -> Message:
        name, nodes = _whole(request["topic"]), await self._all_nodes()
        return {"publishers": [node for node, one in nodes.items() if name in one.publishes]}

    async def _subscribers(self, request: Message) -> Message:
        name, nodes = _whole(request["topic"]), await self._all_nodes()
        return {"subscribers": [node for node, one in nodes.items() if name in one.subscribes]}

    async def _action_servers(self, _: Message) -> Message:
        found = await self._graph.directory.topics()
        ends = [topic.removesuffix(_ACTION[0]) for topic in found if topic.endswith(_ACTION[0])]
        return {"action_servers": [one for one in ends if all(one + part in found for part in _ACTION)]}

    async def _get_param(self, request: Message) -> Message:
        missing = object()
        value = await self._graph.parameters.get(_whole(request["name"]), missing)
        return {"value": outgoing.text_of(_default(request["default"]) if value is missing else value)}

    async def _set_param(self, request: Message) -> Message:
        try:
            value = json.loads(request["value"])
        except (ValueError, RecursionError) as error:
            raise InvalidMessage(name="value", reason=phrase("it is not JSON ({error})", error=error)) from error
        await self._graph.parameters.set(_whole(request["name"]), value)
        return {}

    async def _has_param(self, request: Message) -> Message:
        missing = object()
        return {"exists": await self._graph.parameters.get(_whole(request["name"]), missing) is not missing}

    async def _search_param(self, request: Message) -> Message:
        name = _whole(request["name"])
        return {"global_name": name if (await self._has_param(request))["exists"] else ""}

    async def _delete_param(self, request: Message) -> Message:
        name = _whole(request["name"])
        if not (await self._has_param(request))["exists"]:
            raise UnknownInterface(form="parameter", name=name)
        await self._graph.parameters.delete(name)
        return {}

    async def _get_param_names(self, _: Message) -> Message:
        return {"names": list(await self._graph.parameters.names())}

    async def _get_time(self, _: Message) -> Message:
        return {"time": stamp(self._now())}


def _whole(name: str) -> str:
    return resolved(name, "name")


def _kind(text: str) -> str:
    try:
        return type_of(text, "type")
    except InvalidRequest:
        raise UnknownInterface(form="type", name=text) from None


def _details(kind: str) -> list[Message]:
    return list(types.details(kind))


def _default(text: str) -> object:
    """Return the JSON value of a default; a text that is not JSON is the value itself."""
    try:
        return json.loads(text) if text else None
    except (ValueError, RecursionError):
        return text
