"""`maya fk|ik|reach`: kinematics without a connection to the machine.

They import nothing heavy if the manual's constants apply (no file changes them) and the place is reachable.
"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING

from dmc41x3.i18n import translate, translate_phrase
from maya_un import runtime
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import OutputUnits, units_of
from maya_un.errors import MayaError
from maya_un.kinematics.limits import NAMES
from maya_un.kinematics.ranges import Ranges
from maya_un.manual import default_path
from maya_un.quantities import joints_of, point_of
from maya_un.values import Joints, Point

if TYPE_CHECKING:
    from maya_un.config import Config
    from maya_un.kinematics.workspace import Workspace
    from maya_un.schema.previews import Distance, Reach

_PATIENCE = 1.0
"""Longest wait for the configuration of the running robot [s]."""


FINER = 2
"""More digits than usual: these are results of a calculation."""


def answer(command: str, arguments: list[str], settings: OutputSettings) -> int:
    """Carry out `fk`, `ik` or `reach` with three arguments; raises their errors, and `InvalidValue`."""
    if command == "fk":
        return fk(joints_of(*arguments), settings)
    return {"ik": ik, "reach": reach}[command](point_of(*arguments), settings)


def fk(joints: Joints, settings: OutputSettings) -> int:
    """Print the gripper point [m] of `joints` (rad, m, m); raises `Unreachable`."""
    point = _fk(joints, settings)
    return output.answer(point._asdict(), units_of(settings).point(point, FINER), settings)


def _fk(joints: Joints, settings: OutputSettings) -> Point:
    ranges = _manual(settings)
    if ranges is not None and ranges.within(joints):
        return ranges.mechanism.fk(joints)
    from maya_un.cli.configure import configuration

    config = configuration(settings)
    ranges = Ranges.configured(config)
    quick = not config.zones and ranges.within(joints)
    return ranges.mechanism.fk(joints) if quick else _workspace(config).fk(joints)


def ik(point: Point, settings: OutputSettings) -> int:
    """Print the joints (rad, m, m) for the gripper at `point` [m]; raises `Unreachable`."""
    joints = _ik(point, settings)
    return output.answer(joints._asdict(), units_of(settings).joints(joints, FINER), settings)


def _ik(point: Point, settings: OutputSettings) -> Joints:
    found = _by_the_manual(point, settings)
    return _workspace(_in_force(settings)).require(point) if found is None else found[1]


def reach(point: Point, settings: OutputSettings) -> int:
    """Print whether `point` [m] is reachable, with all margins, or else the violated limits and the nearest point.

    The zones are those of the running robot, else of the configuration. The exit code is 0 if the point is reachable,
    else 1; both are valid results.
    """
    found = _reach(point, settings)
    joints = None if found.joints is None else found.joints._asdict()
    nearest = None if found.nearest is None else found.nearest._asdict()
    value = {**asdict(found), "joints": joints, "nearest": nearest}
    output.answer(value, _reach_text(found, settings.language, units_of(settings)), settings)
    return output.DONE if found.reachable else output.FAILED


def _manual(settings: OutputSettings) -> Ranges | None:
    """Return the ranges of the manual's machine, None if a configuration may change them."""
    if settings.config is not None or os.environ.get("MAYA_CONFIG") or default_path().exists():
        return None
    return Ranges.of_the_manual()


def _reach(point: Point, settings: OutputSettings) -> Reach:
    quick = _by_the_manual(point, settings)
    if quick is not None:
        from maya_un.service.margins import reached

        return reached(*quick, point)
    from maya_un.service.reachability import reach_of

    return reach_of(_workspace(_in_force(settings)), point)


def _by_the_manual(point: Point, settings: OutputSettings) -> tuple[Ranges, Joints] | None:
    """Return the ranges of the manual's machine, and the joints of a reachable point [m].

    None if a configuration or a running robot may change the ranges, or if the point is not reachable.
    """
    ranges = _manual(settings) if runtime.find() is None else None
    if ranges is not None:
        with suppress(MayaError):
            joints = ranges.mechanism.ik(point)
            if ranges.within(joints):
                return ranges, joints
    return None


def _workspace(config: Config) -> Workspace:
    """Return the whole workspace; its module imports slowly."""
    from maya_un.kinematics.workspace import Workspace

    return Workspace.of(config)


def _in_force(settings: OutputSettings) -> Config:
    """Return the configuration of the running robot, with its zones; without a robot, that of the file.

    A file named by --config is used in any case; the default file is used if the robot does not answer.
    """
    from maya_un.cli.configure import configuration
    from maya_un.config import Config

    if settings.config is None:
        from maya_un.cli.client import ServiceClient
        from maya_un.client import requests

        with suppress(MayaError):
            return Config.model_validate(ServiceClient.find(_PATIENCE).ask(requests.config()))
    return configuration(settings)


def _reach_text(found: Reach, language: str, units: OutputUnits) -> str:
    if found.joints is None or found.tensions is None:
        nearest = (
            translate("none: the zones cover the whole workspace", language)
            if found.nearest is None
            else units.point(found.nearest, FINER)
        )
        reason = translate_phrase(found.reason or "", language)
        lines = [translate("not reachable: {reason}; nearest {nearest}", language, reason=reason, nearest=nearest)]
        for one in found.broken[1:]:
            lines.append(translate("also: {reason}", language, reason=translate_phrase(one.text, language)))
        return "\n".join(lines)
    from maya_un.cli.report import table

    lines = [f"{translate('reachable', language)}: {units.joints(found.joints, FINER)}"]
    lines.append(
        translate(
            "line b carries {b:.3f} × load, line c {c:.3f} × load", language, b=found.tensions[0], c=found.tensions[1]
        )
    )
    rows = [(_limit_text(one, language), _margin_text(one, language, units)) for one in found.margins]
    return "\n".join(
        [*lines, "", table((translate("limit", language), translate("margin", language)), rows, right=(1,))]
    )


def _limit_text(distance: Distance, language: str) -> str:
    return translate(NAMES[distance.limit], language, zone=distance.zone)


def _margin_text(distance: Distance, language: str, units: OutputUnits) -> str:
    match distance.unit:
        case "rad":
            return units.angle(distance.margin, finer=1)
        case "load":
            return translate("{loads:.3f} × load", language, loads=distance.margin)
        case _:
            return units.length(distance.margin)
