"""English sentences by code."""

SENTENCES: dict[int, str] = {
    1001: "The connection to the controller at {address} was lost ({reason}). The axes finish what was already "
    "sent; check cable and power, then say `maya recover`.",
    1002: "No controller answers at {address} ({reason}). Check power, cable and address, or start a twin with "
    "`maya dmc serve`.",
    1005: "The device at {address} is {found}; Maya needs a DMC-41x3 with three axes. Check the address.",
    1007: "The controller keeps {register} = {found} where the configuration says {wanted}. Correct one of them.",
    1011: "{node} is not there any more. What it did has been stopped on its path; start it again, and look where "
    "the robot stands before you go on.",
    1020: "Nothing is running here. Start `maya up`, then run the command again. To stop a robot without `maya up`, "
    "run `maya stop --address real` (or HOST:PORT).",
    1021: "The running `maya up` does not answer ({reason}). Use `maya stop` to stop the robot, then restart it.",
    1022: "It is not clear which virtual controller is meant: {reason}. Start `maya dmc serve`, or name with `--twin` one "
    "that runs (now: {running}).",
    1030: "Another running program, {holder}, owns the controller at {address}. Use that program, or end it. If you "
    "cannot, check that the robot is at rest, then take the controller over with `--take-over`.",
    1031: "Another program, {holder}, took the controller over. This program moves nothing any more and keeps its "
    "waiting jobs. Use the other program. When it has ended, run `maya recover` here, then `maya queue resume`.",
    1032: "Axes still move by commands of {holder}, so the controller cannot change its owner now. Wait until they are "
    "at rest, or stop them from any computer with `maya stop --address {address}`. Then try again.",
    1033: "Another program erased the variable that names the owner of the controller (ZAB), so nothing moves. Close the "
    "other program, then run `maya recover`.",
    1050: "The robot's rosbridge at {url} does not answer: {reason}. Start the robot with `maya up --rosbridge`, or set IP to where it is; this program tries again.",
    1051: "The supervisors' server {where} does not answer: {reason}. Check that it runs, and its address, user and password.",
    1052: "The broker {where} refuses the command: {reason}. Ask the person who keeps its rules (ACL) for access to this robot.",
    1053: "Another robot is connected to {where} under the name {name}, so this robot does not connect again. Give each robot its own name (coms.name, NAME), then start this program again.",
    1054: "The rosbridge at {url} belongs to the robot {found!r}, and this program carries the commands of {name}. It sends none there. Give it the address of the rosbridge of {name} (IP, --rosbridge), or give this program and the robot the same name (coms.name, NAME).",
    2101: "{target} cannot be reached: {reason}. Nearest reachable: {nearest}.",
    2102: "The way to {target} leaves the workspace: {reason}. Go there by a point in between.",
    2103: "The robot is not homed, so its position is not known. Say `maya home` first.",
    2104: "The robot is busy ({doing}). Wait until it is done, or say `maya stop`.",
    2105: "The robot is in a fault: {fault} When the cause is gone, say `maya recover`.",
    2106: "The homing was to be skipped, but the controller holds no mark of one since its last reset. "
    "Say `maya home`.",
    2107: "This trajectory is refused: {reason}.",
    2108: "There is no fault to recover from.",
    2109: "The guard cannot be put beside the program in the controller: {reason}.",
    2110: "A program runs in the controller, so no other can be downloaded. End `maya up` where it is Maya's guard, halt "
    "others with HX, and download again.",
    2111: "This cannot be paused: {reason}. Say `maya stop` where something moves that should not.",
    2112: "Nothing is paused, so nothing goes on. What was stopped is begun anew.",
    2201: "Stopped before the end, because somebody said stop.",
    2202: "Cancelled before the end.",
    2301: "Axis {axis} met its {side} limit switch. Look what moved it there, then `maya recover` and home again.",
    2302: "Axis {axis} could not follow its reference and its motor was switched off. Look for an obstacle or "
    "a jammed line, then say `maya recover`.",
    2303: "The abort input is active: somebody pressed the emergency stop. Release it, then say `maya recover`.",
    2304: "The amplifier reports a fault (status {status}). Look at its lights and the power supply, then say "
    "`maya recover`.",
    2305: "Axis {axis} stopped with code {stop_code} ({reason}) though nobody asked for it. Look at the machine, "
    "then say `maya recover`.",
    2306: "The motor of axis {axis} is off. Look at the machine, then say `maya recover`.",
    2307: "The controller was reset, so its position means nothing any more. Say `maya recover`, then `maya home`.",
    2308: "Axis {axis} ended {distance} away from where it was sent. Look at the machine, then say `maya recover`.",
    2309: "The guard in the controller no longer runs, so nothing moves: somebody sent HX, ST or AB, or the controller "
    "was reset. Say `maya recover`.",
    2310: "The guard in the controller stopped the axes, because this program had been silent for too long. See what "
    "keeps this computer busy, then say `maya recover`.",
    2311: "Axis {axis} is {distance} away from where Maya left it. Another program moved it or changed its position "
    "(DP), or somebody pushed it. The homing is no longer valid. Close the other program, if there is one, and let go "
    "of the axis. Run `maya recover`, then home again.",
    2312: "Register {register} of the controller is {found}, but Maya expects {wanted}. Another program changed it. "
    "Motion is safe only with {register} = {wanted}. Close that program, then run `maya recover`, which writes "
    "{wanted} back.",
    2313: "Axis {axis} moves, but Maya did not start this motion. Maya stops it, and the homing is no longer valid. "
    "Close every other program that commands the controller, and let go of the axis. Run `maya recover`, then home "
    "again.",
    2314: "Maya cannot keep the homing: axis {axis} is {distance} away from where Maya left it. Another program moved "
    "it or changed its position, or somebody pushed it. Run `maya home`.",
    2315: "Axis {axis} cannot begin to move. Its {side} limit switch reads active, although the axis is not at the end "
    "of its stroke. Check the switch and its cable, then run `maya recover`.",
    2401: "The {side} limit switch of axis {axis} reads the opposite of what CN {cn} says ({reason}). Correct the "
    "wiring or `limit_active_level` in the configuration.",
    2402: "Axis {axis} stopped following during homing ({reason}). Look for an obstacle, then say `maya recover`.",
    2403: "Axis {axis} went {distance} and met no {side} limit switch. Check the switch and its cable.",
    2404: "The stroke of axis {axis} measures {measured}, the configuration says {wanted}. Check the line and "
    "the configuration.",
    3001: "The gripper is closed, so it cannot pick. Place what it holds or open it first.",
    3002: "The gripper is open, so there is nothing to place. Pick a part first.",
    4002: "The job is refused at {key}: {reason}.",
    4004: "There is no {what} {number}.",
    4006: "`--speed` scales the twin's time; {address} is a real machine. Leave it out.",
    4009: "These points do not tell {what}: {reason}. To tell them, {remedy}.",
    4010: "No {what} is taught under the name {name!r}; there are {known}. `maya teach` keeps the place "
    "where the gripper is.",
    4011: "{name!r} is taught already. Choose another name, or teach it anew with `--replace`.",
    4012: "The idempotency key {key!r} came before with another request. Use a new key for a new request.",
    4013: "Events above {since} are asked for, but the oldest that is kept is {oldest}. Read the state anew, and go on "
    "from there.",
    4014: "Job {number} is {state}, so it cannot be {wish}.",
    4015: "Nobody but a person can know this: {question} Say it by `maya queue recover CHOICE` ({options}).",
    4016: "You are {behind} events behind on this stream, so it was closed. Connect again and go on from event {since}, "
    "and read faster.",
    4017: "Job {number}, on which this one depends, is {state}. Release this one to do it all the same, or cancel it.",
    4018: "{name} cannot be read: {reason}.",
    4019: "There is no {form} called {name}.",
    4020: "The service {service} failed: {reason}.",
    4022: "Job {number} was changed since it was looked at. Look at it again: `maya job show {number}`.",
    4021: "{wish} cannot be said over the ROS graph. Use `maya` beside the robot floor, or `maya up`.",
    4030: "Too many computations run at once (at most {most}). Wait until one has ended, then try again.",
    4031: "This request takes more than {seconds} s of computing. Reduce it: fewer steps, fewer samples, fewer zones.",
    4032: "This request needs more than {most}. Reduce it: fewer steps or fewer samples.",
    4040: "The deadline of this step, {deadline}, has passed. Send it again with a later deadline if it is still needed.",
    4041: "This step is for the robot {robot}, and this robot is {name}. Send it to {robot}.",
    4042: "The robot stopped, or the step before this one failed, so this step did not begin. Look at the robot, then send the step again under another id.",
    4043: "Step {id} of {robot} was interrupted: its program ended. Look at the robot, then decide whether to send the step again under another id.",
    4044: "Step {id} of {robot} failed: {error} ({code}).",
    4045: "The process is refused at {key}: {reason}.",
    4046: "{path} holds the state of another process: the process file has changed since. Put the old file back to go on, or begin anew with --again.",
    4047: "Step {step} of {robot} failed ({code}): {error} Look at the robot, then run the process again with --retry {step}, --skip {step} or --abort.",
    4048: "The process was aborted: {done} of {steps} steps were done. Begin anew with --again.",
    4049: "Another robot with the name {name} took this step before, or this robot took it and has lost its journal since. This robot does not carry it out, and nobody knows how far the step came. Look at the robots. If the step is still needed, send it again under another id.",
    4101: "This needs a valid token: {reason}. Ask an administrator of the robot for one (`maya user token`).",
    4102: "{who} is {role}, and {operation} needs {needed}. Ask somebody who may.",
    4103: "{holder} drives the robot since {since}. Ask for the lease with `maya lease ask`, or wait; `maya stop` works "
    "for everybody.",
    4104: "Only who holds the control lease may say this. Take it with `maya lease take`.",
    4105: "This control lease has ended ({reason}). Take it again with `maya lease take`.",
    4106: "Too many requests ({limit} in {seconds} s are allowed). Wait {wait} s.",
    4110: "The certificate of the service was refused ({reason}). Use the URL that `maya up` printed, and give the "
    "certificate file of the service as `ca`. `maya doctor` checks the certificate's name and dates.",
    5001: "The configuration is refused at {key} = {value}: {reason}.",
    5004: "`maya up`, or the ROS nodes, run already (process {pid}). Use them, or end them first.",
    5006: "No calibration can be taken back in {path}: {reason}.",
    5007: "The disk refused to store this ({reason}), so nothing of it was accepted. Free space on the disk or correct "
    "its permissions, then try again.",
    5008: "{path} is damaged ({reason}); it was left as it is. Put a backup in its place (`maya queue restore`), or move it "
    "away to begin an empty one.",
    5009: "{path} was written by a newer version ({found}; this one knows {known}). Use that version, or another file.",
    5010: "{path} is in use by process {pid}. End that one first, or use another file.",
    5011: "No ROS master answers at {uri}. Start `roscore`, or roslaunch, which starts one; ROS_MASTER_URI says where it is.",
    5012: "ROS cannot be used from here ({reason}). `scripts/ros` sets up what is needed on Debian and Ubuntu.",
    5014: "{path} cannot be opened for writing now ({reason}), so nothing was started. Free space on the disk, or "
    "mount it for writing, then start again. systemd tries again by itself.",
    5020: "The worker process failed ({reason}), so there is no result. Nothing has moved. Try again. If that fails "
    "too, read the log and restart `maya up`.",
}
