"""The module `gclib` of maya-un, for scripts written for Galil's; put here by `maya dmc gclib`."""

from dmc41x3.gclib.api import G_BOUNDS, G_DR, G_QR, GDataRecord, py
from dmc41x3.gclib.errors import GclibError

__all__ = ["G_BOUNDS", "G_DR", "G_QR", "GDataRecord", "GclibError", "py"]
