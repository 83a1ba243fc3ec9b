"""Subscriptions that last as long as somebody in ROS 2 reads: what nobody reads is not even measured for ROS 2."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from maya_ros.graph.protocol import GraphHandle
from maya_ros.ros2.dds import SampleWriter

LOOK = 0.1
"""Period of the look for readers [s]: they miss the messages of so long."""


class ReaderDemand:
    """Subscriptions, each beside the writer that sends what it hears. `follow` begins and ends them."""

    def __init__(self) -> None:
        self._wanted: list[tuple[SampleWriter, Callable[[], GraphHandle]]] = []
        self._held: dict[SampleWriter, GraphHandle] = {}

    def add(self, writer: SampleWriter, subscribe: Callable[[], GraphHandle]) -> None:
        """Subscribe while somebody reads what `writer` writes."""
        self._wanted.append((writer, subscribe))

    async def follow(self) -> None:
        """Look for readers until cancelled."""
        while True:
            for writer, subscribe in self._wanted:
                if not writer.read:
                    self._drop(writer)
                elif writer not in self._held:
                    self._held[writer] = subscribe()
            await asyncio.sleep(LOOK)

    def close(self) -> None:
        """End all subscriptions."""
        for writer in tuple(self._held):
            self._drop(writer)

    def _drop(self, writer: SampleWriter) -> None:
        held = self._held.pop(writer, None)
        if held is not None:
            held.close()
