"""Error codes (TC), stop codes (SC), and the state of the burned memories (_RS).

Error texts are those that the controller prints; firmware versions differ in capitals, so compare numbers.
The texts of stop codes are this project's.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from dmc41x3.i18n import phrase


class ErrorCode(IntEnum):
    """Error codes of TC that this project raises or checks."""

    NONE = 0
    UNRECOGNIZED_COMMAND = 1
    PROGRAM_ONLY = 2
    NOT_IN_PROGRAM = 3
    OPERAND_ERROR = 4
    INPUT_BUFFER_FULL = 5
    OUT_OF_RANGE = 6
    NOT_WHILE_RUNNING = 7
    NOT_WHILE_NOT_RUNNING = 8
    VARIABLE_ERROR = 9
    UNDEFINED_LABEL = 10
    INVALID_LABEL = 11
    TOO_DEEP = 12
    JOG_ONLY_IN_JOG_MODE = 13
    CHECKSUM = 14
    WRITE = 15
    IP_WRONG_SIGN = 16
    NOT_WHILE_PROGRAM_RUNS = 17
    NOT_WHILE_CONTOURING = 18
    THREAD_EXECUTING = 19
    BEGIN_MOTOR_OFF = 20
    BEGIN_WHILE_RUNNING = 21
    BEGIN_AT_LIMIT = 22
    NO_SEQUENCE = 24
    S_OPERAND_INVALID = 28
    NOT_IN_COORDINATED_MOVE = 29
    SEGMENT_TOO_SHORT = 30
    SEQUENCE_TOO_LONG = 31
    SEGMENT_BUFFER_FULL = 32
    SEGMENT_KINDS_MIXED = 33
    NO_TIME = 39
    CONTOUR_RANGE = 41
    CONTOUR_STARVED = 42
    GEAR_MASTER_IS_SLAVE = 46
    NOT_ENOUGH_FIELDS = 50
    QUESTION_MARK_INVALID = 51
    BAD_STRING = 52
    BAD_BRACES = 53
    MISSING_BRACKET = 55
    INDEX_OUT_OF_RANGE = 56
    BAD_FUNCTION = 57
    BAD_OPERAND = 58
    PARENTHESES = 59
    DOWNLOAD_ERROR = 60
    BAD_LABEL = 61
    TOO_MANY_LABELS = 62
    IF_WITHOUT_ENDIF = 63
    ARRAY_SPACE_FULL = 66
    TOO_MANY_VARIABLES = 67
    RECORDING = 80
    NO_RECORDING_SOURCE = 81
    UNDEFINED_ARRAY = 82
    NOT_A_NUMBER = 83
    TOO_MANY_ELEMENTS = 84
    INVALID_AXIS = 90
    CAM_RUNS = 100
    CAM_INDEX = 101
    CAM_WITHOUT_MASTER = 102
    CAM_MODULUS = 103
    NOT_IN_CAM = 104
    CAM_NOT_ENABLED = 105
    PRIVILEGE = 106
    NO_HALLS = 110
    NOT_BRUSHLESS = 111
    NOT_FOR_STEPPER = 119
    TCP_LOST = 123
    HANDLE_IN_USE = 124
    HANDLE_CLOSED = 126
    HANDLE_MUST_BE_UDP = 133
    ALL_MOTORS_MUST_BE_OFF = 134
    MOTOR_MUST_BE_OFF = 135
    WRONG_PASSWORD = 136
    WRONG_LOCK = 137
    PASSWORDS_DIFFER = 138
    NOT_SUPPORTED = 141
    NOT_INITIALISED = 161
    NOT_WITH_DHCP = 163


ERROR_TEXTS: dict[int, str] = {
    1: "Unrecognized command",
    2: "Command only valid from program",
    3: "Command not valid in program",
    4: "Operand error",
    5: "Input buffer full",
    6: "Number out of range",
    7: "Command not valid while running",
    8: "Command not valid while not running",
    9: "Variable error",
    10: "Empty program line or undefined label",
    11: "Invalid label or line number",
    12: "Subroutine more than 16 deep",
    13: "JG only valid when running in jog mode",
    14: "EEPROM check sum error",
    15: "EEPROM write error",
    16: "IP incorrect sign during position move or IP given during forced deceleration",
    17: "ED, BN and DL not valid while program running",
    18: "Command not valid when contouring",
    19: "Application strand already executing",
    20: "Begin not valid with motor off",
    21: "Begin not valid while running",
    22: "Begin not possible due to Limit Switch",
    24: "Begin not valid because no sequence defined",
    25: "Variable not given in IN command",
    28: "S operand not valid",
    29: "Not valid during coordinated move",
    30: "Sequence Segment Too Short",
    31: "Total move distance in a sequence > 2 billion",
    32: "Segment buffer full",
    33: "VP or CR commands cannot be mixed with LI commands",
    39: "No time specified",
    41: "Contouring record range error",
    42: "Contour data being sent too slowly",
    46: "Gear axis both master and follower",
    50: "Not enough fields",
    51: "Question mark not valid",
    52: 'Missing " or string too long',
    53: "Error in {}",
    54: "Question mark part of string",
    55: "Missing [ or []",
    56: "Array index invalid or out of range",
    57: "Bad function or array",
    58: "Bad command response",
    59: "Mismatched parentheses",
    60: "Download error - line too long or too many lines",
    61: "Duplicate or bad label",
    62: "Too many labels",
    63: "IF statement without ENDIF",
    66: "Array space full",
    67: "Too many arrays or variables",
    80: "Record mode already running",
    81: "No array or source specified",
    82: "Undefined Array",
    83: "Not a valid number",
    84: "Too many elements",
    90: "Only A B C D valid operand",
    97: "Bad Binary Command Format",
    98: "Binary Commands not valid in application program",
    99: "Bad binary command number",
    100: "Not valid when running ECAM",
    101: "Improper index into ET",
    102: "No master axis defined for ECAM",
    103: "Master axis modulus greater than 256 EP value",
    104: "Not valid when axis performing ECAM",
    105: "EB1 command must be given first",
    106: "Privilege Violation",
    110: "No hall effect sensors detected",
    111: "Must be made brushless by BA command",
    112: "BZ command timeout",
    113: "No movement in BZ command",
    114: "BZ command runaway",
    118: "Controller has GL1600 not GL1800",
    119: "Not valid for axis configured as stepper",
    120: "Bad Ethernet transmit",
    121: "Bad Ethernet packet received",
    123: "TCP lost sync",
    124: "Ethernet handle already in use",
    125: "No ARP response from IP address",
    126: "Closed Ethernet handle",
    127: "Illegal Modbus function code",
    128: "IP address not valid",
    130: "Remote IO command error",
    131: "Serial Port Timeout",
    132: "Analog inputs not present",
    133: "Command not valid when locked / Handle must be UDP",
    134: "All motors must be in MO for this command",
    135: "Motor must be in MO",
    136: "Invalid Password",
    137: "Invalid lock setting",
    138: "Passwords not identical",
    140: "Serial encoder error",
    141: "Feature not supported",
    143: "TM timed out",
    144: "Incompatible with encoder type",
    160: "BX failure",
    161: "Sine amp axis not initialized",
    163: "IA command not valid when DHCP mode enabled",
    164: "Exceeded maximum sequence length, BGS or BGT is required",
    165: "Cannot have both SINE and SSI feedback enabled at once",
    166: "Unable to set analog output",
}
"""Text of every error code, as TC 1 prints it; clients match on it (Galil's command reference, TC)."""


class StopCode(IntEnum):
    """Why an axis rests or decelerates (SC). It is set when deceleration begins; BG shows whether motion has ended."""

    RUNNING = 0
    COMMANDED = 1
    FORWARD_LIMIT = 2
    REVERSE_LIMIT = 3
    STOPPED = 4
    ABORT_INPUT = 6
    ABORTED = 7
    OFF_ON_ERROR = 8
    FOUND_EDGE = 9
    HOMED = 10
    SELECTIVE_ABORT = 11
    ENCODER_FAILURE = 12
    AMPLIFIER_FAULT = 15
    STEPPER_ERROR = 16
    PVT_RUNNING = 30
    PVT_DONE = 31
    PVT_STARVED = 32
    SAMPLE_OVERFLOW = 41
    CONTOUR_RUNNING = 50
    CONTOUR_STOPPED = 51
    CAM_RUNNING = 60
    CAM_STOPPED = 61
    MC_TIMEOUT = 99
    SEQUENCE_RUNNING = 100
    SEQUENCE_DONE = 101


STOP_TEXTS: dict[int, str] = {
    0: phrase("running"),
    1: phrase("arrived where commanded"),
    2: phrase("forward limit"),
    3: phrase("reverse limit"),
    4: phrase("stopped by ST"),
    6: phrase("abort input"),
    7: phrase("aborted by AB"),
    8: phrase("following error, motor switched off"),
    9: phrase("found the home edge"),
    10: phrase("homed or found the index"),
    11: phrase("selective abort input"),
    12: phrase("encoder failure"),
    15: phrase("amplifier fault"),
    16: phrase("stepper lost its position"),
    30: phrase("running a PVT sequence"),
    31: phrase("PVT sequence complete"),
    32: phrase("PVT sequence ran out of segments"),
    41: phrase("sample overflow"),
    50: phrase("contouring"),
    51: phrase("contour stopped"),
    60: phrase("following a cam"),
    61: phrase("cam stopped"),
    70: phrase("EtherCAT motion running"),
    71: phrase("EtherCAT motion stopped"),
    99: phrase("encoder did not arrive in time"),
    100: phrase("running a vector sequence"),
    101: phrase("vector sequence complete"),
}
"""Text of every stop code of SC."""


_VARIABLES, _PARAMETERS, _PROGRAM, _MASTER = 1, 2, 4, 8


@dataclass(frozen=True, slots=True)
class Burned:
    """Whether each memory passed its checksum: parameters (BN), program (BP), variables and arrays (BV).

    `master` is False after a failed master reset.
    """

    parameters: bool = True
    program: bool = True
    variables: bool = True
    master: bool = True

    @classmethod
    def of(cls, bits: int) -> Burned:
        """Return the state in `_RS`: bit 0 variables, 1 parameters, 2 program, 3 master reset; set means an error."""
        return cls(
            parameters=not bits & _PARAMETERS,
            program=not bits & _PROGRAM,
            variables=not bits & _VARIABLES,
            master=not bits & _MASTER,
        )

    @property
    def damaged(self) -> tuple[str, ...]:
        """Names of the damaged memories."""
        sound = {
            phrase("parameters"): self.parameters,
            phrase("program"): self.program,
            phrase("variables"): self.variables,
            phrase("master reset"): self.master,
        }
        return tuple(name for name, holds in sound.items() if not holds)
