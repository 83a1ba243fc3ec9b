"""The language of a DMC-41x3 in one table: commands, operators, functions, keywords, routines.

The terminal's help and the documentation are made from it. The facts are those of Galil's command reference
(DMC-41x3); the wording is this project's.
"""

from __future__ import annotations

from enum import Enum
from types import MappingProxyType
from typing import NamedTuple


class EntryKind(Enum):
    """Kind of an entry of the language."""

    COMMAND = "command"
    TRIPPOINT = "trippoint"
    FUNCTION = "function"
    OPERATOR = "operator"
    KEYWORD = "keyword"
    ROUTINE = "routine"


class Arguments(Enum):
    """Form of the arguments: by axes, by axes or planes, by planes, plain, or specific to the entry."""

    AXES = "axes"
    AXES_OR_PLANES = "axes or planes"
    PLANES = "planes"
    PLAIN = "plain"
    OWN = "own"


class EntryContext(Enum):
    """Context in which an entry may be used."""

    BOTH = "both"
    HOST = "host"
    PROGRAM = "program"
    NEITHER = "neither"


class CatalogueEntry(NamedTuple):
    """One entry; `default` is the controller's default value, empty if it has none."""

    name: str
    kind: EntryKind
    arguments: Arguments
    where: EntryContext
    default: str
    purpose: str


