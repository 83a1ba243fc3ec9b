"""The data record under the field names of the public header gclib_record.h (structure of the 4000 family)."""

from __future__ import annotations

import struct
from collections.abc import Iterator

_Field = tuple[str, str]

_TYPES = {"UB": "B", "UW": "H", "SW": "h", "SL": "i", "UL": "I"}


def _general() -> Iterator[_Field]:
    yield from ((f"header_{n}", "UB") for n in range(4))
    yield "sample_number", "UW"
    for direction in ("input", "output"):
        yield from ((f"{direction}_bank_{n}", "UB") for n in range(10))
    yield from ((f"reserved_{n}", "SW") for n in range(0, 16, 2))
    yield from ((f"ethernet_status_{letter}", "UB") for letter in "abcdefgh")
    yield from (("error_code", "UB"), ("thread_status", "UB"), ("amplifier_status", "UL"))
    yield from (("contour_segment_count", "UL"), ("contour_buffer_available", "UW"))
    for plane in "st":
        yield f"{plane}_plane_segment_count", "UW"
        yield f"{plane}_plane_move_status", "UW"
        yield f"{plane}_distance", "SL"
        yield f"{plane}_plane_buffer_available", "UW"


_AXIS: tuple[_Field, ...] = (
    ("status", "UW"),
    ("switches", "UB"),
    ("stop_code", "UB"),
    ("reference_position", "SL"),
    ("motor_position", "SL"),
    ("position_error", "SL"),
    ("aux_position", "SL"),
    ("velocity", "SL"),
    ("torque", "SL"),
    ("analog_in", "UW"),
    ("halls", "UB"),
    ("reserved", "UB"),
    ("variable", "SL"),
)


def _places() -> dict[str, tuple[int, str]]:
    axes = ((f"axis_{letter}_{name}", kind) for letter in "abcdefgh" for name, kind in _AXIS)
    places: dict[str, tuple[int, str]] = {}
    offset = 0
    for name, kind in (*_general(), *axes):
        form = f"<{_TYPES[kind]}"
        places[name] = offset, form
        offset += struct.calcsize(form)
    return places


_PLACES = _places()


class GDataRecord:
    """A data record. Its fields are attributes: `sample_number`, `error_code`, `axis_a_motor_position`, ...

    Numbers are the record's own, so velocities are 64 times counts/s and 32767 of torque is 10 V. Those of axes that
    the controller lacks do not exist. `byte_array` holds all of it.
    """

    def __init__(self, data: bytes) -> None:
        self.byte_array = data

    def __getattr__(self, name: str) -> int:
        offset, form = _PLACES.get(name, (len(self.byte_array), "<B"))
        if offset + struct.calcsize(form) > len(self.byte_array):
            raise AttributeError(f"this data record has no field {name!r}")
        return struct.unpack_from(form, self.byte_array, offset)[0]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.fields()]

    def fields(self) -> list[str]:
        """Return the names of all fields of this record, in their order."""
        return [name for name, (offset, _) in _PLACES.items() if offset < len(self.byte_array)]
