"""The commands that only read; `twin/test_reading.py` sends them to a virtual controller."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.catalogue import CATALOGUE, EntryContext
from dmc41x3.language.commands import FORMS, parse
from dmc41x3.language.reading import QUERIES, REPORTS, only_reads

READING = [
    "TP", "TP A", "TPAB", "tp".upper(), "TE", "TI 1", "TH", "LV", "MG _TPA", "MG TIME, _TPA", "MG @IN[1]{F8.0}",
    "MG (_TPA+2)*3", "KP ?", "KP ?,,?", "KPA=?", "PA ,?", "speed=?", "speed=", "path[3]=?",
]  # fmt: skip
CHANGING = [
    "", "BGA", "BG ?", "ST", "AB", "SHA", "MO", "SB 1", "OB 1,1", "KPA=5", "KP 5", "KP ?,5", "PA 1000", "DP 0", "x=5",
    "a[0]=3", "XQ #A", "HX", "RS", "BN", "DL", "UL", "QU a", "QR", "TC", "TC1", "TPA=3", "WT 5", "CF I", "CW 1", "EO 1",
    'MG "x"', "MG{P1} _TPA", "MG _TPA{N}", "MG _TPA{S4}", "MG", "TP;BGA", "TP\rBGA", "TP\nBGA", "TP'BGA", "'", "TM 500",
    "IHA=1,2,3,4", "ENDIF", "JG ?", "TPß", "MG " + "1+" * 40, "II 1", "^R^S", "\x12\x13", "DA *", "LI 1,2<?>?",
]  # fmt: skip


@pytest.mark.parametrize("text", READING)
def test_reading_command_is_accepted(text: str) -> None:
    assert only_reads(text)


@pytest.mark.parametrize("text", CHANGING)
def test_other_text_is_refused(text: str) -> None:
    assert not only_reads(text)


def test_every_name_is_one_of_the_language_and_allowed_from_a_host() -> None:
    for name in REPORTS | QUERIES:
        assert name in FORMS
        assert CATALOGUE[name].where in {EntryContext.BOTH, EntryContext.HOST}


@given(st.sampled_from(sorted(FORMS.keys() - REPORTS - {"MG"})), st.text("ABC =0123456789,.-#*", max_size=12))
def test_command_of_a_motion_or_a_value_is_never_taken_for_reading(name: str, rest: str) -> None:
    text = name + rest
    if only_reads(text):
        assert parse(text).mnemonic == "="
        assert text.rstrip().endswith("=")