_TABLE = """
_GPm ¦ keyword ¦ axes ¦ both ¦  ¦ lag of a geared axis from the change of its ratio [counts]
_LFm ¦ keyword ¦ axes ¦ both ¦  ¦ 1 while the forward switch is free, 0 while it is active
_LRm ¦ keyword ¦ axes ¦ both ¦  ¦ 1 while the reverse switch is free, 0 while it is active
- ¦ operator ¦ plain ¦ both ¦  ¦ left value minus the right one
; ¦ operator ¦ plain ¦ both ¦  ¦ separates commands on a line
' ¦ operator ¦ plain ¦ both ¦  ¦ begins a comment that the program stores
( ) ¦ operator ¦ plain ¦ both ¦  ¦ groups a part of an expression, which is evaluated first
[ ] ¦ operator ¦ own ¦ both ¦  ¦ selects an element of an array; element -1 returns its length
@ABS ¦ function ¦ plain ¦ both ¦  ¦ absolute value
@ACOS ¦ function ¦ plain ¦ both ¦  ¦ arc cosine of the value [°]
@AN ¦ function ¦ own ¦ both ¦  ¦ voltage at an analog input [V]
@ASIN ¦ function ¦ plain ¦ both ¦  ¦ arc sine of the value [°]
@ATAN ¦ function ¦ plain ¦ both ¦  ¦ arc tangent of the value [°]
@COM ¦ function ¦ plain ¦ both ¦  ¦ bitwise complement of the integer part, 32 bits
@COS ¦ function ¦ plain ¦ both ¦  ¦ cosine of an angle [°]
@FLOT ¦ function ¦ plain ¦ both ¦  ¦ IEEE 754 bits of the value
@FRAC ¦ function ¦ plain ¦ both ¦  ¦ fractional part of the value
@IN ¦ function ¦ own ¦ both ¦  ¦ level of one digital input
@INT ¦ function ¦ plain ¦ both ¦  ¦ integer part of the value
@OUT ¦ function ¦ own ¦ both ¦  ¦ state of one digital output
@REAL ¦ function ¦ plain ¦ both ¦  ¦ value of an IEEE 754 number given by its bits
@RND ¦ function ¦ plain ¦ both ¦  ¦ value rounded to the nearest integer
@SIN ¦ function ¦ plain ¦ both ¦  ¦ sine of an angle [°]
@SQR ¦ function ¦ plain ¦ both ¦  ¦ square root of the absolute value
@TAN ¦ function ¦ plain ¦ both ¦  ¦ tangent of an angle [°]
* ¦ operator ¦ plain ¦ both ¦  ¦ product of two values
/ ¦ operator ¦ plain ¦ both ¦  ¦ quotient of two values
& (JS arg) ¦ operator ¦ plain ¦ program ¦  ¦ passes a variable to a subroutine by reference
& ¦ operator ¦ plain ¦ both ¦  ¦ bitwise AND of two values
# ¦ operator ¦ plain ¦ program ¦  ¦ begins a label of at most seven characters
#AMPERR ¦ routine ¦ plain ¦ program ¦  ¦ runs when an amplifier reports a fault
#AUTO ¦ routine ¦ plain ¦ program ¦  ¦ runs after power-up, from the burned program
#AUTOERR ¦ routine ¦ plain ¦ program ¦  ¦ runs after power-up if the burned memory is damaged
#CMDERR ¦ routine ¦ plain ¦ program ¦  ¦ runs when the controller refuses a command of the program
#COMINT ¦ routine ¦ plain ¦ program ¦  ¦ runs when characters arrive on the second serial port
#FWERR ¦ routine ¦ plain ¦ program ¦  ¦ runs when a servo sample takes too long
#ININT ¦ routine ¦ plain ¦ program ¦  ¦ runs when an input armed by II changes
#LIMSWI ¦ routine ¦ plain ¦ program ¦  ¦ runs when an axis reaches a limit
#MCTIME ¦ routine ¦ plain ¦ program ¦  ¦ runs when an encoder does not reach its target in time
#POSERR ¦ routine ¦ plain ¦ program ¦  ¦ runs when the following error is too large
#TCPERR ¦ routine ¦ plain ¦ program ¦  ¦ runs when a connection is broken
% ¦ operator ¦ plain ¦ both ¦  ¦ remainder of a division
^a..^h ¦ operator ¦ plain ¦ program ¦  ¦ local variables of a subroutine
^L^K ¦ command ¦ plain ¦ host ¦ 0 ¦ locks the program with a password, or unlocks it
^R^S ¦ command ¦ plain ¦ host ¦  ¦ erases the burned memory and restarts with factory settings
^R^V ¦ command ¦ plain ¦ host ¦  ¦ prints the model and the firmware
+ ¦ operator ¦ plain ¦ both ¦  ¦ sum of two values
< ¦ operator ¦ plain ¦ both ¦  ¦ 1 if the left value is smaller, else 0
<= ¦ operator ¦ plain ¦ both ¦  ¦ 1 if the left value is not greater, else 0
<> ¦ operator ¦ plain ¦ both ¦  ¦ 1 if two values differ, else 0
= ¦ operator ¦ plain ¦ both ¦  ¦ 1 if two values are equal, else 0
= (assign) ¦ operator ¦ plain ¦ both ¦  ¦ assigns a value to a variable, or with ? prints it
> ¦ operator ¦ plain ¦ both ¦  ¦ 1 if the left value is greater, else 0
>= ¦ operator ¦ plain ¦ both ¦  ¦ 1 if the left value is not smaller, else 0
| ¦ operator ¦ plain ¦ both ¦  ¦ bitwise OR of two values
~a..~h ¦ operator ¦ axes or planes ¦ both ¦  ¦ axis whose number the variable holds
$ ¦ operator ¦ plain ¦ both ¦  ¦ begins a hexadecimal number
AB ¦ command ¦ plain ¦ both ¦ 0 ¦ stops all motion without deceleration; also ends the program, unless the argument is 1
AC ¦ command ¦ axes ¦ both ¦ 256000 ¦ acceleration [counts/s²]
AD ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an axis has moved a distance from its start
AF ¦ command ¦ axes ¦ both ¦ 0 ¦ takes the position from an analog input instead of the encoder
AG ¦ command ¦ axes ¦ both ¦ 1 ¦ gain of the built-in amplifier
AI ¦ trippoint ¦ own ¦ program ¦  ¦ program waits for a level of an input
AL ¦ command ¦ axes ¦ both ¦  ¦ arms the latch, which stores the position at an edge of an input or the index
AM ¦ trippoint ¦ axes or planes ¦ program ¦ all axes ¦ program waits until profiles end
AO ¦ command ¦ own ¦ both ¦  ¦ sets an analog output of a remote device
AP ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an encoder passes a position
AQ ¦ command ¦ own ¦ both ¦ 2 ¦ range and wiring of an analog input
AR ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an axis has moved a distance since the last such wait
AS ¦ trippoint ¦ axes or planes ¦ program ¦ all axes ¦ program waits until the motion reaches its set speed
AT ¦ trippoint ¦ plain ¦ program ¦ 0,0 ¦ program waits for a time from a reference time
AU ¦ command ¦ axes ¦ both ¦ amp-specific ¦ gain of the amplifier's current loop
AV ¦ trippoint ¦ planes ¦ program ¦ 0,0 ¦ program waits until the motion has covered a distance along a path
AZ ¦ command ¦ plain ¦ both ¦  ¦ clears stored errors of an amplifier
BA ¦ command ¦ axes ¦ both ¦  ¦ selects the axes with sinusoidal commutation
BC ¦ command ¦ axes ¦ both ¦  ¦ corrects the commutation at a Hall transition
BD ¦ command ¦ axes ¦ both ¦ 6 ¦ phase angle of the commutation [°]
BG ¦ command ¦ axes or planes ¦ both ¦ all axes ¦ starts the prepared motions or sequences
BI ¦ command ¦ axes ¦ both ¦ 0 ¦ finds the commutation phase from Hall sensors
BK ¦ command ¦ own ¦ host ¦ thread 0 ¦ halts the program at a line, or continues it
BL ¦ command ¦ axes ¦ both ¦ -2147483648 ¦ lowest position of a profile: reverse software limit [counts]
BM ¦ command ¦ axes ¦ both ¦ 2000 ¦ encoder counts per electrical revolution of a motor
BN ¦ command ¦ plain ¦ both ¦  ¦ burns the settings; operand: the serial number
BP ¦ command ¦ plain ¦ both ¦  ¦ burns the program
BR ¦ command ¦ axes ¦ both ¦ 0 ¦ type of motor that the amplifier drives
BT ¦ command ¦ axes ¦ both ¦ all axes ¦ starts sequences of position, velocity and time
BV ¦ command ¦ plain ¦ both ¦  ¦ burns variables and arrays; operand: the number of axes
BW ¦ command ¦ axes ¦ both ¦ 0 ¦ delay from closing the brake to switching off the amplifier [samples]
BX ¦ command ¦ axes ¦ both ¦ 0 (<1000) ¦ finds the commutation phase by a tiny motion
BZ ¦ command ¦ axes ¦ both ¦ 0 (<200>100) ¦ finds the commutation phase by driving the motor to two positions
CA ¦ command ¦ planes ¦ both ¦ S ¦ selects the plane of later sequence commands
CB ¦ command ¦ own ¦ both ¦  ¦ switches a digital output off
CC ¦ command ¦ plain ¦ both ¦  ¦ configures the second serial port
CD ¦ command ¦ axes ¦ both ¦ 0=0 ¦ next steps of a contour
CE ¦ command ¦ axes ¦ both ¦ 0 ¦ types of the two encoders of an axis
CF ¦ command ¦ own ¦ both ¦ S ¦ selects the port for messages of a program
CI ¦ command ¦ plain ¦ both ¦ 0 ¦ selects the input of the second serial port that interrupts the program
CM ¦ command ¦ axes ¦ both ¦  ¦ selects the axes of contour motion
CN ¦ command ¦ plain ¦ both ¦ -1,-1,-1,0,0 ¦ polarities of switches and latches, and the effect of abort inputs
CR ¦ command ¦ planes ¦ both ¦  ¦ adds an arc to the sequence
CS ¦ command ¦ planes ¦ both ¦  ¦ clears the buffer of a sequence
CW ¦ command ¦ plain ¦ both ¦ 2,1 ¦ sets the top bit of unsolicited messages; without an argument, prints the copyright
DA ¦ command ¦ own ¦ both ¦  ¦ deletes variables or arrays
DC ¦ command ¦ axes ¦ both ¦ 256000 ¦ deceleration [counts/s²]
DE ¦ command ¦ axes ¦ both ¦ 0 ¦ sets the counter of the second encoder
DH ¦ command ¦ plain ¦ both ¦ 1 ¦ gets the address by DHCP
DL ¦ command ¦ own ¦ host ¦ 0 ¦ downloads a program, line by line
DM ¦ command ¦ own ¦ both ¦  ¦ creates arrays
DP ¦ command ¦ axes ¦ both ¦ 0 ¦ sets the counters of an axis without motion
DR ¦ command ¦ plain ¦ both ¦ 0 ¦ sends data records automatically at an interval [samples]
DT ¦ command ¦ plain ¦ both ¦ 0 ¦ duration of a contour step, as a power of two [samples]
DV ¦ command ¦ axes ¦ both ¦ 0 ¦ takes the damping from the second encoder
EA ¦ command ¦ axes ¦ both ¦ N ¦ selects the master of a cam
EB ¦ command ¦ plain ¦ both ¦ 0 ¦ switches the cam on or off
EC ¦ command ¦ plain ¦ both ¦ 0 ¦ index of the next entry of the cam table
ED ¦ command ¦ plain ¦ host ¦ last line ¦ edits single lines; operand: the line of the last error
EG ¦ command ¦ axes ¦ both ¦ 0 ¦ engages an axis in the cam at a position of the master
EI ¦ command ¦ plain ¦ both ¦ 0,0,-1 ¦ selects the events that the controller reports by packets
ELSE ¦ command ¦ plain ¦ program ¦  ¦ begins the commands that run if the condition of IF is false
EM ¦ command ¦ axes ¦ both ¦  ¦ length of the cam cycle of an axis [counts]
EN ¦ command ¦ plain ¦ program ¦ 0,0,0 ¦ ends a program, or returns from a subroutine
ENDIF ¦ command ¦ plain ¦ program ¦  ¦ ends the commands of IF
EO ¦ command ¦ plain ¦ both ¦ 1 ¦ echoes characters on serial ports
EP ¦ command ¦ plain ¦ both ¦ 256,0 ¦ distance between entries of the cam table, and position of the first entry
EQ ¦ command ¦ axes ¦ both ¦  ¦ disengages an axis from the cam at a position of the master
ER ¦ command ¦ axes ¦ both ¦ 16384 ¦ largest permitted following error [counts]
ES ¦ command ¦ planes ¦ both ¦ 1,1 ¦ scales the circles of a sequence to ellipses
ET ¦ command ¦ axes ¦ both ¦ 0 ¦ sets an entry of the cam table
EW ¦ command ¦ plain ¦ both ¦ -1,0,-1,0 ¦ sets the width of single cam segments
EY ¦ command ¦ plain ¦ both ¦ 0 ¦ number of completed cycles of the cam master
FA ¦ command ¦ axes ¦ both ¦ 0 ¦ acceleration feedforward of the motor command
FE ¦ command ¦ axes ¦ both ¦  ¦ prepares a search for the edge of the home switch
FI ¦ command ¦ axes ¦ both ¦  ¦ prepares a search for the encoder's index
FL ¦ command ¦ axes ¦ both ¦ 2147483647 ¦ highest position of a profile: forward software limit [counts]
FV ¦ command ¦ axes ¦ both ¦ 0 ¦ velocity feedforward of the motor command
GA ¦ command ¦ axes ¦ both ¦  ¦ selects the master of a geared axis
GD ¦ command ¦ axes ¦ both ¦ 0 ¦ distance of the master over which a gear ratio takes effect
GM ¦ command ¦ axes ¦ both ¦ 0 ¦ gantry mode: stops do not take an axis out of gear
GR ¦ command ¦ axes ¦ both ¦ 0 ¦ gear ratio of an axis to its master
HM ¦ command ¦ axes ¦ both ¦ all axes ¦ prepares a full homing; operand: the home switch
HS ¦ command ¦ own ¦ both ¦  ¦ exchanges two connections
HV ¦ command ¦ axes ¦ both ¦ 256 ¦ speed of the slow stages of homing [counts/s]
HX ¦ command ¦ own ¦ both ¦ all threads ¦ ends threads of the program
IA ¦ command ¦ plain ¦ both ¦ 0,0,0,0 (<250) ¦ IP address of the controller, and the settings of its retries
ID ¦ command ¦ plain ¦ both ¦  ¦ prints the hardware of the controller
IF ¦ command ¦ plain ¦ program ¦  ¦ runs the next commands only if a condition holds
IH ¦ command ¦ own ¦ both ¦ TCP ¦ opens or closes connections
II ¦ command ¦ own ¦ both ¦ 0,-,-,0 ¦ selects the inputs that interrupt the program
IK ¦ command ¦ plain ¦ both ¦ 1 ¦ closes ordinary ports to other clients
IL ¦ command ¦ axes ¦ both ¦ 9.9982 ¦ limit of the integral term [V]
IP ¦ command ¦ axes ¦ both ¦  ¦ adds to the target of a running motion
IT ¦ command ¦ axes ¦ both ¦ 1 ¦ smoothing of profiles; 1 disables it
JG ¦ command ¦ axes ¦ both ¦ 25000 ¦ speed of a jog; its sign is the direction [counts/s]
JP ¦ command ¦ own ¦ program ¦  ¦ jumps to another place in the program if a condition holds
JS ¦ command ¦ own ¦ program ¦  ¦ calls a subroutine; operand: its return value
KD ¦ command ¦ axes ¦ both ¦ 64 ¦ derivative gain of the position loop
KI ¦ command ¦ axes ¦ both ¦ 0 ¦ integral gain of the position loop
KP ¦ command ¦ axes ¦ both ¦ 6 ¦ proportional gain of the position loop
KS ¦ command ¦ axes ¦ both ¦ 2 ¦ smoothing of the pulses of a stepper [samples]
LA ¦ command ¦ plain ¦ both ¦  ¦ prints names and lengths of arrays
LC ¦ command ¦ axes ¦ both ¦ 0 ¦ reduces the current of a stepper at rest
LD ¦ command ¦ axes ¦ both ¦ 0 ¦ disables limit switches
LE ¦ command ¦ planes ¦ both ¦  ¦ ends a sequence of lines with deceleration
LI ¦ command ¦ axes ¦ both ¦ 0 ¦ adds a line to the sequence
LL ¦ command ¦ plain ¦ both ¦  ¦ prints the labels of the program
LM ¦ command ¦ axes ¦ both ¦  ¦ selects the axes of a sequence of lines
LS ¦ command ¦ own ¦ host ¦ 0,1999 ¦ prints lines of the program
LV ¦ command ¦ plain ¦ both ¦  ¦ prints variables
LZ ¦ command ¦ plain ¦ both ¦ 1 ¦ prints numbers without leading zeros
MB ¦ command ¦ own ¦ both ¦ unit=handle ¦ sends Modbus requests to another device
MC ¦ trippoint ¦ axes ¦ program ¦ all axes ¦ program waits until encoders reach their targets
ME ¦ command ¦ plain ¦ both ¦ 0 ¦ lets Modbus masters write to arrays
MF ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an encoder passes a position in the forward direction
MG ¦ command ¦ own ¦ both ¦  ¦ prints texts and values
MO ¦ command ¦ axes ¦ both ¦ all axes ¦ switches motors off
MR ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an encoder passes a position in the reverse direction
MT ¦ command ¦ axes ¦ both ¦ 1 ¦ type of motor, and its direction
MU ¦ command ¦ plain ¦ both ¦ 239,255,19,56 ¦ multicast address for finding controllers
MW ¦ command ¦ plain ¦ both ¦ 1 ¦ waits for the answer of a Modbus device
NB ¦ command ¦ axes ¦ both ¦ 0.5 ¦ width of the notch filter [Hz]
NF ¦ command ¦ axes ¦ both ¦ 0 ¦ frequency of the notch filter [Hz]
NO ¦ command ¦ plain ¦ both ¦  ¦ does nothing; operand: the running threads
NZ ¦ command ¦ axes ¦ both ¦ 0 ¦ depth of the notch filter
OA ¦ command ¦ axes ¦ both ¦ 0 ¦ switches a motor off if its encoder seems to have failed
OB ¦ command ¦ own ¦ both ¦  ¦ sets a digital output to the value of an expression
OC ¦ command ¦ axes ¦ both ¦  ¦ outputs a pulse when an axis passes a position
OE ¦ command ¦ axes ¦ both ¦ 0 ¦ selects the errors that switch a motor off
OF ¦ command ¦ axes ¦ both ¦ 0 ¦ offset of the motor command [V]
OP ¦ command ¦ plain ¦ both ¦ 0 ¦ sets all digital outputs at once
OT ¦ command ¦ axes ¦ both ¦ 30 ¦ longest standstill of an encoder under command [samples]
OV ¦ command ¦ axes ¦ both ¦ 0.9438 ¦ motor command at which an encoder must move [V]
P2CD ¦ keyword ¦ plain ¦ both ¦  ¦ last event on the second serial port
P2CH ¦ keyword ¦ plain ¦ both ¦  ¦ last character from the second serial port
P2NM ¦ keyword ¦ plain ¦ both ¦  ¦ last number from the second serial port
P2ST ¦ keyword ¦ plain ¦ both ¦  ¦ last text from the second serial port
PA ¦ command ¦ axes ¦ both ¦ 0 ¦ absolute target position; operand: the position of the last stop
PF ¦ command ¦ plain ¦ both ¦ 10.0 ¦ format of printed positions
PL ¦ command ¦ axes ¦ both ¦ 0 ¦ pole of the low-pass filter
PR ¦ command ¦ axes ¦ both ¦  ¦ relative distance of a move
PT ¦ command ¦ axes ¦ both ¦ 0 ¦ position tracking: a new target takes effect at once, without BG
PV ¦ command ¦ axes ¦ both ¦ 0,0,0 ¦ adds a point of position, velocity and time
PW ¦ command ¦ plain ¦ host ¦ empty ¦ sets the password
QD ¦ command ¦ own ¦ host ¦ whole array ¦ fills an array with the numbers that follow
QH ¦ command ¦ axes ¦ both ¦ all axes ¦ state of the Hall sensors
QQ ¦ command ¦ plain ¦ both ¦  ¦ clears the record of a sample that took too long
QR ¦ command ¦ axes or planes ¦ both ¦ ABCDEFGHSTI ¦ sends one data record
QS ¦ command ¦ axes ¦ both ¦ all axes ¦ lost steps of a stepper, measured by its encoder
QU ¦ command ¦ own ¦ both ¦ whole array, CR ¦ prints an array
QZ ¦ command ¦ plain ¦ both ¦  ¦ prints the layout of the data record
RA ¦ command ¦ own ¦ both ¦  ¦ selects the arrays for recording
RC ¦ command ¦ plain ¦ both ¦ 0,0 ¦ starts recording at an interval of samples
RD ¦ command ¦ own ¦ both ¦  ¦ selects the data for recording
RE ¦ command ¦ plain ¦ program ¦ 0 ¦ returns from the routine of a fault
REM ¦ keyword ¦ plain ¦ neither ¦  ¦ comment that is not sent to the controller
RI ¦ command ¦ plain ¦ program ¦ 0 ¦ returns from the routine of an input
RL ¦ command ¦ axes ¦ both ¦ all axes ¦ position that the latch stored
RP ¦ command ¦ axes ¦ both ¦ all axes ¦ commanded position of axes
RS ¦ command ¦ plain ¦ host ¦ 0 ¦ restarts the controller with the burned memory
SB ¦ command ¦ own ¦ both ¦  ¦ switches a digital output on
SC ¦ command ¦ axes ¦ both ¦ all axes ¦ stop code: reason why an axis stands still or moves
SD ¦ command ¦ axes ¦ both ¦ 256000 ¦ deceleration at a limit [counts/s²]
SH ¦ command ¦ axes ¦ both ¦ all axes ¦ switches motors on at their present position
SL ¦ command ¦ plain ¦ host ¦ 1 ¦ executes a number of lines of a halted program
SM ¦ command ¦ plain ¦ both ¦ 0,0,0,0 ¦ subnet mask
SP ¦ command ¦ axes ¦ both ¦ 25000 ¦ speed of moves to a position [counts/s]
ST ¦ command ¦ axes or planes ¦ both ¦ all axes ¦ stops motions with deceleration
TA ¦ command ¦ plain ¦ both ¦  ¦ errors of the amplifiers
TB ¦ command ¦ plain ¦ both ¦  ¦ state of the program in one byte
TC ¦ command ¦ plain ¦ both ¦ 0 ¦ reason why the last command was refused
TD ¦ command ¦ axes ¦ both ¦ all axes ¦ counter of the second encoder, or a stepper's steps
TE ¦ command ¦ axes ¦ both ¦ all axes ¦ following error
TH ¦ command ¦ plain ¦ both ¦  ¦ prints the connections
TI ¦ command ¦ own ¦ both ¦ 0 ¦ state of eight digital inputs
TIME ¦ keyword ¦ plain ¦ both ¦  ¦ samples since power-up
TK ¦ command ¦ axes ¦ both ¦ 0 ¦ short-term limit of the motor command [V]
TL ¦ command ¦ axes ¦ both ¦ 9.9982 ¦ limit of the motor command [V]
TM ¦ command ¦ plain ¦ both ¦ 1000 ¦ time between servo samples [µs]
TN ¦ command ¦ planes ¦ both ¦ 0,0 ¦ keeps an axis tangential to a path
TP ¦ command ¦ axes ¦ both ¦ all axes ¦ encoder position of axes
TR ¦ command ¦ plain ¦ both ¦ 0,255 ¦ prints program lines during execution
TS ¦ command ¦ axes ¦ both ¦ all axes ¦ switches and state of an axis in one byte
TT ¦ command ¦ axes ¦ both ¦ all axes ¦ motor command [V]
TV ¦ command ¦ axes ¦ both ¦ all axes ¦ velocity over the last quarter of a second [counts/s]
TW ¦ command ¦ axes ¦ both ¦ 32766 ¦ longest time for encoders to reach their targets [ms]
TZ ¦ command ¦ plain ¦ both ¦  ¦ prints digital inputs and outputs
UI ¦ command ¦ plain ¦ both ¦ 0 ¦ sends a user-defined event
UL ¦ command ¦ plain ¦ host ¦  ¦ prints the whole program; operand: the number of free variables
US ¦ command ¦ plain ¦ both ¦ 0 ¦ exchanges the two serial ports
VA ¦ command ¦ planes ¦ both ¦ 256000 ¦ acceleration along a path [counts/s²]
VD ¦ command ¦ planes ¦ both ¦ 256000 ¦ deceleration along a path [counts/s²]
VE ¦ command ¦ planes ¦ both ¦ 0 ¦ ends a vector sequence with deceleration
VF ¦ command ¦ plain ¦ both ¦ 10.4 ¦ format of printed variables
VM ¦ command ¦ axes ¦ both ¦  ¦ selects the axes of a plane
VP ¦ command ¦ planes ¦ both ¦ 0,0 ¦ adds a straight line to a point of the plane
VR ¦ command ¦ planes ¦ both ¦ 1,1 ¦ speed factor along a path, effective at once
VS ¦ command ¦ planes ¦ both ¦ 25000 ¦ speed along a path [counts/s]
VV ¦ command ¦ planes ¦ both ¦ 0 ¦ speed of segments with variable speed [counts/s]
WH ¦ command ¦ plain ¦ host ¦  ¦ prints the connection of the command
WT ¦ trippoint ¦ plain ¦ program ¦ -,0 ¦ program waits for a time
XQ ¦ command ¦ own ¦ both ¦ 0,0 ¦ starts the program at a label or line
YA ¦ command ¦ axes ¦ both ¦ 2 ¦ microsteps per full step
YB ¦ command ¦ axes ¦ both ¦ 200 ¦ full steps per revolution
YC ¦ command ¦ axes ¦ both ¦ 4000 ¦ encoder counts per revolution
YR ¦ command ¦ axes ¦ both ¦ 0 ¦ moves a stepper by its lost steps
YS ¦ command ¦ axes ¦ both ¦ 0 ¦ monitors the position of a stepper
ZA ¦ command ¦ axes ¦ both ¦ 0 ¦ user-defined number in the data record
ZS ¦ command ¦ plain ¦ program ¦ 0 ¦ clears the return addresses of subroutines
"""


def _read(line: str) -> CatalogueEntry:
    name, kind, arguments, where, default, purpose = (part.strip() for part in line.split("¦"))
    return CatalogueEntry(name, EntryKind(kind), Arguments(arguments), EntryContext(where), default, purpose)


CATALOGUE = MappingProxyType({entry.name: entry for entry in map(_read, _TABLE.strip().splitlines())})
"""Every entry by its name."""
