"""The pages of help that must not wait for a command parser."""

from __future__ import annotations

EVERYWHERE = "Everywhere: --json, --lang en|es, --config FILE."
"""The options of every command, at the end of its help."""

OVERVIEW = """\
maya: the robot Maya, real or virtual.

Start
  up [--address WHERE] [--speed X]             keep a robot running and serve it on loopback
  down [--finish]                              end it: stop on the path, or after the current step
  run JOB [--dry-run] [--speed X]              carry out a job; without a running robot, on a virtual one
  status                                       show the state of the running robot
  stop [--address WHERE]                       stop now, even if the service hangs
  pause           resume                       hold all motion on its path, continue it
  speed RATIO                                  scale the speed of all motion: 50%
  abort                                        stop without deceleration
  recover                                      clear a fault after its cause is removed; moves nothing
  call [OPERATION NAME=VALUE ...]              send any operation of the HTTP interface; list them

Robot (commands to the running one; lengths in m, or 120mm; angles in rad, or 30deg)
  home                                         find the switches and define the position
  pick X Y [Z]    place X Y [Z]                fetch a part, put it down; or pick NAME, place NAME
  approach X Y Z                               move above a place, by the cell's clearance; or approach NAME
  line X Y Z                                   move straight to a place; or line NAME
  gripper open|close
  move A B C      jog AXIS DISTANCE            joint space, or move NAME; along a, b, c, x, y, z or r
  jog                                          the same by keys, on a terminal
  teach NAME      teach-pallet NAME            store the gripper's position, store a grid
  zones [list]    zones add|remove NAME ...    zones to keep out of, for this run

Queue
  queue           queue pause|resume|step      show the queue; pause it, continue it
  queue recover   queue move|clear|backup ...  decide about an interrupted job; reorder, back up
  job submit FILE job show|cancel|edit ... N   one job, from its submission to its end
  history [N]                                  past jobs: user, predicted and actual times

People
  lease           lease take|release|ask       the driver; drive until Ctrl-C; lease offer NAME hands the lease over
  user            user add|list|token ...      current user; users and roles

Several robots (over an MQTT broker; see `maya fleet --help`)
  coms [--connect]                             carry steps from supervisors to this robot
  fleet list      fleet watch [ROBOT]          list the robots, watch them
  fleet send ROBOT COMMAND ...                 send one step; fleet run FILE: a process of several robots

Information (no robot needed)
  fk A B C        ik X Y Z        reach X Y Z
  poses [remove|rename]   pallets [...]        taught places
  record [list]   record save|show|export      the last minutes before a fault; replay FILE on a twin
  plot workspace [--point X Y Z]               draw the workspace; plot job JOB: draw a job
  config show|check|init
  doctor          logs [--follow]              find faults and remedies; show events and log
  completion bash|zsh|fish                     complete commands in the shell
  calibrate FILE [--apply]                     fit the constants to measured points (collect gathers them)

Controllers (any DMC-41x3, real or virtual; see `maya dmc --help`)
  dmc serve [--port N] [--speed X]             serve a virtual one with Maya's mechanics, on TCP and UDP
  dmc fault [NAME [PARAMETER=VALUE...]]        inject a fault into it; without NAME, list the faults
  dmc send HOST[:PORT] CMD...                  talk to a controller in its own language
  dmc terminal [HOST[:PORT]]                   the same in a terminal that shows the axes
  dmc conform HOST[:PORT] [--moves]            check whether it answers as a DMC-41x3
  dmc gclib run SCRIPT [ARG...]                run a script written for Galil's gclib

WHERE: sim (the default), real (the configured controller), HOST or HOST:PORT.
Everywhere: --json, --lang en|es, --config FILE; see `maya COMMAND --help`.
Exit codes: 0 done, 1 not carried out, 2 request refused, 130 interrupted."""

QUICK = {
    "status": f"Usage: maya status\n\n  Show the state of the running robot.\n\n  {EVERYWHERE}",
    "stop": (
        "Usage: maya stop [--address real|HOST[:PORT]]\n\n"
        "  Stop the running robot on its path. If the service does not answer, or with\n"
        f"  --address, the controller is told directly; real is the configured one.\n\n  {EVERYWHERE}"
    ),
}
"""Help of the commands that go past the parser."""
