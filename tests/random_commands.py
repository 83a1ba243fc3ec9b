"""Random input for a controller: valid, nearly valid and invalid commands; programs; bytes.

Everything is drawn from one generator, so that a seed repeats it.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from dmc41x3.language.commands import CONTROL, FORMS
from dmc41x3.twin import registers
from dmc41x3.twin.commands import TABLE

MNEMONICS = sorted({*FORMS, *TABLE} - {"="} - set(CONTROL.values()))
REGISTERS = sorted({*registers.AXIS, *registers.PLANE})
AXES = "ABCDEFGHXYZWMNST"
NAMES = ("v", "x", "q1", "spd", "target", "a", "bc", "qqqqqqqq")
ARRAYS = ("r", "buf", "arr")
LABELS = ("#A", "#B", "#LOOP", "#AUTO", "#LIMSWI", "#POSERR", "#CMDERR", "#MCTIME", "#ININT", "#TCPERR", "#LABEL12")
FUNCTIONS = ("SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ABS", "INT", "FRAC", "RND", "SQR", "COM", "FLOT", "REAL")
BANKS = ("IN", "OUT", "AN")
NUMBERS = ("0", "1", "-1", "2", "5", "100", "1000", "25000", "2147483647", "-2147483648", "9999999999999", "0.0001")
EXTREMES = ("-0.5", "3.7", "1024", "65535", "8388608", "$FF", "$FFFFFFFF.FFFF", "$7FFFFFFF", "15000000", "-30000")
OPERATORS = "+-*/%&|=<>"
PRINTABLE = "".join(map(chr, range(32, 127)))


def line(rng: Random) -> str:
    """Return a line of one or more commands, without its end."""
    return ";".join(command(rng) for _ in range(rng.choice((1, 1, 1, 1, 2, 3))))


def command(rng: Random) -> str:
    """Return one command that the grammar allows, though perhaps not the controller's state."""
    kind = rng.random()
    if kind < 0.35:
        return _useful(rng)
    if kind < 0.45:
        return f"{_target(rng)}={_expression(rng)}"
    if kind < 0.55:
        return "MG " + ",".join(_printed(rng) for _ in range(rng.choice((1, 1, 2, 4))))
    return _any(rng)


def mutated(rng: Random, text: str) -> str:
    """Return a text with a few characters lost, doubled, put in, or changed."""
    characters = list(text)
    for _ in range(rng.choice((1, 1, 2, 5))):
        place = rng.randrange(len(characters) + 1)
        match rng.randrange(4):
            case 0:
                del characters[place : place + rng.choice((1, 1, 3))]
            case 1:
                characters[place:place] = characters[place : place + 4]
            case 2:
                characters[place:place] = rng.choice(PRINTABLE)
            case _:
                characters[place : place + 1] = rng.choice(",;=()[]{}\"'_@#?*~^$<>.-\r\n ")
    return "".join(characters)


def blob(rng: Random) -> bytes:
    """Return bytes of any kind."""
    return rng.randbytes(rng.choice((1, 2, 8, 40, 200)))


def program(rng: Random) -> str:
    """Return a program as it is downloaded, its end included; it may run for ever."""
    lines = [_program_line(rng) for _ in range(rng.choice((1, 3, 8, 20)))]
    lines.insert(0, rng.choice(LABELS))
    return "DL\r" + "\r".join(lines) + "\r\\"


def execution(rng: Random) -> str:
    """Return a command that starts or ends a thread."""
    if rng.random() < 0.2:
        return rng.choice(("HX", "HX0", "HX1", "ST", "AB"))
    return f"XQ {rng.choice((*LABELS[:3], '0', '1'))},{rng.randrange(8)}"


def _program_line(rng: Random) -> str:
    kind = rng.random()
    if kind < 0.2:
        return rng.choice(LABELS)
    if kind < 0.4:
        return _flow(rng)
    text = line(rng)
    return mutated(rng, text).replace("\\", "") if rng.random() < 0.1 else text


def _flow(rng: Random) -> str:
    label = rng.choice(LABELS[:3])
    condition = f"({_expression(rng)})"
    return rng.choice(
        (
            f"JP {label}",
            f"JP {label},{condition}",
            f"JS {label}",
            f"JS {label}(1,2)",
            f"JS {label}(&v)",
            f"IF {condition}",
            "ELSE",
            "ENDIF",
            "EN",
            "EN 1",
            "EN,,5",
            "RE",
            "RI",
            f"WT {rng.choice(('2', '10', '500', '480,1'))}",
            "AM",
            "MCA",
            "ASA",
            "AD 100",
            "AR 100",
            "AP 500",
            "MF 100",
            "MR -100",
            "AV 100",
            "AT 0;AT 10",
            "AI 1",
            "AI -2",
            "ZS",
            "^a=^a+1",
            "v=v+1",
            'MG "x",v',
        )
    )


