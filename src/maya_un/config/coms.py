"""The robot's name for its supervisors, and the address of `maya coms` is."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from maya_un.config.base import ConfigSection
from maya_un.namespace import robot_name

RobotName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,64}$")]
"""A name that every transport can carry."""


class ComsConfig(ConfigSection):
    """The link to supervisors. A step that names another robot is refused."""

    name: RobotName = Field(
        default_factory=robot_name,
        description="the robot's name for its supervisors; by default MAYA, or the ROS namespace in capitals",
    )
    server_address: Annotated[
        str, Field(pattern=r"^https?://[^\s/]+$", description="where `maya coms` is (the manual's COMS_SERVER_ADDRESS)")
    ] = "http://localhost:3000"
