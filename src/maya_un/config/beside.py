"""The sections of what runs beside the motion: supervisors, camera, recordings and stored queue."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from maya_un.config.base import ConfigSection
from maya_un.namespace import robot_name

RobotName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,64}$")]
"""A name that every transport can carry."""


class ComsConfig(ConfigSection):
    """The link to supervisors. A step that names another robot is refused."""

    name: RobotName = Field(
        default_factory=robot_name,
        description="name of the robot for its supervisors; default: MAYA; in the ROS namespace maya2, MAYA2",
    )
    server_address: Annotated[
        str,
        Field(pattern=r"^https?://[^\s/]+$", description="address of `maya coms` (COMS_SERVER_ADDRESS in the manual)"),
    ] = "http://localhost:3000"


class CameraConfig(ConfigSection):
    """The camera that the dashboard shows."""

    url: Annotated[
        str,
        Field(
            pattern=r"^(https?://[A-Za-z0-9.:\[\]-]+(/[A-Za-z0-9._~%!$&()*+,;=:@/?-]*)?)?$",
            max_length=500,
            description="address of the camera's picture, http or https; default: none",
        ),
    ] = ""
    kind: Annotated[
        Literal["stream", "snapshot"],
        Field(description="stream: the address sends picture after picture (MJPEG); snapshot: it sends one picture"),
    ] = "stream"


class RecorderConfig(ConfigSection):
    """The flight recorder: how much of the past it holds in memory, and how many recordings stay on the disk."""

    enabled: Annotated[bool, Field(description="record the last minutes in memory, and save them after a fault")] = True
    seconds: Annotated[float, Field(ge=20.0, le=86_400.0, description="duration that memory holds [s]")] = 600.0
    megabytes: Annotated[
        int, Field(ge=1, le=1024, description="limit of memory; above it, the oldest data is removed [MB]")
    ] = 40
    after: Annotated[float, Field(ge=0.0, le=60.0, description="delay between a fault and the saving [s]")] = 5.0
    files: Annotated[
        int, Field(ge=1, le=10_000, description="limit of recordings; above it, the oldest is removed")
    ] = 50
    disk_megabytes: Annotated[
        int,
        Field(ge=1, le=1_000_000, description="limit of disk space; above it, the oldest recording is removed [MB]"),
    ] = 500


class StorageConfig(ConfigSection):
    """Limits for events and audit entries in the file of the queue; jobs are never removed."""

    events: Annotated[
        int, Field(ge=1000, le=10_000_000, description="limit of events; above it, the oldest are removed")
    ] = 200_000
    audit: Annotated[
        int, Field(ge=1000, le=10_000_000, description="limit of audit entries; above it, the oldest are removed")
    ] = 100_000
    days: Annotated[
        int,
        Field(
            ge=1, le=36_500, description="remove events and audit entries that are this many days older than the newest"
        ),
    ] = 365
