"""Paths of the files of this package that are not code."""

from __future__ import annotations

from pathlib import Path


def resource(name: str) -> Path:
    """Return the path of a file in `resource`, for the package in its source or installed."""
    return _folder("resource") / name


def perspective() -> Path:
    """Return the path of the perspective that rqt is opened with."""
    return _folder("rqt_config") / "maya_tools.perspective"


def _folder(name: str) -> Path:
    beside = Path(__file__).resolve().parents[2] / name
    if beside.is_dir():
        return beside
    import rospkg  # noqa: PLC0415 - only needed for the installed package, which has ROS

    return Path(rospkg.RosPack().get_path("maya_ui")) / name
