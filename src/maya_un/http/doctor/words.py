"""Texts of `maya doctor`: the meaning of each finding, and its remedy."""

from __future__ import annotations

from typing import Any, NamedTuple

from dmc41x3.i18n import translate, translate_phrase
from maya_un.http.doctor.finding import Finding
from maya_un.schema.diagnosis import FoundByDoctor


class FindingText(NamedTuple):
    """A sentence with the meaning of a finding, and one with its remedy, "" for none."""

    meaning: str
    remedy: str = ""


_TEXTS = {
    "config_good": FindingText("The configuration {path} is valid."),
    "config_none": FindingText("There is no configuration file: the manual's values apply."),
    "config_served": FindingText("The running service uses the configuration {path}, which is valid."),
    "config_served_none": FindingText("The running service uses no configuration file: the manual's values apply."),
    "config_bad": FindingText("{error}", "Correct it, then run `maya config check`."),
    "software_compiled": FindingText("maya-un {version}; the twin and the planner are compiled."),
    "software_plain": FindingText(
        "maya-un {version}, not compiled. A compiled package makes previews and dry runs faster."
    ),
    "coms_none": FindingText("`maya coms` does not run at {url}."),
    "coms_other": FindingText(
        "`maya coms` at {url} is that of the robot {found}, not of {name}.",
        "Set coms.server_address to the address that the `maya coms` of {name} prints when it starts.",
    ),
    "coms_idle": FindingText("`maya coms` runs at {url} and is not connected."),
    "coms_connected": FindingText("`maya coms` is connected to the robot and to {where}."),
    "coms_clear": FindingText(
        "`maya coms` sends its password to {where} without encryption: anyone on the network can read it.",
        "Use mqtts:// or https://.",
    ),
    "coms_taken": FindingText(
        "`maya coms` is disconnected from its supervisors: {reason}",
        "Until then the other robot gets the commands.",
    ),
    "coms_waits": FindingText(
        "`maya coms` waits: {reason}",
        "Commands that arrive meanwhile stay with the supervisors' server.",
    ),
    "service_none": FindingText("No `maya up` runs here.", "To command a robot, start it."),
    "service_gone": FindingText(
        "`maya up` (process {pid}) did not end normally; no program listens at {url}.",
        "Start `maya up` again; `maya logs` may show the cause.",
    ),
    "service_hangs": FindingText(
        "`maya up` (process {pid}) listens at {url} but does not answer ({reason}).",
        "Stop the robot with `maya stop`, end the process, then read `maya logs`.",
    ),
    "service_stranger": FindingText(
        "Another program answers at {url}, the address of the former `maya up`.",
        "End the program that listens there, or start `maya up` with another `--port`.",
    ),
    "service_runs": FindingText("`maya up` (process {pid}) answers at {url}."),
    "service_not_ready": FindingText("{message}"),
    "service_ready": FindingText("Ready for commands."),
    "service_answers": FindingText("It answers."),
    "service_refuses": FindingText("It answers, but refuses your request: {message}"),
    "version_same": FindingText("Command and service have version {version}."),
    "version_differs": FindingText(
        "This command has version {own}, but the running service has version {version}.",
        "Restart `maya up` when the robot is at rest.",
    ),
    "robot_well": FindingText("The robot on {address} is {mode}."),
    "robot_not_homed": FindingText(
        "The robot on {address} is not homed, so its position is not known.",
        "Run `maya home` before any other motion.",
    ),
    "robot_without_datum": FindingText(
        "The robot on {address} has no datum, so its position is not known.",
        "Bring it to a known pose with `maya datum move`, then give the joints of that pose with `maya datum give`.",
    ),
    "robot_fault": FindingText("The robot is in a fault ({code}): {message}"),
    "robot_disconnected": FindingText(
        "The service has no connection to the controller at {address}.",
        "Check its power and cable. If it is on, reset it: sometimes it gets an IP address only then.",
    ),
    "limits_active": FindingText(
        "Limit switches are active: {names}.",
        "Check whether the robot really stands on them.",
    ),
    "limits_quiet": FindingText("No limit switch is active."),
    "limits_both": FindingText(
        "Both limit switches of {axes} are active at once.",
        "An axis cannot stand on both: check their power and cables, and `limit_active_level` in the configuration.",
    ),
    "level_same": FindingText("The switches are active at the configured level (CN {found})."),
    "torque_low": FindingText(
        "The torque limit of the lines is too low to lift anything ({found}), and no program owns the "
        "controller. A program that was killed left the limit at this value.",
        "Start `maya up`: it sets the limits. Before you use another program, send `TL` with your own limits.",
    ),
    "level_differs": FindingText(
        "The controller reads switches as active at CN {found}, but the configuration says {wanted}.",
        "`maya up` sets it. If another program changed it, end that program first.",
    ),
    "lease_free": FindingText("Nobody drives."),
    "lease_held": FindingText(
        "{holder} has been driving for {since:.0f} s.",
        "`maya lease ask` asks the driver for the lease; `maya stop` works for everybody.",
    ),
    "queue_runs": FindingText("The queue is running."),
    "queue_paused": FindingText(
        "The queue is paused ({reason}); {waiting} jobs are waiting.",
        "`maya queue` shows it, `maya queue resume` continues it.",
    ),
    "queue_asks": FindingText(
        "Job {job} was interrupted, and waits for a person.",
        "`maya queue recover` shows the choices.",
    ),
    "controller_asked": FindingText(
        "The controller was checked through the running service, without a second connection.",
    ),
    "controller_twin": FindingText("There is no controller to check: sim is a twin within the program."),
    "controller_unnamed": FindingText(
        "No controller was checked: none is configured.",
        "`maya doctor --address HOST` checks one.",
    ),
    "controller_silent": FindingText(
        "{error}",
        "Search for it with `maya dmc find`. `maya dmc assign` gives an address to a controller that has none. To "
        "use its USB port, give an address like /dev/ttyUSB0.",
    ),
    "controller_answers": FindingText("The controller at {address} answers within {milliseconds:.1f} ms."),
    "controller_wrong": FindingText("{error}"),
    "controller_refuses": FindingText(
        "The controller refuses the command {command} ({reason}).",
        "If it is a DMC-41x3, check whether its firmware is old.",
    ),
    "firmware": FindingText("It is {firmware}."),
    "handles_free": FindingText(
        "{free} of its {all} handles are free; this check uses {own}; others: {others}.",
    ),
    "handles_short": FindingText(
        "Only {free} of its {all} handles are free; others: {others}.",
        "End programs that use a handle, or reset the controller, which closes all handles.",
    ),
    "controller_clock": FindingText(
        "The clock of the controller is right: {counts:.0f} samples a second at TM {period:.0f}."
    ),
    "controller_clock_off": FindingText(
        "The clock of the controller counts {counts:.0f} samples a second at TM {period:.0f}; 1024 at TM "
        "1000 are right.",
        "Another program changed TM; `maya up` sets it. If TM is 1000, this computer was overloaded: check again.",
    ),
    "owned": FindingText("It belongs to {holder}."),
    "owned_by_nobody": FindingText("No program owns it."),
    "program_none": FindingText("No program runs in it."),
    "program_runs": FindingText(
        "A program runs in it (threads {threads}).",
        "If it is Maya's guard, a `maya up` on another computer is connected. Another program may move axes by itself.",
    ),
    "motors_on": FindingText("Its motors are on."),
    "motors_off": FindingText("The motors of {axes} are off.", "`maya up` and `maya recover` switch them on."),
    "controller_fault": FindingText("{error}"),
    "memory_sound": FindingText("Its burned memory was intact at power-up."),
    "memory_damaged": FindingText(
        "The controller found its burned memory damaged when it powered up (_RS {found:.0f}).",
        "Burn its parameters and programs again before any motion.",
    ),
    "storage_good": FindingText("The queue is stored in {path}: {runs} starts, {size:.1f} MB, intact."),
    "storage_none": FindingText("No queue is stored in {path} yet. The folder can be written."),
    "storage_in_use": FindingText(
        "The service (process {pid}) uses the queue in {path}, and reports no problem.",
    ),
    "storage_bad": FindingText("{error}"),
    "storage_unwritable": FindingText(
        "{path} cannot be written, so no job can be accepted.",
        "Correct its owner and permissions, or name another folder in MAYA_STATE_DIR.",
    ),
    "disk_room": FindingText("{free:.1f} GB are free on the disk of the queue."),
    "disk_short": FindingText(
        "Only {free:.2f} GB are free on the disk of the queue.",
        "Free space; recordings in {path} may be the largest part.",
    ),
    "port_free": FindingText("Port {port} ({use}) is free."),
    "port_ours": FindingText("Port {port} ({use}) is held by {who}."),
    "port_taken": FindingText(
        "Port {port} ({use}) is held by {who}.",
        "End that program, or give `maya up` another `--port`.",
    ),
    "certificate_good": FindingText("The certificate at port {port} is valid until {until}."),
    "certificate_soon": FindingText(
        "The certificate at port {port} ends on {until}, in {days:.0f} days.",
        "Get a new one, and restart `maya up` with it.",
    ),
    "certificate_expired": FindingText(
        "The certificate at port {port} has expired: clients that check it do not connect.",
        "Get a new one, and restart `maya up` with it.",
    ),
    "certificate_bad": FindingText(
        "The certificate at port {port} is not valid ({reason}).",
        "Check this computer's clock first. If it is right, get a new certificate, and restart `maya up` with it.",
    ),
    "clock_good": FindingText("{keeper} synchronises this computer's clock."),
    "clock_alone": FindingText(
        "Nothing seems to synchronise this computer's clock.",
        "Dates of jobs and tokens use it: switch time synchronisation on (systemd-timesyncd or chrony).",
    ),
    "clock_back": FindingText(
        "This computer's clock is {seconds:.0f} s behind the newest stored event.",
        "Set the clock. Until then tokens may count as expired, and histories are out of order.",
    ),
    "ros_none": FindingText("ROS is not installed; Maya does not need it."),
    "ros_master": FindingText("ROS is installed, and its master answers at {uri}."),
    "ros_no_master": FindingText(
        "ROS is installed, but no master answers at {uri}.",
        "To use the ROS nodes, start `roscore`, or set ROS_MASTER_URI.",
    ),
    "check_failed": FindingText("This could not be checked ({reason}).", "Please report it with the log."),
}
"""The texts by the key of a finding."""


def name(check: str, language: str) -> str:
    """Return the name of a check."""
    return translate(check, language, "Finding.check")


def meaning(finding: Finding, language: str) -> str:
    """Return the meaning of a finding, in one sentence."""
    return translate(_TEXTS[finding.key].meaning, language, **_shown(finding, language))


def remedy(finding: Finding, language: str) -> str:
    """Return the remedy of a finding, "" for none."""
    return translate(_TEXTS[finding.key].remedy, language, **_shown(finding, language))


def _shown(finding: Finding, language: str) -> dict[str, Any]:
    """Return the details as they stand in a sentence; phrases among them are translated."""
    details = finding.details.items()
    return {name: translate_phrase(one, language) if isinstance(one, str) else one for name, one in details}


def message(finding: Finding, language: str) -> FoundByDoctor:
    """Return a finding as a message."""
    texts = (meaning(finding, language), remedy(finding, language))
    return FoundByDoctor(finding.check, finding.outcome, finding.key, *texts, dict(finding.details))
