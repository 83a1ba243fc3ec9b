"""The module `gclib` of maya-un, for scripts written for Galil's; put here by `maya dmc gclib`."""

from maya_un.galil.gclib.api import G_BOUNDS, G_DR, G_QR, py
from maya_un.galil.gclib.errors import GclibError
from maya_un.galil.gclib.record import GDataRecord

__all__ = ["G_BOUNDS", "G_DR", "G_QR", "GDataRecord", "GclibError", "py"]
