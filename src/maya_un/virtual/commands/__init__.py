"""The commands, by what they concern; every module has a `TABLE` of two-letter names and handlers."""

from __future__ import annotations

from maya_un.virtual.commands import (
    array,
    contouring,
    coordinated,
    ethernet,
    gearing,
    hardware,
    inquiry,
    message,
    motion,
    program,
    setting,
    system,
    vector,
)
from maya_un.virtual.context import Handler

TABLE: dict[str, Handler] = {
    **setting.TABLE,
    **motion.TABLE,
    **coordinated.TABLE,
    **vector.TABLE,
    **contouring.TABLE,
    **gearing.TABLE,
    **hardware.TABLE,
    **inquiry.TABLE,
    **system.TABLE,
    **ethernet.TABLE,
    **message.TABLE,
    **array.TABLE,
    **program.TABLE,
}
"""Every command that this controller knows."""
