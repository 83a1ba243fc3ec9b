"""A running Maya from Python, over HTTP and websocket: `maya_un.Client` and `maya_un.AsyncClient`.

Every verb is described once, as a plan (`plans`), and carried out by one of two thin drivers (`blocking`, `awaiting`).
"""

from maya_un.client.async_client import AsyncClient
from maya_un.client.client import Client
from maya_un.client.handle import AsyncJobHandle, JobHandle
from maya_un.client.jobs import JobBuilder
from maya_un.client.pictures import Picture
from maya_un.client.plans.streaming import Event
from maya_un.client.plans.waiting import StillWaiting

__all__ = ["AsyncClient", "AsyncJobHandle", "Client", "Event", "JobBuilder", "JobHandle", "Picture", "StillWaiting"]
