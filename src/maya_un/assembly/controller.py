"""The controller layer: the only place that chooses between a real controller and the virtual one.

Programs of this layer alone, for example nodes of ROS, load nothing of the layers above.
"""

from __future__ import annotations

import asyncio
import random
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

from dmc41x3.address import SIM, meant, parse
from dmc41x3.i18n import phrase
from dmc41x3.wire.transport import Transport, connect
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from maya_un.controller.homing import homed_pose
from maya_un.controller.registers import Dial
from maya_un.errors import InvalidConfig
from maya_un.events import EventLog
from maya_un.recorder.recorder import Recorder
from maya_un.recorder.recording import RecordingOrigin, TwinSource
from maya_un.recorder.store import RecordingStore
from maya_un.values import Point
from maya_un.workers import Workers

if TYPE_CHECKING:  # a node of another layer starts sooner without the twin
    from dmc41x3.twin.memory import Memory
    from dmc41x3.twin.wire.server import VirtualController
    from maya_un.machine.mechanics import MayaMechanics
    from maya_un.machine.truth import TrueConstants
    from maya_un.service.twin import FaultInjector


@dataclass(frozen=True, slots=True)
class Twin:
    """The virtual machine of a stack: its controller, and the mechanics with their own record."""

    controller: VirtualController
    mechanics: MayaMechanics

    @property
    def parts(self) -> dict[str, Point]:
        """Present positions of the parts, by their grasp points [m]."""
        return {name: Point(*place) for name, place in self.mechanics.parts.items()}

    @property
    def faults(self) -> FaultInjector:
        """The faults of the controller."""
        from maya_un.machine.faults import TwinFaultInjector  # noqa: PLC0415

        return TwinFaultInjector(self.controller.faults)

    def true_joints(self) -> tuple[float, float, float]:
        """Return the true angle [rad] and the true line lengths [m]; homing is not needed."""
        self.controller.look()
        return self.mechanics.true_joints()

    @property
    def carried(self) -> str | None:
        """The part between the jaws, or None."""
        return self.mechanics.record.carried

    def press_stop(self, *, pressed: bool) -> None:
        """Press the emergency stop, or release it; its wiring says what the abort input then reads."""
        active = self.mechanics.truth.wiring.abort_active(pressed=pressed)
        self.controller.look()
        self.controller.machine.abort_input(active)


@dataclass(frozen=True, slots=True)
class ControllerAssembly:
    """The controller layer at an address; `twin` is None on a real machine, `recorder` if nothing is recorded."""

    address: str
    controller: GalilController
    twin: Twin | None
    recorder: Recorder | None


