"""How much the flight recorder keeps."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from maya_un.config.base import ConfigSection


class RecorderConfig(ConfigSection):
    """The flight recorder: how much of the past it holds in memory, and how many recordings stay on the disk."""

    enabled: Annotated[bool, Field(description="keep the last minutes in memory, and save them after a fault")] = True
    seconds: Annotated[float, Field(ge=20.0, le=86_400.0, description="how much of the past is held [s]")] = 600.0
    megabytes: Annotated[int, Field(ge=1, le=1024, description="memory it may take; the oldest goes first [MB]")] = 40
    after: Annotated[float, Field(ge=0.0, le=60.0, description="after a fault it is saved so much later [s]")] = 5.0
    files: Annotated[int, Field(ge=1, le=10_000, description="recordings kept; the oldest is removed")] = 50
    disk_megabytes: Annotated[int, Field(ge=1, le=1_000_000, description="disk that they may take [MB]")] = 500
