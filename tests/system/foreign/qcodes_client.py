"""QCoDeS's driver of the DMC-41x3 with everything it offers, on the controller at argv[1]; prints what came of it."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

import gclib
from calls import Calls
from qcodes.instrument_drivers.Galil import dmc_41x3
from qcodes.instrument_drivers.Galil.dmc_41x3 import (
    GalilDMC4133Arm,
    GalilDMC4133Controller,
    GalilDMC4133Motor,
    GalilDMC4133VectorMode,
    GalilMotionController,
)

OFF_ON_ERROR = "enable for position, amp error or abort"


def refusal(call: Callable[[], object]) -> str:
    """Return gclib's message for a refused call, and nothing if it is not refused."""
    try:
        call()
    except gclib.GclibError as error:
        return str(error)
    return ""


def settings(motor: GalilDMC4133Motor) -> dict[str, object]:
    """Set every parameter of a motor and return what it reads then."""
    motor.speed(30_000)
    motor.acceleration(512_000)
    motor.deceleration(256_000)
    motor.relative_position(2_000)
    motor.reverse_sw_limit(-1_000_000)
    motor.forward_sw_limit(1_000_000)
    motor.off_when_error_occurs(OFF_ON_ERROR)
    return {name: parameter.get() for name, parameter in motor.parameters.items()}


def single(motor: GalilDMC4133Motor) -> dict[str, object]:
    """Move a motor by itself, off and on again."""
    said = {"off": motor.on_off_status()}
    motor.servo_here()
    said["on"] = motor.on_off_status()
    motor.begin()
    said["moving"] = str(motor.is_in_motion())
    motor.wait_till_motor_motion_complete()
    said["over"] = str(motor.is_in_motion())
    said["error"] = str(motor.error_magnitude())
    motor.off()
    said["off again"] = motor.on_off_status()
    return said


def together(controller: GalilDMC4133Controller) -> dict[str, object]:
    """Move all motors at once, then stop and abort them."""
    for motor, distance in zip(motors(controller), (1_000, -500, 250), strict=True):
        motor.relative_position(distance)
        motor.servo_here()
    controller.define_position_as_origin()
    controller.begin_motors()
    controller.wait_till_motion_complete()
    reached = controller.absolute_position()
    controller.motor_a.relative_position(500_000)
    controller.motor_a.begin()
    while float(controller.ask("MG _TPA")) < 3_000.0:
        pass
    controller.stop()
    controller.motion_complete("A")
    stopped = controller.absolute_position()
    controller.motor_a.begin()
    controller.abort()
    said = {"moving": controller.motor_a.is_in_motion(), "off": controller.motor_a.on_off_status()}
    for motor in motors(controller):
        motor.servo_here()
    return {"reached": reached, "stopped": stopped, **said}


def vector(plane: GalilDMC4133VectorMode, controller: GalilDMC4133Controller) -> dict[str, object]:
    """Move two motors on a straight line, and back."""
    plane.coordinate_system("S")
    plane.vector_acceleration(256_000)
    plane.vector_deceleration(256_000)
    plane.vector_speed(20_000)
    said: dict[str, object] = {name: parameter.get() for name, parameter in plane.parameters.items()}
    plane.clear_sequence("S")
    plane.activate()
    plane.vector_position(3_000, 4_000)
    plane.vector_position(0, 0)
    plane.vector_seq_end()
    before = controller.absolute_position()
    plane.begin_seq()
    said["after, from a host"] = refusal(plane.after_seq_motion)
    controller.motion_complete("S")
    said["length"] = float(controller.ask("MG _AVS"))
    said["came back"] = before == controller.absolute_position()
    return said


def arm(controller: GalilDMC4133Controller) -> dict[str, object]:
    """Teach the probe arm a chip and let it visit pads."""
    probe = GalilDMC4133Arm(controller)
    probe.rows, probe.pads = 3, 3
    probe.inter_row_distance, probe.inter_pad_distance = 800.0, 600.0
    probe.set_arm_kinematics(speed=2_000, acceleration=25_600, deceleration=25_600)
    probe.set_pick_up_distance(40)
    controller.define_position_as_origin()
    probe.set_left_bottom_position()
    probe.move_motor_a_by(80)
    probe.set_left_top_position()
    probe.move_motor_b_by(60)
    probe.set_right_top_position()
    probe.move_motor_c_by(1)
    corners = [probe.left_bottom_position, probe.left_top_position, probe.right_top_position]
    known = [probe.arm_pick_up_distance, probe.speed, probe.acceleration, probe.deceleration]
    probe.move_towards_left_bottom_position()
    probe.move_to_next_row()
    probe.move_to_row(3)
    probe.move_to_row(1)
    probe.move_to_pad(2)
    probe.move_to_begin_row_pad_from_end_row_last_pad()
    for name in "abc":
        getattr(probe, f"set_motor_{name}_forward_limit")()
        getattr(probe, f"set_motor_{name}_reverse_limit")()
    return {"corners": corners, "known": known, "at": [probe.current_row, probe.current_pad]}


def motors(controller: GalilDMC4133Controller) -> tuple[GalilDMC4133Motor, ...]:
    """Return the three motors."""
    return controller.motor_a, controller.motor_b, controller.motor_c


def main(address: str) -> dict[str, object]:
    """Go through all of it."""
    calls = Calls(dmc_41x3)
    controller = GalilDMC4133Controller("stage", address)
    said: dict[str, object] = {"idn": controller.get_idn()}
    controller.timeout(4_000)
    controller.position_format_decimals(0)
    said["settings"] = [settings(motor) for motor in motors(controller)]
    said["single"] = [single(motor) for motor in motors(controller)]
    said["together"] = together(controller)
    planes = (controller.plane_ab, controller.plane_bc, controller.plane_ac)
    said["vector"] = [vector(plane, controller) for plane in planes]
    said["wait, from a host"] = refusal(lambda: controller.wait(2))
    said["told"] = controller.tell_error()
    said["end, from a host"] = refusal(controller.end_program)
    controller.tell_error()
    said["arm"] = arm(controller)
    controller.motors_off()
    said["off"] = [motor.on_off_status() for motor in motors(controller)]
    controller.close()
    said["missing"] = calls.missing(
        GalilMotionController, GalilDMC4133Controller, GalilDMC4133Motor, GalilDMC4133VectorMode, GalilDMC4133Arm
    )
    return said


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1])))