def _useful(rng: Random) -> str:
    """Return what gets a controller going: motors on, moves, sequences, arrays, records."""
    axis = rng.choice("AAAABBBC" + AXES[:8])
    return rng.choice(
        (
            "SH",
            f"SH{axis}",
            f"MO{axis}",
            f"BG{axis}",
            "BG",
            "BGS",
            "BGT",
            f"ST{axis}",
            "AB 1",
            f"PR{axis}={rng.randrange(-20000, 20000)}",
            f"PA{axis}={rng.randrange(-20000, 20000)}",
            f"JG{axis}={rng.randrange(-50000, 50000)}",
            f"SP{axis}={rng.randrange(0, 200000)}",
            f"AC{axis}={rng.randrange(0, 2000000)}",
            f"DC{axis}={rng.randrange(0, 2000000)}",
            f"DP{axis}={rng.randrange(-1000, 1000)}",
            f"PT{axis}={rng.randrange(2)}",
            f"IP{axis}={rng.randrange(-500, 500)}",
            f"FE{axis}",
            f"HM{axis}",
            f"FI{axis}",
            f"FL{axis}={rng.choice((1000, 2147483647))}",
            f"OE{axis}={rng.randrange(4)}",
            f"ER{axis}={rng.choice((-1, 0, 10, 16384))}",
            f"IT{axis}={rng.choice((0.01, 0.5, 1))}",
            f"CN {rng.choice((-1, 1))}",
            "LMAB",
            "LMABC",
            "VMAB",
            f"LI {rng.randrange(-3000, 3000)},{rng.randrange(-3000, 3000)}",
            f"LI {rng.randrange(-300, 300)},{rng.randrange(-300, 300)}<{rng.randrange(9000)}>{rng.randrange(9000)}",
            f"VP {rng.randrange(-3000, 3000)},{rng.randrange(-3000, 3000)}",
            f"CR {rng.randrange(0, 3000)},{rng.randrange(-400, 400)},{rng.randrange(-400, 400)}",
            "LE",
            "CSS",
            f"VSS={rng.randrange(0, 100000)}",
            f"VRS={rng.choice((0, 0.1, 1, 10))}",
            f"PV{axis}={rng.randrange(-500, 500)},{rng.randrange(-2000, 2000)},{rng.choice((0, 2, 100, 1024))}",
            f"BT{axis}",
            f"CM{axis}",
            f"DT {rng.randrange(-1, 9)}",
            f"CD {rng.randrange(-50, 50)},{rng.randrange(-50, 50)}",
            "CD 0,0=0",
            f"GA{axis}={rng.choice('ABCDSN')}",
            f"GR{axis}={rng.choice((0, 1, -0.5, 3))}",
            f"DM {rng.choice(ARRAYS)}[{rng.choice((1, 10, 1000, 24000))}]",
            f"RA {rng.choice(ARRAYS)}[],{rng.choice(ARRAYS)}[]",
            "RD _TPA,TIME",
            f"RC {rng.randrange(-1, 9)}",
            f"QU {rng.choice(ARRAYS)}[]",
            "UL",
            "LS",
            "LV",
            "QR",
            "TC1",
            "CF I",
            f"CW {rng.randrange(3)}",
            f"DR {rng.choice((0, 8, 100))},{rng.randrange(8)}",
            f"TM {rng.choice((1000, 500, 250, 2000))}",
        )
    )


def _any(rng: Random) -> str:
    name = rng.choice(MNEMONICS)
    gap = rng.choice(("", "", " "))
    kind = rng.random()
    if kind < 0.2:
        return name
    if kind < 0.35:
        return name + gap + "".join(rng.sample(AXES, rng.choice((1, 1, 2, 4))))
    if kind < 0.65:
        return f"{name}{rng.choice((*AXES, '*', '~a'))}={_expression(rng)}"
    return f"{name}{gap or ' '}{','.join(_argument(rng) for _ in range(rng.choice((1, 2, 3, 8))))}"


def _argument(rng: Random) -> str:
    return rng.choice(("", "?", _expression(rng), rng.choice(NUMBERS), rng.choice(EXTREMES), f"{rng.choice(ARRAYS)}[]"))


def _printed(rng: Random) -> str:
    value = _expression(rng)
    return rng.choice(
        (value, value, '"text"', value + "{F4.2}", value + "{$8.4}", value + "{S3}", "{^65}", value + "{N}")
    )


def _target(rng: Random) -> str:
    if rng.random() < 0.3:
        return f"{rng.choice(ARRAYS)}[{rng.choice(('0', '1', '5', '-1', 'v', '99999'))}]"
    return rng.choice((*NAMES, "~a", "~b", "^a"))


def _expression(rng: Random, depth: int = 0) -> str:
    kind = rng.random()
    if depth > 3 or kind < 0.4:
        return _leaf(rng)
    inner = _expression(rng, depth + 1)
    if kind < 0.6:
        return f"{inner}{rng.choice(OPERATORS)}{_leaf(rng)}"
    if kind < 0.8:
        return f"({inner})"
    return f"@{rng.choice(FUNCTIONS)}[{inner}]"


def _leaf(rng: Random) -> str:
    kinds: Sequence[str] = (
        rng.choice(NUMBERS),
        rng.choice(EXTREMES),
        rng.choice(NAMES),
        f"_{rng.choice(MNEMONICS)}{rng.choice((*AXES, *'01234567', '', '', '~a'))}",
        f"_{rng.choice(REGISTERS)}{rng.choice(AXES)}",
        f"@{rng.choice(BANKS)}[{rng.randrange(-1, 18)}]",
        f"{rng.choice(ARRAYS)}[{rng.choice(('0', '3', 'v', '-1'))}]",
        "TIME",
        '"AB"',
    )
    return rng.choice(kinds)