def machine_of(config: Config) -> TrueConstants:
    """Return the constants of a machine that is built as its configuration says.

    A configuration does not contain some of the constants. The machine has the values of Maya for them: friction (for
    the lines in proportion to `torque_per_load`), the distance from a switch to the hard stop (longer if homing needs
    more to brake), the delay (shorter if an axis would lag by more than a quarter of its error limit), the stall
    stiffness, and the fall speed.
    """
    from maya_un.machine.truth import TrueConstants  # noqa: PLC0415

    axes, geometry, scale = (config.axes.a, config.axes.b, config.axes.c), config.geometry, config.scale
    a, b, c = ((axis.minimum, axis.maximum) for axis in axes)

    def fitted(axis: int) -> tuple[bool, bool]:
        return axes[axis].switch_at_minimum, axes[axis].switch_at_maximum

    machine = TrueConstants(
        height=geometry.height,
        length=geometry.length,
        delta=geometry.delta,
        gripper_height=geometry.gripper_height,
        counts_per_degree=scale.pulses_per_degree,
        counts_per_metre=scale.pulses_per_metre,
        switches=(a, b, c),
        torque_per_load=config.homing.torque_per_load,
        self_locking=config.safety.self_locking,
        gripper_output=config.gripper.output,
        gripper_closes_on=config.gripper.closed_by == "set",
        letters="".join(axis.letter for axis in axes),
        fitted=(fitted(0), fitted(1), fitted(2)),
    )
    usual, per_unit = TrueConstants(), machine.scale

    pull = machine.torque_per_load / usual.torque_per_load

    def lag(axis: int) -> float:
        return min(usual.lag[axis], axes[axis].error_limit_counts / (4.0 * axes[axis].speed_counts))

    def gap(axis: int) -> float:
        speed = axes[axis].speed_counts if axis == 0 else config.homing.speed * per_unit[axis]
        together = axes[:1] if axis == 0 else axes[1:]  # a switch stops both lines, and the weaker one brakes them
        deceleration = min(one.limit_deceleration_counts // 1024 * 1024 for one in together)
        braking = speed * lag(axis) + speed * speed / (2.0 * deceleration)
        return max(usual.gaps[axis], 1.1 * braking / per_unit[axis])

    def stiffness(axis: int) -> float:
        return usual.stall_stiffness[axis] * (usual.scale[axis] / per_unit[axis])

    return replace(
        machine.with_wiring(config.wiring.limit_active_level == 1),
        friction=(usual.friction[0], pull * usual.friction[1], pull * usual.friction[2]),
        gaps=(gap(0), gap(1), gap(2)),
        lag=(lag(0), lag(1), lag(2)),
        stall_stiffness=(stiffness(0), stiffness(1), stiffness(2)),
    )


def make_twin(
    config: Config | None = None,
    *,
    seed: int = 0,
    truth: TrueConstants | None = None,
    parts: Mapping[str, Point] | None = None,
    memory: Memory | None = None,
    firmware: str | None = None,
) -> Twin:
    """Return a virtual DMC-4133 with the machine of a configuration, powered up at a place that `seed` draws.

    `truth` holds the machine's own constants if they differ from the configuration, `parts` stand on its table (x, y, z
    of the grasp, m), `memory` is its burned memory, `firmware` the line that it returns to ^R^V.
    """
    from dmc41x3.twin.machine import VirtualDmc  # noqa: PLC0415
    from dmc41x3.twin.wire.server import VirtualController  # noqa: PLC0415
    from maya_un.machine.miswired import built  # noqa: PLC0415
    from maya_un.machine.truth import StartPose, legal_start  # noqa: PLC0415

    real = truth if truth is not None else machine_of(config or Config())
    try:
        start = legal_start(random.Random(seed), real)
        if config is not None and config.person_needed:  # its person has brought it to the pose that it is given
            start = StartPose(*homed_pose(config))
    except ValueError as error:
        reason = phrase("no place of the gripper above the table keeps both lines taut")
        raise InvalidConfig(key="geometry.height", value=real.height, reason=reason) from error
    mechanics, plant = built(real, start, parts)
    machine = VirtualDmc(plant, memory=memory, firmware=firmware)
    machine.abort_input(real.wiring.abort_active(pressed=False))
    return Twin(VirtualController(machine, seed=seed), mechanics)


@asynccontextmanager
async def controller_layer(  # noqa: PLR0913 - every option of a controller layer is a parameter
    config: Config,
    address: str = SIM,
    *,
    seed: int = 0,
    parts: Mapping[str, Point] | None = None,
    truth: TrueConstants | None = None,
    live: bool = True,
    skip_home: bool = False,
    take_over: bool = False,
    speed: float = 1.0,
    recordings: RecordingStore | None = None,
    heard: Callable[[EventLog], None] | None = None,
    workers: Workers | None = None,
) -> AsyncIterator[ControllerAssembly]:
    """Open the controller layer alone at `address` for the length of the block; options and errors are as in `stack`.

    `heard` is called with the event log before the first event. `workers` plan the motions, if given.
    """
    address = meant(address, config.controller.address)
    twin = make_twin(config, seed=seed, truth=truth, parts=parts) if address == SIM else None
    waiting = config if twin is None else patient(config, speed)
    recorder = _recorder(config, address, speed, twin, seed, recordings) if live else None
    controller = GalilController(_dial(address, config, twin, recorder), address, waiting, live=live, workers=workers)
    if heard is not None:
        heard(controller.events)
    try:
        async with _watched(recorder, controller):
            await controller.open(take_over=take_over)
            if skip_home:
                await controller.skip_home()
            yield ControllerAssembly(address, controller, twin, recorder)
    finally:
        await controller.close()
        if twin is not None:
            await twin.controller.close()


def patient(config: Config, speed: float) -> Config:
    """Return the configuration for a twin with a scaled clock: a reply, or a busy host, takes the same real time."""
    factor = max(1.0, speed)
    controller = config.controller.model_copy(update={"timeout": config.controller.timeout * factor})
    safety = config.safety.model_copy(update={"guard_time": config.safety.guard_time * factor})
    return config.model_copy(update={"controller": controller, "safety": safety})


def to_controller(address: str, config: Config) -> Dial:
    """Return what connects to the controller at HOST, HOST:PORT or a serial port."""
    place = parse(address)

    async def dial() -> Transport:
        return await connect(place, config.controller.timeout)

    return dial


def _dial(address: str, config: Config, twin: Twin | None, recorder: Recorder | None) -> Dial:
    async def to_twin() -> Transport:
        assert twin is not None
        return twin.controller.loopback()

    dial = to_controller(address, config) if twin is None else to_twin

    async def recorded() -> Transport:
        assert recorder is not None
        return recorder.recorded(await dial())

    return dial if recorder is None else recorded


def _watched(recorder: Recorder | None, controller: GalilController) -> AbstractAsyncContextManager[None]:
    return nullcontext() if recorder is None else recorder.watching(controller)


def _recorder(
    config: Config, address: str, speed: float, twin: Twin | None, seed: int, recordings: RecordingStore | None
) -> Recorder | None:
    """Return a flight recorder for the robot, None if nothing is to be recorded."""
    if recordings is None or not config.recorder.enabled:
        return None
    source = None
    if twin is not None:
        a, b, c = twin.mechanics.start
        born = asyncio.get_running_loop().time() - twin.controller.machine.now
        source = TwinSource(seed, asdict(twin.mechanics.truth), (a, b, c), twin.mechanics.parts, born)
    return Recorder(config.recorder, RecordingOrigin.of(config, address, speed=speed, twin=source), recordings)
