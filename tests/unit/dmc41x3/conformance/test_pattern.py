from __future__ import annotations

import pytest

from dmc41x3.conformance.runner import compiled, literal


@pytest.mark.parametrize(
    ("text", "right", "wrong"),
    [
        (" 5.0000\r\n:", b" 5.0000\r\n:", b"5.0000\r\n:"),
        ("a.b*\r\n:", b"a.b*\r\n:", b"aXb*\r\n:"),
        ("<n>\r\n:", b"-12\r\n:", b" 1.5\r\n:"),
        ("<n>\r\n:", b" 12\r\n:", b"  12\r\n:"),
        ("<v>\r\n:", b"-0.5000\r\n:", b" 5\r\n:"),
        ("< >7", b" 7", b"  7"),
        ("< >7", b"7", b"-7"),
        ("<2..4>", b" 3", b" 5"),
        ("<-1.5..1.5>", b"-1.4999", b"-1.5001"),
        ("IH<handle>", b"IHH", b"IHI"),
        ("<line>:", b"anything?:", b"two\r\nlines:"),
        ("<lines>:", b"two\r\nlines:", b"no end"),
        ("1<<2", b"1<2", b"1<<2"),
        ("DMC41<axes>3", b"DMC4133", b"DMC4143"),
        ("\u00e8\u008d", b"\xe8\x8d", b"h\r"),
    ],
)
def test_pattern_accepts_and_refuses_replies(text: str, right: bytes, wrong: bytes) -> None:
    pattern = compiled(text, 3)
    assert pattern.matches(right)
    assert not pattern.matches(wrong)


def test_two_ranges_belong_to_their_own_numbers() -> None:
    pattern = compiled("<1..2>,<10..20>\r\n:", 3)
    assert pattern.matches(b" 1, 10\r\n:")
    assert not pattern.matches(b" 10, 1\r\n:")


@pytest.mark.parametrize(("data", "end"), [(b": 4\r\n:", 1), (b":", 1), (b"?", -1), (b"", -1)])
def test_reply_ends_at_the_start_of_the_next(data: bytes, end: int) -> None:
    assert compiled(":", 3).begins(data) == end


def test_undefined_name_is_an_error_in_the_table() -> None:
    with pytest.raises(ValueError, match="stands for nothing"):
        compiled("<nonsense>", 3)


def test_literal_characters() -> None:
    assert literal(" 1.0000\r\n:")
    assert not literal("<n>\r\n:")
