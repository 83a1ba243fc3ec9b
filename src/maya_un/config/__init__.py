"""Configuration: every constant of the machine as one validated, immutable model.

The defaults are the manual's; a TOML file changes single keys. Units are SI, except registers of the motion
controller, whose names end in `_counts`.
"""

from maya_un.config.files import for_people, load, template, to_toml
from maya_un.config.model import (
    AxisConfig,
    CellConfig,
    Config,
    ControllerConfig,
    Geometry,
    GripperConfig,
    HomingConfig,
    RecorderConfig,
    SafetyConfig,
    Scale,
    StorageConfig,
    WiringConfig,
)
from maya_un.config.units import Units
from maya_un.manual import default_path

__all__ = [
    "AxisConfig",
    "CellConfig",
    "Config",
    "ControllerConfig",
    "Geometry",
    "GripperConfig",
    "HomingConfig",
    "RecorderConfig",
    "SafetyConfig",
    "Scale",
    "StorageConfig",
    "Units",
    "WiringConfig",
    "default_path",
    "for_people",
    "load",
    "template",
    "to_toml",
]
