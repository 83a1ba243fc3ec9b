"""A homed robot without its homing: the mark that a homing leaves in the controller."""

from __future__ import annotations

from dmc41x3.twin.wire.server import VirtualController
from maya_un.assembly.stack import Stack
from maya_un.config import Config, Units
from maya_un.controller.controller import GalilController
from maya_un.controller.homing import homed_pose
from maya_un.machine.truth import TrueConstants
from maya_un.values import Joints


async def take_over(
    controller: GalilController, virtual: VirtualController, place: Joints, truth: TrueConstants | None = None
) -> None:
    """Leave the mark of a homing that ended at `place`, and take it over: the robot counts as homed, and stays."""
    machine = virtual.machine
    handle = machine.connect()
    assert handle is not None
    for command in mark(controller.config, place, TrueConstants() if truth is None else truth):
        assert b"?" not in machine.receive(handle, f"{command}\r".encode(), machine.now)
    machine.disconnect(handle)
    await controller.skip_home()


async def stand_homed(layers: Stack) -> None:
    """Take over a homing at the place of power-up, move to the pose where a homing ends, and open the gripper.

    For tests of other things: a homing takes 260 s of virtual time, and thirty times the processor time of this.
    """
    twin = layers.twin
    assert twin is not None
    await take_over(layers.controller, twin.controller, Joints(*twin.mechanics.true_joints()), twin.mechanics.truth)
    await layers.controller.move(homed_pose(layers.config))
    await layers.controller.gripper(open_=True)


def mark(config: Config, place: Joints, truth: TrueConstants) -> list[str]:
    """Return the commands with which a homing that ended at `place` leaves its mark."""
    axes, units = config.axes, Units.of(config)
    a, b, c = units.to_counts(place)
    short = units.to_counts(Joints(axes.a.minimum, axes.b.minimum, axes.c.minimum))
    _, long_b, long_c = units.to_counts(Joints(0.0, *(ends[1] for ends in truth.switches[1:])))
    datum = [f"mayamin{name}={count}" for name, count in zip("abc", short, strict=True)]
    return [f"DP {a},{b},{c}", *datum, f"mayaendb={long_b}", f"mayaendc={long_c}", "ZAA=7;mayahome=7"]
