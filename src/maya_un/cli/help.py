"""The pages of help that must not wait for a command parser."""

from __future__ import annotations

EVERYWHERE = "Everywhere: --json, --lang en|es, --config FILE."
"""What holds for every command, said at the end of its help."""

OVERVIEW = """\
maya: the robot Maya, real or virtual.

Start
  up [--address WHERE] [--speed X]             keep a robot running and serve it on loopback
  down [--finish]                              end it, stopping on the path or after the step under way
  run JOB [--dry-run] [--speed X]              carry out a job; without a running robot, on a virtual one
  status                                       what the running robot is doing
  stop [--address WHERE]                       stop now, even if the service hangs
  pause           resume                       hold all motion on its path, go on
  speed RATIO                                  scale the speed of all motion: 50%
  abort                                        stop without deceleration
  recover                                      clear a fault once its cause is gone; moves nothing
  call [OPERATION NAME=VALUE ...]              send any operation of the HTTP interface; list them

Wishes (to the running robot; lengths in m, or 120mm; angles in rad, or 30deg)
  home                                         find the switches and define the position
  pick X Y [Z]    place X Y [Z]                fetch a part, put it down; or pick NAME, place NAME
  approach X Y Z                               go above a place, by the cell's clearance; or approach NAME
  line X Y Z                                   go straight to a place; or line NAME
  gripper open|close
  move A B C      jog AXIS DISTANCE            joint space, or move NAME; along a, b, c, x, y, z or r
  jog                                          the same by keys, on a terminal
  teach NAME      teach-pallet NAME            keep where the gripper is, keep a grid
  zones [list]    zones add|remove NAME ...    what it keeps out of, for this run

Queue
  queue           queue pause|resume|step      what is under way and what waits; pause it, let it go on
  queue recover   queue move|clear|backup ...  what becomes of an interrupted job; put in order, keep
  job submit FILE job show|cancel|edit ... N   one job, from its submission to its end
  history [N]                                  what was done: by whom, what was predicted, what it took

People
  lease           lease take|release|ask       who drives; drive, until Ctrl-C; lease offer NAME hands it on
  user            user add|list|token ...      as whom the robot sees you; who may what

Several robots (over an MQTT broker; `maya fleet --help` tells more)
  coms [--connect]                             carry steps from supervisors to this robot
  fleet list      fleet watch [ROBOT]          which robots there are, what they do
  fleet send ROBOT COMMAND ...                 send one step; fleet run FILE: a process of several robots

Ask (no robot needed)
  fk A B C        ik X Y Z        reach X Y Z
  poses [remove|rename]   pallets [...]        what has been taught
  record [list]   record save|show|export      the last minutes before a fault; replay FILE: again, on a twin
  plot workspace [--point X Y Z]               a picture of what can be reached; plot job JOB: of a job
  config show|check|init
  doctor          logs [--follow]              what is wrong and what to do; what has happened
  completion bash|zsh|fish                     let the shell complete commands
  calibrate FILE [--apply]                     fit the constants to measured points (collect gathers them)

Controllers (any DMC-41x3, real or virtual; `maya dmc --help` names more)
  dmc serve [--port N] [--speed X]             a virtual one with Maya's mechanics, on TCP and UDP
  dmc fault [NAME [PARAMETER=VALUE...]]        make something go wrong with it; without NAME, what can
  dmc send HOST[:PORT] CMD...                  talk to a controller in its own language
  dmc terminal [HOST[:PORT]]                   the same by hand, with the axes in view
  dmc conform HOST[:PORT] [--moves]            does it answer as a DMC-41x3 does
  dmc gclib run SCRIPT [ARG...]                run a script written for Galil's gclib

WHERE: sim (the default), real (the configured controller), HOST or HOST:PORT.
Everywhere: --json, --lang en|es, --config FILE; `maya COMMAND --help` tells more.
Exit codes: 0 done, 1 not carried out, 2 refused as asked, 130 interrupted."""

QUICK = {
    "status": f"Usage: maya status\n\n  Tell what the running robot is doing.\n\n  {EVERYWHERE}",
    "stop": (
        "Usage: maya stop [--address real|HOST[:PORT]]\n\n"
        "  Stop the running robot on its path. If the service does not answer, or with\n"
        f"  --address, the controller is told directly; real is the configured one.\n\n  {EVERYWHERE}"
    ),
}
"""Help of the commands that go past the parser."""
