"""English sentences by code."""

SENTENCES: dict[int, str] = {
    1001: "The connection to the controller at {address} was lost ({reason}). The axes finish what was already "
    "sent. Check cable and power, then connect again.",
    1002: "No controller answers at {address} ({reason}). Check power, cable and address.",
    1003: "The controller at {address} did not answer {command!r} within {seconds} s. Check the network, or "
    "reset the controller.",
    1004: "The controller refused {command!r} with code {tc} ({reason}). If nobody typed it, check which other program uses this controller.",
    1005: "The device at {address} is {found}; a DMC-41x3 with three axes is needed. Check the address.",
    1006: "The controller answered {command!r} with {reply!r}, which is not valid. Check that the address is that of a Galil controller.",
    1008: "The controller's program differs from the one sent to it in line {line}: {sent} was sent, {found} is there. Download it again. If that does not help, find the other program that writes to this controller.",
    1009: "The controller found its burned {what} damaged when it last powered up. Download and burn them again before any motion.",
    1010: "There is no connection to the controller. Wait for it, or check power and cable.",
    1040: "The download failed ({reason}), and the former program could not be restored. Download a program again "
    "before you run one.",
    2110: "A program runs in the controller, so no other can be downloaded. Halt it with HX, and download again.",
    4001: "{key} = {value} is refused: {reason}.",
    4003: "{name!r} is not known. Known: {known}.",
    4005: "The request is refused at {key}: {reason}.",
    4007: "{path} cannot be read: {reason}.",
    4008: "{reason}. See `{command} --help`.",
    5002: "{path} cannot be written: {reason}.",
    5003: "{address} is in use already. Choose another port, or stop the program that listens there.",
    5005: "{path} belongs to another user: {remedy}.",
    5013: "This process may open {limit} files and connections at once. It has {used} open already, and needs {least} "
    "more. Raise the limit with `ulimit -n 1024`, or with LimitNOFILE=1024 in a systemd unit.",
    5999: "An internal error happened ({reason}). This is a defect of this program: please report it with the traceback.",
}
