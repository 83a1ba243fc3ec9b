"""A script for Galil's gclib, run on a virtual controller without a change.

Start one with `maya dmc serve --bench`, then say `maya dmc gclib run examples/04_gclib.py 127.0.0.1:5023`. With
Galil's own module, or after `maya dmc gclib install`, plain `python` runs it. Another address leads to whatever answers
there, so look first what its axes may hit.
"""

import sys

import gclib

PROGRAM = """#SQUARE
side=0
#LOOP
PRA=1000;BGA;AMA
PRB=1000;BGB;AMB
side=side+1
MG "corner",side{F1.0}
JP#LOOP,side<2
EN
"""


def main(address: str) -> None:
    g = gclib.py()
    g.GOpen(f"{address} --direct -s ALL")
    try:
        print(g.GInfo())
        g.GTimeout(2000)

        g.GCommand("SHAB;SP*=20000;DP 0,0")
        g.GCommand("PAA=3000;BGA")
        g.GMotionComplete("A")
        print("after a move:", g.GCommand("TP"))

        try:
            g.GCommand("BGQ")
        except gclib.GclibError as error:
            print("refused:", error, "-", g.GCommand("TC1"))

        g.GProgramDownload(PROGRAM)
        g.GCommand("XQ#SQUARE")
        print(g.GMessage().strip())
        print(g.GMessage().strip())
        g.GMotionComplete("AB")

        g.GCommand("DM points[3]")
        g.GArrayDownload("points", -1, -1, [1, 2.5, -3])
        print("an array:", g.GArrayUpload("points", 1, 2))

        record = g.GRecord("QR")
        print("a record:", record.axis_a_motor_position, record.axis_b_motor_position)
    finally:
        g.GClose()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:5023")
