"""The help pages that do not need a command parser."""

from __future__ import annotations

EVERYWHERE = (
    "Every command also takes --json (print the answer as JSON), --lang en|es (language of messages; help is in "
    "English), --units mm|si (units of lengths and angles: mm and degrees, or m and rad) and --config FILE "
    "(configuration file)."
)
"""The options of every command, at the end of its help."""

OVERVIEW = """\
maya: control the robot Maya, real or virtual.

Start
  up [--address WHERE] [--speed X]             start the robot's control program; other commands talk to it
  down [--finish]                              end `maya up`; with --finish after the current step
  run JOB [--dry-run] [--speed X]              carry out a job on the running robot; if none runs, on a twin
  status                                       show the state of the running robot
  stop [--address WHERE]                       stop the robot now, even if `maya up` does not answer
  pause           resume                       pause all motion; continue it
  speed RATIO                                  scale the speed of all motion: 50%
  abort                                        stop without deceleration; motors may switch off. Use `stop` first
  recover                                      clear a fault after you removed its cause; nothing moves
  call [OPERATION NAME=VALUE ...]              send an operation of the HTTP interface; without OPERATION, list all

Robot (commands to the robot that `maya up` runs; lengths in m or like 120mm, angles in rad or like 30deg)
  home                                         find the limit switches, so that the position is known
  datum           datum move|give|confirm      tell a robot without limit switches where it stands
  pick X Y [Z]    place X Y [Z]                pick up a part, put it down; also pick NAME, place NAME
  approach X Y Z                               move above a point, by cell.clearance of the configuration; also NAME
  line X Y Z                                   move straight to a point; also line NAME
  gripper open|close                           open or close the gripper
  move A B C                                   move in a straight line in joint space; also move NAME
  jog AXIS DISTANCE                            move along a, b, c, x, y, z or r
  jog                                          jog with the keys of the terminal
  teach NAME      teach-pallet NAME            store the position of the gripper, store a pallet
  zones [list]    zones add|remove NAME ...    zones that the robot must not enter, until `maya up` ends
  record save                                  save a recording of the last minutes
  calibrate collect FILE                       move to poses and ask for measured points
  commission [--address WHERE] [--restart]     check the wiring of a new machine, step by step, with you

Queue
  queue           queue pause|resume|step      show the queue; pause it, continue it, do one step
  queue answer [CHOICE]                        answer the question of the running job
  queue recover   queue move|clear|backup ...  decide about an interrupted job; reorder, back up
  job submit FILE job show|cancel|edit ... N   one job, from its submission to its end
  history [N]                                  list past jobs: owner, predicted and actual times

People
  lease           lease take|release|ask       show who may move the robot; take, return or request this right
  lease offer NAME                             offer this right to another user
  user            user add|list|token ...      show the current user; manage users and roles

Several robots (over an MQTT broker; see `maya fleet --help`)
  coms [--connect]                             receive steps from remote supervisor programs for this robot
  fleet list      fleet watch [ROBOT]          list the robots, watch them
  fleet send ROBOT COMMAND ...                 send one step
  fleet run FILE                               carry out a process: steps for several robots

Information (no robot needed)
  fk A B C        ik X Y Z                     show the gripper position for joints; the joints for a position
  reach X Y Z                                  check whether the gripper can reach a point
  poses [remove|rename]   pallets [...]        list, remove or rename taught poses and pallets
  record [list]   record show|export           list, show or export recordings
  replay FILE                                  repeat a recording on a twin
  plot workspace [--point X Y Z]               draw the workspace; plot job JOB: draw a job
  config show|check|init                       show, check or create the configuration file
  doctor          logs [--follow]              find faults and remedies; show events and log
  completion bash|zsh|fish                     complete commands in the shell
  calibrate FILE [--apply]                     fit the machine's constants to measured points
  migrate FILE                                 show what to change in scripts of the original Maya; also a folder

Controllers (any DMC-41x3, real or virtual; see `maya dmc --help`)
  dmc serve [--port N] [--speed X]             serve a twin, a virtual DMC-41x3, on TCP and UDP
  dmc fault [NAME [PARAMETER=VALUE...]]        inject a fault into a served twin; without NAME, list the faults
  dmc send HOST[:PORT] CMD...                  send DMC commands to a controller
  dmc terminal [HOST[:PORT]]                   type DMC commands in a terminal that shows the axes
  dmc conform HOST[:PORT] [--moves]            check whether a controller behaves like a DMC-41x3
  dmc find         dmc assign MAC ADDRESS      find controllers; give an address to one that has none
  dmc ip HOST [--set ADDRESS] [--burn]         show or change the address of a controller
  dmc gclib run SCRIPT [ARG...]                run a script written for Galil's gclib

WHERE: sim (default of `up`), real (controller.address of the configuration; default of `commission`), HOST, HOST:PORT,
or a serial port (/dev/ttyUSB0, /dev/ttyUSB0@19200). `stop` takes all but sim; without WHERE it stops the running robot.
A twin is a virtual controller with Maya's mechanics; sim is a twin inside the command.
Every command also takes --json, --lang en|es, --units mm|si and --config FILE; see `maya COMMAND --help`.
Exit codes: 0 done, 1 failed or differences found, 2 refused before it began, 130 interrupted with Ctrl-C."""

QUICK = {
    "status": (
        "Usage: maya status\n\n  Show the state of the running robot.\n\n{everywhere}\n\n  Example: maya status --json"
    ),
    "stop": (
        "Usage: maya stop [--address real|HOST[:PORT]|/dev/ttyUSB0]\n\n"
        "  Stop the running robot: it decelerates along the path.\n\n"
        "  If `maya up` does not answer, or with --address, this command sends the stop\n"
        "  to the controller itself. real is the controller of the configuration.\n\n"
        "{everywhere}\n\n"
        "  Example: maya stop --address 192.168.1.156"
    ),
}
"""Help of the commands that bypass the parser, without the options of every command."""


def quick_help(command: str) -> str:
    """Return the help of a command of `QUICK`."""
    from textwrap import wrap

    return QUICK[command].format(everywhere="\n".join(f"  {line}" for line in wrap(EVERYWHERE, 78)))
