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
_GPm ¦ keyword ¦ axes ¦ both ¦  ¦ by how far a geared axis fell behind while its ratio changed
_LFm ¦ keyword ¦ axes ¦ both ¦  ¦ 1 while the forward switch is free, 0 while it is active
_LRm ¦ keyword ¦ axes ¦ both ¦  ¦ 1 while the reverse switch is free, 0 while it is active
- ¦ operator ¦ plain ¦ both ¦  ¦ left value less the right one
; ¦ operator ¦ plain ¦ both ¦  ¦ ends a command; another may follow in the line
' ¦ operator ¦ plain ¦ both ¦  ¦ makes the rest of a line a remark that the program keeps
( ) ¦ operator ¦ plain ¦ both ¦  ¦ makes a part of an expression one value, worked out first
[ ] ¦ operator ¦ own ¦ both ¦  ¦ picks an element of an array; element -1 tells its length
@ABS ¦ function ¦ plain ¦ both ¦  ¦ value without its sign
@ACOS ¦ function ¦ plain ¦ both ¦  ¦ angle whose cosine is the value [°]
@AN ¦ function ¦ own ¦ both ¦  ¦ volts at an analog input
@ASIN ¦ function ¦ plain ¦ both ¦  ¦ angle whose sine is the value [°]
@ATAN ¦ function ¦ plain ¦ both ¦  ¦ angle whose tangent is the value [°]
@COM ¦ function ¦ plain ¦ both ¦  ¦ all 32 bits of the whole part turned over
@COS ¦ function ¦ plain ¦ both ¦  ¦ cosine of an angle in degrees
@FLOT ¦ function ¦ plain ¦ both ¦  ¦ bits that write the value as an IEEE 754 number
@FRAC ¦ function ¦ plain ¦ both ¦  ¦ what stands behind the point
@IN ¦ function ¦ own ¦ both ¦  ¦ level of one digital input
@INT ¦ function ¦ plain ¦ both ¦  ¦ what stands before the point
@OUT ¦ function ¦ own ¦ both ¦  ¦ state of one digital output
@REAL ¦ function ¦ plain ¦ both ¦  ¦ value of an IEEE 754 number given by its bits
@RND ¦ function ¦ plain ¦ both ¦  ¦ nearest whole number
@SIN ¦ function ¦ plain ¦ both ¦  ¦ sine of an angle in degrees
@SQR ¦ function ¦ plain ¦ both ¦  ¦ square root; a sign is dropped first
@TAN ¦ function ¦ plain ¦ both ¦  ¦ tangent of an angle in degrees
* ¦ operator ¦ plain ¦ both ¦  ¦ product of two values
/ ¦ operator ¦ plain ¦ both ¦  ¦ quotient of two values
& (JS arg) ¦ operator ¦ plain ¦ program ¦  ¦ hands a subroutine the variable itself, not its value
& ¦ operator ¦ plain ¦ both ¦  ¦ bits that are set in both values
# ¦ operator ¦ plain ¦ program ¦  ¦ begins a line with a name to jump to, of seven characters at most
#AMPERR ¦ routine ¦ plain ¦ program ¦  ¦ what a program does when an amplifier reports a fault
#AUTO ¦ routine ¦ plain ¦ program ¦  ¦ where the burned program begins by itself after power-up
#AUTOERR ¦ routine ¦ plain ¦ program ¦  ¦ what runs after power-up when burned memory proves damaged
#CMDERR ¦ routine ¦ plain ¦ program ¦  ¦ what a program does about a command that was refused
#COMINT ¦ routine ¦ plain ¦ program ¦  ¦ what a program does about characters on the second serial port
#FWERR ¦ routine ¦ plain ¦ program ¦  ¦ what runs when a servo sample took too long
#ININT ¦ routine ¦ plain ¦ program ¦  ¦ what a program does when an input armed by II changes
#LIMSWI ¦ routine ¦ plain ¦ program ¦  ¦ what a program does when an axis runs into a limit
#MCTIME ¦ routine ¦ plain ¦ program ¦  ¦ what a program does when an encoder does not arrive in time
#POSERR ¦ routine ¦ plain ¦ program ¦  ¦ what a program does when the following error is too large
#TCPERR ¦ routine ¦ plain ¦ program ¦  ¦ what a program does when a connection is found broken
% ¦ operator ¦ plain ¦ both ¦  ¦ what a division leaves over
^a..^h ¦ operator ¦ plain ¦ program ¦  ¦ values local to a subroutine
^L^K ¦ command ¦ plain ¦ host ¦ 0 ¦ protects the program by a password, or opens it again
^R^S ¦ command ¦ plain ¦ host ¦  ¦ forgets everything burned and starts as from the factory
^R^V ¦ command ¦ plain ¦ host ¦  ¦ tells model and firmware
+ ¦ operator ¦ plain ¦ both ¦  ¦ sum of two values
< ¦ operator ¦ plain ¦ both ¦  ¦ 1 where the left value is smaller, else 0
<= ¦ operator ¦ plain ¦ both ¦  ¦ 1 where the left value is not greater, else 0
<> ¦ operator ¦ plain ¦ both ¦  ¦ 1 where two values differ, else 0
= ¦ operator ¦ plain ¦ both ¦  ¦ 1 where two values are the same, else 0
= (assign) ¦ operator ¦ plain ¦ both ¦  ¦ gives a variable a value, or with ? prints it
> ¦ operator ¦ plain ¦ both ¦  ¦ 1 where the left value is greater, else 0
>= ¦ operator ¦ plain ¦ both ¦  ¦ 1 where the left value is not smaller, else 0
| ¦ operator ¦ plain ¦ both ¦  ¦ bits that are set in either value
~a..~h ¦ operator ¦ axes or planes ¦ both ¦  ¦ stands for the axis whose number the variable holds
$ ¦ operator ¦ plain ¦ both ¦  ¦ begins a number in base 16
AB ¦ command ¦ plain ¦ both ¦ 0 ¦ stops everything dead; without an argument of 1 the program too
AC ¦ command ¦ axes ¦ both ¦ 256000 ¦ rate of speeding up [counts/s²]
AD ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an axis has gone so far from its start
AF ¦ command ¦ axes ¦ both ¦ 0 ¦ takes the position from an analog input in place of the encoder
AG ¦ command ¦ axes ¦ both ¦ 1 ¦ gain of the built-in amplifier
AI ¦ trippoint ¦ own ¦ program ¦  ¦ program waits for a level of an input
AL ¦ command ¦ axes ¦ both ¦  ¦ arms what keeps the position when an input or the index comes
AM ¦ trippoint ¦ axes or planes ¦ program ¦ all axes ¦ program waits until profiles have ended
AO ¦ command ¦ own ¦ both ¦  ¦ sets an analog output of a remote device
AP ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an encoder passes a place
AQ ¦ command ¦ own ¦ both ¦ 2 ¦ range and wiring of an analog input
AR ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an axis has gone so far since the last such wait
AS ¦ trippoint ¦ axes or planes ¦ program ¦ all axes ¦ program waits until the set speed is reached
AT ¦ trippoint ¦ plain ¦ program ¦ 0,0 ¦ program waits for a time counted from a mark
AU ¦ command ¦ axes ¦ both ¦ amp-specific ¦ gain of the amplifier's current loop
AV ¦ trippoint ¦ planes ¦ program ¦ 0,0 ¦ program waits until a path has been followed so far
AZ ¦ command ¦ plain ¦ both ¦  ¦ clears errors that an amplifier has stored
BA ¦ command ¦ axes ¦ both ¦  ¦ chooses the axes whose commutation is computed
BC ¦ command ¦ axes ¦ both ¦  ¦ makes the commutation better at a Hall transition
BD ¦ command ¦ axes ¦ both ¦ 6 ¦ phase angle of the commutation [°]
BG ¦ command ¦ axes or planes ¦ both ¦ all axes ¦ begins the motions or sequences that were set up
BI ¦ command ¦ axes ¦ both ¦ 0 ¦ finds the phase from Hall sensors
BK ¦ command ¦ own ¦ host ¦ thread 0 ¦ halts the program at a line, or lets it go on
BL ¦ command ¦ axes ¦ both ¦ -2147483648 ¦ lowest position that a profile may reach
BM ¦ command ¦ axes ¦ both ¦ 2000 ¦ encoder counts in one electrical turn of a motor
BN ¦ command ¦ plain ¦ both ¦  ¦ keeps the settings over power-off; as operand the serial number
BP ¦ command ¦ plain ¦ both ¦  ¦ keeps the program over power-off
BR ¦ command ¦ axes ¦ both ¦ 0 ¦ kind of motor that the amplifier drives
BT ¦ command ¦ axes ¦ both ¦ all axes ¦ begins sequences of position, velocity and time
BV ¦ command ¦ plain ¦ both ¦  ¦ keeps variables and arrays over power-off; as operand the number of axes
BW ¦ command ¦ axes ¦ both ¦ 0 ¦ how long the amplifier outlasts the brake's closing [samples]
BX ¦ command ¦ axes ¦ both ¦ 0 (<1000) ¦ finds the phase of a motor by tiny motion
BZ ¦ command ¦ axes ¦ both ¦ 0 (<200>100) ¦ finds the phase of a motor by driving it to two places
CA ¦ command ¦ planes ¦ both ¦ S ¦ chooses the plane that later sequence commands mean
CB ¦ command ¦ own ¦ both ¦  ¦ switches a digital output off
CC ¦ command ¦ plain ¦ both ¦  ¦ sets up the second serial port
CD ¦ command ¦ axes ¦ both ¦ 0=0 ¦ next steps of a contour
CE ¦ command ¦ axes ¦ both ¦ 0 ¦ kinds of encoders on the two inputs of an axis
CF ¦ command ¦ own ¦ both ¦ S ¦ chooses where messages of a program go
CI ¦ command ¦ plain ¦ both ¦ 0 ¦ what of the second serial port calls the program
CM ¦ command ¦ axes ¦ both ¦  ¦ chooses the axes of contour motion
CN ¦ command ¦ plain ¦ both ¦ -1,-1,-1,0,0 ¦ polarities of switches and latches, and what abort inputs do
CR ¦ command ¦ planes ¦ both ¦  ¦ adds an arc to the sequence
CS ¦ command ¦ planes ¦ both ¦  ¦ empties the buffer of a sequence
CW ¦ command ¦ plain ¦ both ¦ 2,1 ¦ marks messages nobody asked for by their top bit; else the copyright
DA ¦ command ¦ own ¦ both ¦  ¦ gives back memory of variables or arrays
DC ¦ command ¦ axes ¦ both ¦ 256000 ¦ rate of slowing down [counts/s²]
DE ¦ command ¦ axes ¦ both ¦ 0 ¦ sets the counter of the second encoder
DH ¦ command ¦ plain ¦ both ¦ 1 ¦ lets the address come by DHCP
DL ¦ command ¦ own ¦ host ¦ 0 ¦ takes in a program, line by line
DM ¦ command ¦ own ¦ both ¦  ¦ makes arrays
DP ¦ command ¦ axes ¦ both ¦ 0 ¦ sets the counters of an axis without motion
DR ¦ command ¦ plain ¦ both ¦ 0 ¦ sends data records by itself, every so many samples
DT ¦ command ¦ plain ¦ both ¦ 0 ¦ length of one contour step, as a power of two [samples]
DV ¦ command ¦ axes ¦ both ¦ 0 ¦ takes the damping from the second encoder
EA ¦ command ¦ axes ¦ both ¦ N ¦ chooses what a cam follows
EB ¦ command ¦ plain ¦ both ¦ 0 ¦ switches the cam on or off
EC ¦ command ¦ plain ¦ both ¦ 0 ¦ table entry that is set next
ED ¦ command ¦ plain ¦ host ¦ last line ¦ edits single lines; as operand where the last error was
EG ¦ command ¦ axes ¦ both ¦ 0 ¦ lets an axis follow the cam from a place of its master on
EI ¦ command ¦ plain ¦ both ¦ 0,0,-1 ¦ chooses events that are reported by packets
ELSE ¦ command ¦ plain ¦ program ¦  ¦ what happens where the condition of IF fails
EM ¦ command ¦ axes ¦ both ¦  ¦ length of the cycle of an axis [counts]
EN ¦ command ¦ plain ¦ program ¦ 0,0,0 ¦ ends a program, or returns from its subroutine
ENDIF ¦ command ¦ plain ¦ program ¦  ¦ where IF is over
EO ¦ command ¦ plain ¦ both ¦ 1 ¦ echoes characters on serial ports
EP ¦ command ¦ plain ¦ both ¦ 256,0 ¦ distance between table entries of a cam, and where the table begins
EQ ¦ command ¦ axes ¦ both ¦  ¦ lets an axis go from the cam at a place of its master
ER ¦ command ¦ axes ¦ both ¦ 16384 ¦ largest following error that is no fault [counts]
ES ¦ command ¦ planes ¦ both ¦ 1,1 ¦ makes circles of a sequence ellipses
ET ¦ command ¦ axes ¦ both ¦ 0 ¦ sets an entry of a cam's table
EW ¦ command ¦ plain ¦ both ¦ -1,0,-1,0 ¦ gives segments of a cam a width of their own
EY ¦ command ¦ plain ¦ both ¦ 0 ¦ cycles that a cam's master has made
FA ¦ command ¦ axes ¦ both ¦ 0 ¦ motor command in proportion to the profile's acceleration
FE ¦ command ¦ axes ¦ both ¦  ¦ prepares a search for the edge of the home switch
FI ¦ command ¦ axes ¦ both ¦  ¦ prepares a search for the encoder's index
FL ¦ command ¦ axes ¦ both ¦ 2147483647 ¦ highest position that a profile may reach
FV ¦ command ¦ axes ¦ both ¦ 0 ¦ motor command in proportion to the profile's speed
GA ¦ command ¦ axes ¦ both ¦  ¦ chooses what a geared axis follows
GD ¦ command ¦ axes ¦ both ¦ 0 ¦ distance of the master over which a ratio comes into force
GM ¦ command ¦ axes ¦ both ¦ 0 ¦ keeps an axis in gear whatever stops it
GR ¦ command ¦ axes ¦ both ¦ 0 ¦ ratio of a geared axis to its master
HM ¦ command ¦ axes ¦ both ¦ all axes ¦ prepares a full homing; as operand the home switch
HS ¦ command ¦ own ¦ both ¦  ¦ exchanges two connections
HV ¦ command ¦ axes ¦ both ¦ 256 ¦ speed of the slow stages of homing [counts/s]
HX ¦ command ¦ own ¦ both ¦ all threads ¦ ends threads of the program
IA ¦ command ¦ plain ¦ both ¦ 0,0,0,0 (<250) ¦ own address, and how sending is retried
ID ¦ command ¦ plain ¦ both ¦  ¦ tells what the controller is made of
IF ¦ command ¦ plain ¦ program ¦  ¦ does what follows only where a condition holds
IH ¦ command ¦ own ¦ both ¦ TCP ¦ opens or closes connections
II ¦ command ¦ own ¦ both ¦ 0,-,-,0 ¦ lets inputs call the program
IK ¦ command ¦ plain ¦ both ¦ 1 ¦ keeps ordinary ports closed to others
IL ¦ command ¦ axes ¦ both ¦ 9.9982 ¦ most that the integral term may command [V]
IP ¦ command ¦ axes ¦ both ¦  ¦ adds to the target of a motion under way
IT ¦ command ¦ axes ¦ both ¦ 1 ¦ smoothness of profiles, 1 for none
JG ¦ command ¦ axes ¦ both ¦ 25000 ¦ speed, with its sign, of a motion without an end
JP ¦ command ¦ own ¦ program ¦  ¦ goes on elsewhere in the program, where a condition holds
JS ¦ command ¦ own ¦ program ¦  ¦ calls a subroutine; as operand what it gave back
KD ¦ command ¦ axes ¦ both ¦ 64 ¦ gain on the change of the error
KI ¦ command ¦ axes ¦ both ¦ 0 ¦ gain on the sum of the error
KP ¦ command ¦ axes ¦ both ¦ 6 ¦ gain on the error
KS ¦ command ¦ axes ¦ both ¦ 2 ¦ smoothness of a stepper's pulses [samples]
LA ¦ command ¦ plain ¦ both ¦  ¦ prints names and lengths of arrays
LC ¦ command ¦ axes ¦ both ¦ 0 ¦ lowers a stepper's current at rest
LD ¦ command ¦ axes ¦ both ¦ 0 ¦ ignores limit switches
LE ¦ command ¦ planes ¦ both ¦  ¦ ends a sequence of lines in a controlled way
LI ¦ command ¦ axes ¦ both ¦ 0 ¦ adds a line to the sequence
LL ¦ command ¦ plain ¦ both ¦  ¦ prints the labels of the program
LM ¦ command ¦ axes ¦ both ¦  ¦ chooses the axes of a sequence of lines
LS ¦ command ¦ own ¦ host ¦ 0,1999 ¦ prints lines of the program
LV ¦ command ¦ plain ¦ both ¦  ¦ prints variables
LZ ¦ command ¦ plain ¦ both ¦ 1 ¦ prints numbers without zeros in front
MB ¦ command ¦ own ¦ both ¦ unit=handle ¦ speaks Modbus to another device
MC ¦ trippoint ¦ axes ¦ program ¦ all axes ¦ program waits until encoders have arrived
ME ¦ command ¦ plain ¦ both ¦ 0 ¦ lets Modbus masters write into arrays
MF ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an encoder passes a place going up
MG ¦ command ¦ own ¦ both ¦  ¦ prints texts and values
MO ¦ command ¦ axes ¦ both ¦ all axes ¦ switches motors off
MR ¦ trippoint ¦ axes ¦ program ¦  ¦ program waits until an encoder passes a place going down
MT ¦ command ¦ axes ¦ both ¦ 1 ¦ kind of motor, and the sense of its turning
MU ¦ command ¦ plain ¦ both ¦ 239,255,19,56 ¦ address of the group that looks for controllers
MW ¦ command ¦ plain ¦ both ¦ 1 ¦ waits for the answer of a Modbus device
NB ¦ command ¦ axes ¦ both ¦ 0.5 ¦ width of the notch filter [Hz]
NF ¦ command ¦ axes ¦ both ¦ 0 ¦ frequency of the notch filter [Hz]
NO ¦ command ¦ plain ¦ both ¦  ¦ does nothing; as operand the threads that run
NZ ¦ command ¦ axes ¦ both ¦ 0 ¦ depth of the notch filter
OA ¦ command ¦ axes ¦ both ¦ 0 ¦ switches a motor off whose encoder seems dead
OB ¦ command ¦ own ¦ both ¦  ¦ sets a digital output by an expression
OC ¦ command ¦ axes ¦ both ¦  ¦ gives a pulse where an axis passes a place
OE ¦ command ¦ axes ¦ both ¦ 0 ¦ chooses what switches a motor off
OF ¦ command ¦ axes ¦ both ¦ 0 ¦ constant part of the motor command [V]
OP ¦ command ¦ plain ¦ both ¦ 0 ¦ sets digital outputs all at once
OT ¦ command ¦ axes ¦ both ¦ 30 ¦ how long an encoder may stand still under command [samples]
OV ¦ command ¦ axes ¦ both ¦ 0.9438 ¦ motor command from which an encoder has to move [V]
P2CD ¦ keyword ¦ plain ¦ both ¦  ¦ what happened last on the second serial port
P2CH ¦ keyword ¦ plain ¦ both ¦  ¦ last character from the second serial port
P2NM ¦ keyword ¦ plain ¦ both ¦  ¦ last number from the second serial port
P2ST ¦ keyword ¦ plain ¦ both ¦  ¦ last text from the second serial port
PA ¦ command ¦ axes ¦ both ¦ 0 ¦ place to go to; as operand where the axis last stopped
PF ¦ command ¦ plain ¦ both ¦ 10.0 ¦ how positions are printed
PL ¦ command ¦ axes ¦ both ¦ 0 ¦ pole of the low-pass filter
PR ¦ command ¦ axes ¦ both ¦  ¦ distance to go
PT ¦ command ¦ axes ¦ both ¦ 0 ¦ lets a new target count at once, without BG
PV ¦ command ¦ axes ¦ both ¦ 0,0,0 ¦ adds a point of position, velocity and time
PW ¦ command ¦ plain ¦ host ¦ empty ¦ sets the password
QD ¦ command ¦ own ¦ host ¦ whole array ¦ fills an array with numbers that follow
QH ¦ command ¦ axes ¦ both ¦ all axes ¦ what Hall sensors read
QQ ¦ command ¦ plain ¦ both ¦  ¦ forgets that a sample took too long
QR ¦ command ¦ axes or planes ¦ both ¦ ABCDEFGHSTI ¦ gives the data record once
QS ¦ command ¦ axes ¦ both ¦ all axes ¦ steps by which a stepper's encoder is behind
QU ¦ command ¦ own ¦ both ¦ whole array, CR ¦ prints an array
QZ ¦ command ¦ plain ¦ both ¦  ¦ tells how the data record is laid out
RA ¦ command ¦ own ¦ both ¦  ¦ chooses arrays to record into
RC ¦ command ¦ plain ¦ both ¦ 0,0 ¦ records every so many samples
RD ¦ command ¦ own ¦ both ¦  ¦ chooses what is recorded
RE ¦ command ¦ plain ¦ program ¦ 0 ¦ returns from the subroutine of a fault
REM ¦ keyword ¦ plain ¦ neither ¦  ¦ remark that never reaches the controller
RI ¦ command ¦ plain ¦ program ¦ 0 ¦ returns from the subroutine of an input
RL ¦ command ¦ axes ¦ both ¦ all axes ¦ position that a latch kept
RP ¦ command ¦ axes ¦ both ¦ all axes ¦ where axes are commanded to be
RS ¦ command ¦ plain ¦ host ¦ 0 ¦ restarts with the burned memory
SB ¦ command ¦ own ¦ both ¦  ¦ switches a digital output on
SC ¦ command ¦ axes ¦ both ¦ all axes ¦ why axes stand or move
SD ¦ command ¦ axes ¦ both ¦ 256000 ¦ rate of slowing down at a limit [counts/s²]
SH ¦ command ¦ axes ¦ both ¦ all axes ¦ switches motors on where they are
SL ¦ command ¦ plain ¦ host ¦ 1 ¦ executes so many lines of a halted program
SM ¦ command ¦ plain ¦ both ¦ 0,0,0,0 ¦ mask of the network
SP ¦ command ¦ axes ¦ both ¦ 25000 ¦ speed of moves to a place [counts/s]
ST ¦ command ¦ axes or planes ¦ both ¦ all axes ¦ slows motions down to rest
TA ¦ command ¦ plain ¦ both ¦  ¦ errors of the amplifiers
TB ¦ command ¦ plain ¦ both ¦  ¦ state of the program in one byte
TC ¦ command ¦ plain ¦ both ¦ 0 ¦ why the last command was refused
TD ¦ command ¦ axes ¦ both ¦ all axes ¦ counter of the second encoder, or a stepper's steps
TE ¦ command ¦ axes ¦ both ¦ all axes ¦ following error
TH ¦ command ¦ plain ¦ both ¦  ¦ prints the connections
TI ¦ command ¦ own ¦ both ¦ 0 ¦ eight digital inputs at once
TIME ¦ keyword ¦ plain ¦ both ¦  ¦ samples since power-up
TK ¦ command ¦ axes ¦ both ¦ 0 ¦ motor command that is allowed for a moment [V]
TL ¦ command ¦ axes ¦ both ¦ 9.9982 ¦ largest motor command [V]
TM ¦ command ¦ plain ¦ both ¦ 1000 ¦ time between servo samples [µs]
TN ¦ command ¦ planes ¦ both ¦ 0,0 ¦ how an axis is kept tangential to a path
TP ¦ command ¦ axes ¦ both ¦ all axes ¦ where encoders are
TR ¦ command ¦ plain ¦ both ¦ 0,255 ¦ prints the lines of the program as they are executed
TS ¦ command ¦ axes ¦ both ¦ all axes ¦ switches and state of an axis in one byte
TT ¦ command ¦ axes ¦ both ¦ all axes ¦ motor command [V]
TV ¦ command ¦ axes ¦ both ¦ all axes ¦ velocity over the last quarter of a second [counts/s]
TW ¦ command ¦ axes ¦ both ¦ 32766 ¦ how long encoders may take to arrive [ms]
TZ ¦ command ¦ plain ¦ both ¦  ¦ prints digital inputs and outputs
UI ¦ command ¦ plain ¦ both ¦ 0 ¦ sends an event of the user's own
UL ¦ command ¦ plain ¦ host ¦  ¦ prints the whole program; as operand the variables that are free
US ¦ command ¦ plain ¦ both ¦ 0 ¦ exchanges the two serial ports
VA ¦ command ¦ planes ¦ both ¦ 256000 ¦ rate of speeding up along a path [counts/s²]
VD ¦ command ¦ planes ¦ both ¦ 256000 ¦ rate of slowing down along a path [counts/s²]
VE ¦ command ¦ planes ¦ both ¦ 0 ¦ ends a vector sequence in a controlled way
VF ¦ command ¦ plain ¦ both ¦ 10.4 ¦ how variables are printed
VM ¦ command ¦ axes ¦ both ¦  ¦ chooses the axes of a plane
VP ¦ command ¦ planes ¦ both ¦ 0,0 ¦ adds a straight line to a point of the plane
VR ¦ command ¦ planes ¦ both ¦ 1,1 ¦ factor on the speed along a path, at once
VS ¦ command ¦ planes ¦ both ¦ 25000 ¦ speed along a path [counts/s]
VV ¦ command ¦ planes ¦ both ¦ 0 ¦ speed of segments that ask for a variable one [counts/s]
WH ¦ command ¦ plain ¦ host ¦  ¦ tells over which connection one is talking
WT ¦ trippoint ¦ plain ¦ program ¦ -,0 ¦ program waits for a time
XQ ¦ command ¦ own ¦ both ¦ 0,0 ¦ starts the program at a label or line
YA ¦ command ¦ axes ¦ both ¦ 2 ¦ microsteps of a full step
YB ¦ command ¦ axes ¦ both ¦ 200 ¦ full steps of a turn
YC ¦ command ¦ axes ¦ both ¦ 4000 ¦ encoder counts of a turn
YR ¦ command ¦ axes ¦ both ¦ 0 ¦ moves a stepper by the steps it lost
YS ¦ command ¦ axes ¦ both ¦ 0 ¦ watches whether a stepper keeps its place
ZA ¦ command ¦ axes ¦ both ¦ 0 ¦ number of the user's own in the data record
ZS ¦ command ¦ plain ¦ program ¦ 0 ¦ forgets where subroutines would return to
"""


def _read(line: str) -> CatalogueEntry:
    name, kind, arguments, where, default, purpose = (part.strip() for part in line.split("¦"))
    return CatalogueEntry(name, EntryKind(kind), Arguments(arguments), EntryContext(where), default, purpose)


CATALOGUE = MappingProxyType({entry.name: entry for entry in map(_read, _TABLE.strip().splitlines())})
"""Every entry by its name."""
