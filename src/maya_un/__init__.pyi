from maya_un.client import AsyncClient as AsyncClient
from maya_un.client import Client as Client
from maya_un.client import JobBuilder as JobBuilder

__version__: str
