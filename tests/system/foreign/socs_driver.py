"""The Simons Observatory's driver GalilAxis with everything it offers, on the controller at argv[1], by plain TCP."""

from __future__ import annotations

import json
import sys

from calls import Calls
from socs.agents.galil_axis import drivers
from socs.agents.galil_axis.drivers import GalilAxis


def amplifier(stage: GalilAxis) -> dict[str, object]:
    """Set up an axis as the agent does, with its motor off."""
    stage.set_motor_state("A", "disable")
    stage.set_motor_type("A", 1)
    stage.set_off_on_error("A", 1)
    stage.set_amp_gain("A", 2)
    stage.set_torque_limit("A", 5)
    stage.set_amp_currentloop_gain("A", 9)
    stage.enable_sin_commutation("A")
    stage.set_magnetic_cycle("A", 2000)
    stage.set_dwell_times(20, 10)
    stage.initialize_axis("A", 3)
    return {
        "type": float(stage.get_motor_type("A")),
        "off on error": stage.get_off_on_error("A"),
        "gain": float(stage.get_amp_gain("A")),
        "torque limit": float(stage.get_torque_limit("A")),
        "loop gain": float(stage.get_amp_currentloop_gain("A")),
    }


def inputs_and_outputs(stage: GalilAxis) -> dict[str, object]:
    """Use brake, thermistor and limit switches."""
    said: dict[str, object] = {"volts": stage.get_thermistor_voltage("A", 1)}
    stage.release_brake(1)
    said["released"] = stage.get_brake_status("A", 1)
    stage.engage_brake(1)
    said["engaged"] = stage.get_brake_status("A", 1)
    for state in range(4):
        stage.set_limitswitch_mode("A", state)
        said[f"limits {state}"] = stage.get_limitswitch_mode("A")
    stage.set_limitswitch_polarity(1)
    said["high"] = stage.get_limitswitch_polarity()
    stage.set_limitswitch_polarity(-1)
    said["low"] = stage.get_limitswitch_polarity()
    return said


def gearing(stage: GalilAxis) -> dict[str, object]:
    """Let B follow A and D follow C."""
    stage.set_gearing(",A,,C")
    stage.set_gearing_ratio(",1,,1")
    return {
        "ratios": [stage.get_gearing_ratio(axis) for axis in "ABCD"],
        "leads": [stage.get_gearing_lead(axis) for axis in "BD"],
    }


def motion(stage: GalilAxis) -> dict[str, object]:
    """Move A to a place and by a distance, then jog it and stop it."""
    for axis in "ABCD":
        stage.set_motor_state(axis, "enable")
        stage.define_position(axis)
    stage.set_speed("A", 20000)
    stage.set_acceleration("A", 409600)
    stage.set_deceleration("A", 409600)
    said: dict[str, object] = {
        "rates": [float(ask("A")) for ask in (stage.get_speed, stage.get_acceleration, stage.get_deceleration)],
        "on": stage.get_motor_state("A"),
    }
    stage.set_absolute_position("A", 4, counts_per_unit=1000)
    said["begun"] = stage.begin_motion("A")
    finish(stage)
    said["absolute"] = stage.get_data(["A", "B"])
    stage.set_relative_position("A", -1.5, counts_per_unit=1000)
    said["distance"] = [
        stage.get_relative_position("A"),
        stage.get_relative_position("A", "linear", counts_per_mm=1000),
        stage.get_relative_position("A", "angular", counts_per_deg=500),
    ]
    stage.begin_motion("A")
    finish(stage)
    said["relative"] = stage.get_data()
    stage.set_jog_speed("A", 5000)
    stage.begin_motion("A")
    stage.stop_motion("A")
    finish(stage)
    said["jogged"] = stage.get_data()["A"]["position"]
    return said


def finish(stage: GalilAxis) -> None:
    """Wait for axis A."""
    while float(stage.is_running("A")):
        pass


def main(address: str) -> dict[str, object]:
    """Go through all of it."""
    calls = Calls(drivers)
    host, port = address.split(":")
    stage = GalilAxis(host, int(port))
    said = {
        "amplifier": amplifier(stage),
        "wired": inputs_and_outputs(stage),
        "geared": gearing(stage),
        "moved": motion(stage),
        "off": stage.set_motor_state("C", "disable") == "" and stage.get_motor_state("C"),
    }
    said["missing"] = calls.missing(GalilAxis)
    return said


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1])))
