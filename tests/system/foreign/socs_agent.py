"""The Simons Observatory's agent of a Galil controller, without the crossbar it usually registers with.

The object that stands in for the ocs agent keeps what is published and runs a process that is started at once. Prints
what every task answered.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from types import SimpleNamespace

from calls import Calls
from socs.agents.galil_axis import agent as module
from socs.agents.galil_axis.agent import GalilAxisAgent

CONFIGURATION = """
galil:
  motorsettings: {countspermm: 4000, countsperdeg: 2000}
  limitsetting: {polarity: '-1', disable_limits: {B: '3'}}
  brakes: {output_map: {A: '1'}}
  motorconfigparams:
    A: {MT: '1', OE: '1', AG: '2', TL: '5', AU: '9'}
    B: {MT: '1', OE: '1', AG: '2', TL: '5', AU: '9'}
  initaxisparams: {BA: 'True', BM: '2000', BZ: '3'}
  dwell_times: {first_ms: '20', second_ms: '10'}
"""


TASKS: tuple[tuple[str, dict[str, object]], ...] = (
    ("init", {"input_config": True, "auto_acquire": True}),
    ("get_motor_type", {"axis": "A"}),
    ("get_off_on_error", {"axis": "A"}),
    ("get_amp_gain", {"axis": "A"}),
    ("get_torque_limit", {"axis": "A"}),
    ("get_amp_currentloop_gain", {"axis": "A"}),
    ("set_motor_state", {"axis": "A", "state": "disable"}),
    ("set_motor_type", {"axis": "A", "motortype": 1}),
    ("set_off_on_error", {"axis": "A", "errtype": 1}),
    ("set_amp_gain", {"axis": "A", "val": 1}),
    ("set_amp_currentloop_gain", {"axis": "A", "val": 9}),
    ("set_torque_limit", {"axis": "A", "val": 4.5}),
    ("enable_sin_commutation", {"axis": "A"}),
    ("set_magnetic_cycle", {"axis": "A", "val": 2000.0}),
    ("set_dwell_times", {"t_first": 20, "t_second": 10}),
    ("initialize_axis", {"axis": "A", "val": 3.0}),
    ("set_limitswitch_mode", {"axis": "A", "val": 0}),
    ("get_limitswitch_mode", {"axis": "A"}),
    ("set_limitswitch_polarity", {"polarity": -1}),
    ("get_limitswitch_polarity", {}),
    ("set_axis_brake", {"axis": "A", "state": "release"}),
    ("get_brake_status", {"axis": "A"}),
    ("set_axis_brake", {"axis": "A", "state": "engage"}),
    ("get_thermistor_voltage", {"axis": "A"}),
    ("set_motor_state", {"axis": "A", "state": "enable"}),
    ("get_motor_state", {"axis": "A"}),
    ("define_position", {"axis": "A", "val": 100.0}),
    ("set_speed", {"axis": "A", "speed": 40000.0}),
    ("get_speed", {"axis": "A"}),
    ("set_acceleration", {"axis": "A", "acc": 409600.0}),
    ("get_acceleration", {"axis": "A"}),
    ("set_deceleration", {"axis": "A", "decel": 409600.0}),
    ("get_deceleration", {"axis": "A"}),
    ("set_absolute_position", {"axis": "A", "position": 0.5, "movetype": "linear"}),
    ("begin_axis_motion", {"axis": "A"}),
    ("wait", {}),
    ("set_relative_position", {"axis": "A", "distance": 0.5, "movetype": "angular"}),
    ("begin_axis_motion", {"axis": "A"}),
    ("wait", {}),
    ("set_jog_speed", {"axis": "A", "speed": 4000.0}),
    ("begin_axis_motion", {"axis": "A"}),
    ("stop_axis_motion", {"axis": "A"}),
    ("wait", {}),
    ("set_gearing", {"order": ",A"}),
    ("set_gearing_ratio", {"order": ",2"}),
    ("get_gearing_ratio", {"axis": "B"}),
    ("get_gearing_lead", {"axis": "B"}),
    ("acq", {"test_mode": True}),
    ("_stop_acq", {}),
)
"""Every task of the agent in an order that makes sense; `wait` is ours and waits for axis A."""


class Log:
    """Keeps what the agent logs."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, line: str) -> None:
        """Keep a line."""
        self.lines.append(line)

    warn = error = info


class Crossbar:
    """The part of ocs that the agent uses: a log, feeds, and processes that can be started."""

    def __init__(self) -> None:
        self.log = Log()
        self.published: list[dict[str, object]] = []
        self.feeds: dict[str, SimpleNamespace] = {}
        self.flushed = 0
        self.processes: dict[str, object] = {}

    def register_feed(self, name: str, **_: object) -> None:
        """Make a feed."""
        self.feeds[name] = SimpleNamespace(flush_buffer=self._flush)

    def publish_to_feed(self, _: str, message: dict[str, object]) -> None:
        """Keep a message."""
        self.published.append(message)

    def start(self, name: str, params: dict[str, object]) -> tuple[bool, str]:
        """Run a process once."""
        session = SimpleNamespace(data={}, degraded=False)
        return self.processes[name](session, {"test_mode": True, **params})

    def _flush(self) -> None:
        self.flushed += 1


def main(address: str, directory: str) -> dict[str, object]:
    """Start the agent and run its tasks one after the other."""
    calls = Calls(module)
    os.environ["OCS_CONFIG_DIR"] = directory
    (Path(directory) / "axes.yaml").write_text(CONFIGURATION, encoding="utf-8")
    host, port = address.split(":")
    crossbar = Crossbar()
    agent = GalilAxisAgent(crossbar, host, str(Path(directory) / "axes.yaml"), int(port))
    crossbar.processes["acq"] = agent.acq
    said: dict[str, object] = {}

    for name, params in TASKS:
        if name == "wait":
            finish(agent)
            continue
        session = SimpleNamespace(data={}, degraded=False)
        said[f"{name} {' '.join(map(str, params.values()))}".strip()] = getattr(agent, name)(session, params)
    said["published"] = crossbar.published
    said["flushed"] = crossbar.flushed
    said["missing"] = calls.missing(GalilAxisAgent)
    return said


def finish(agent: GalilAxisAgent) -> None:
    """Wait for axis A."""
    while float(agent.stage.is_running("A")):
        pass


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:])))
