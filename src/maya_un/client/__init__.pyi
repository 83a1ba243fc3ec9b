from maya_un.client.async_client import AsyncClient as AsyncClient
from maya_un.client.client import Client as Client
from maya_un.client.jobs import JobBuilder as JobBuilder
from maya_un.client.pictures import Picture as Picture
from maya_un.client.plans.jobs import StillWaiting as StillWaiting
from maya_un.client.plans.streaming import Event as Event
from maya_un.client.resources import AsyncJobHandle as AsyncJobHandle
from maya_un.client.resources import JobHandle as JobHandle

__all__ = ["AsyncClient", "AsyncJobHandle", "Client", "Event", "JobBuilder", "JobHandle", "Picture", "StillWaiting"]
