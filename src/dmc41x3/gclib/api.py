"""The class that scripts use: `g = gclib.py()`, `g.GCommand("TP")`; its data records and array files.

Methods have the names, arguments and results of gclib's methods. Their docstrings state the differences.
"""

from __future__ import annotations

import re
import struct
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest
from math import isfinite
from pathlib import Path

from dmc41x3 import __version__
from dmc41x3.errors import CodedError
from dmc41x3.files import write
from dmc41x3.gclib.errors import Code, GclibError
from dmc41x3.gclib.session import GclibSession, guarded, parse
from dmc41x3.language import transfer
from dmc41x3.language import transfer as programs
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.hardware import LONGEST_PERIOD, SHORTEST_PERIOD
from dmc41x3.language.transfer import prepared

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

    Numbers are raw values of the record: velocities are 64 times counts/s, and a torque of 32767 is 10 V. Fields of
    axes that the controller lacks do not exist. `byte_array` holds the whole record.
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


def read_text(path: str) -> str:
    """Return the text of a file; raises `GclibError` (-10005)."""
    try:
        return Path(path).read_text(encoding="ascii")
    except (OSError, UnicodeError) as error:
        raise GclibError(Code.FILE, str(error)) from error


def write_text(path: str, text: str) -> None:
    """Write a file; raises `GclibError` (-10005)."""
    try:
        write(Path(path), text, encoding="ascii")
    except (CodedError, UnicodeError) as error:
        raise GclibError(Code.FILE, str(error)) from error


def table_of(text: str) -> dict[str, list[float]]:
    """Return the arrays that a CSV table holds; an empty cell ends a column. Raises `GclibError` (-10005)."""
    heads, *rows = [line.split(",") for line in text.splitlines() if line.strip()] or [[""]]
    names = [head.strip().removesuffix("[]") for head in heads]
    try:
        columns = [
            [float(cell) for cell in column if cell.strip()] for column in list(zip_longest(*rows, fillvalue=""))
        ]
    except ValueError as error:
        raise GclibError(Code.FILE, str(error)) from error
    if len(columns) != len(names) or not all(columns):
        raise GclibError(Code.FILE, "a column without name or numbers")
    return dict(zip(names, columns, strict=True))


def text_of(table: Mapping[str, list[float]]) -> str:
    """Return arrays as a CSV table; shorter ones end in empty cells."""
    rows = zip_longest(*([f"{value:.4f}" for value in values] for values in table.values()), fillvalue="")
    return "".join(f"{','.join(cells)}\n" for cells in (tuple(table), *rows))


G_QR, G_DR = 0, 1
"""Methods to get a record, by gclib's numbers."""

G_BOUNDS = -1
"""Index for the first or the last element of an array."""

_COMMANDS = re.compile(r"[;\r\n]")
_COMPRESSION = re.compile(r"(?:\s*--(?:min|max)\s+[0-9])*\s*")
_ARRAY = re.compile(r"(\w+)\[[0-9]+\]")
_FIRMWARE = "\x12\x16"
_SAMPLES_IN_MS = 1.024
_LOOK = 10


class py:  # noqa: N801 - the name that scripts know
    """One connection to a controller. Every method that communicates raises `GclibError`."""

    def __init__(self) -> None:
        self._session: GclibSession | None = None

    def __del__(self) -> None:
        self.GClose()

    def GOpen(self, address: str) -> None:
        """Connect to `address`; `dmc41x3.gclib.session` describes its syntax.

        Without a second socket, messages arrive on the first one; records and interrupts do not arrive.
        """
        options = parse(address)
        self.GClose()
        self._session = GclibSession(options)

    def GClose(self) -> None:
        """End the connection; idempotent."""
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def GCommand(self, command: str) -> str:
        """Send a command and return its output, without line end and surrounding blanks.

        Commands joined by `;` are sent one after the other, and line ends join their outputs; the first rejection
        raises -10000. DL, ED, QD and QR have their own methods; here they raise -1106.
        """
        session = self._open()
        pieces = [piece.strip(" \t") for piece in _COMMANDS.split(command)]
        printed = [session.text(piece) for piece in pieces if piece] if any(pieces) else [session.text("")]
        return "\r\n".join(filter(None, printed))

    def GTimeout(self, timeout: int) -> None:
        """Set the longest wait [ms]; -1 means that of GOpen. With 0, GMessage, GRecord and GInterrupt do not wait."""
        if not -1 <= timeout <= 65535:
            raise GclibError(Code.VALUE_RANGE, f"a timeout is -1 to 65535 ms, not {timeout}")
        self._open().timeout = timeout

    @property
    def timeout(self) -> int:
        """The longest wait [ms] as last set; -1 means that of GOpen."""
        return -1 if self._session is None else self._session.timeout

    @timeout.setter
    def timeout(self, timeout: int) -> None:
        self.GTimeout(timeout)

    def GSleep(self, val: int) -> None:
        """Wait `val` [ms]."""
        threading.Event().wait(val / 1000.0)

    def GVersion(self) -> str:
        """Return the name and version of this library."""
        return f"py.{__version__} (maya-un)"

    def GInfo(self) -> str:
        """Return address, firmware, serial number and handles: `10.0.0.3, DMC4133 Rev 1.3k, 291, IHA IHB`."""
        session = self._open()
        handles = session.text("WH") if session.second is None else f"{session.text('WH')} IH{session.second.letter}"
        return f"{session.options.host}, {session.text(_FIRMWARE)}, {int(session.number('_BN'))}, {handles}"

    def GAddresses(self) -> dict[str, str]:
        """Return the connected controller and its firmware; does not search the network."""
        return {} if self._session is None else {self._session.options.host: self._session.text(_FIRMWARE)}

    def GIpRequests(self) -> dict[str, str]:
        """Return an empty dictionary: this library does not listen for controllers that request an address."""
        return {}

    def GAssign(self, ip: str, mac: str) -> None:
        """Raise -1109: this library does not assign addresses."""
        raise GclibError(Code.UNSUPPORTED_FUNCTION, f"{mac} was not given {ip}")

    def GFirmwareDownload(self, file_path: str) -> None:
        """Raise -1110: this library does not load firmware."""
        raise GclibError(Code.FIRMWARE_LOAD_NOT_SUPPORTED, file_path)

    def GSetupDownloadFile(self, file_path: str, options: int) -> dict[str, str]:
        """Raise -1109: this library does not read backups in Galil's format."""
        raise GclibError(Code.UNSUPPORTED_FUNCTION, f"{file_path} with {options}")

    def GProgramDownload(self, program: str, preprocessor: str = "") -> None:
        """Replace the controller's program, prepared as in `dmc41x3.language.transfer`: REM lines are not sent.

        `preprocessor` may be empty or give degrees of compression (`--min N --max N`), but no code is compressed: a
        line that is too long without its comment raises -1203.
        """
        if not _COMPRESSION.fullmatch(preprocessor):
            raise GclibError(Code.INVALID_PREPROCESSOR_OPTIONS, preprocessor)
        lines = prepared(program).lines
        if len(lines) > programs.LINES_LIMIT or any(len(line) > LINE_LIMIT for line in lines):
            raise GclibError(Code.UNABLE_TO_COMPRESS)
        session = self._open()
        try:
            guarded(lambda: programs.require_loadable(lines))
        except GclibError as error:
            raise GclibError(Code.ILLEGAL_DATA_IN_PROGRAM, error.detail) from error
        session.transfer(programs.PROBE)
        session.transfer(programs.program_download(lines))

    def GProgramUpload(self) -> str:
        """Return the controller's program, each line ended by CR LF."""
        return "".join(f"{line}\r\n" for line in programs.uploaded_lines(self._open().listing("UL")))

    def GProgramDownloadFile(self, file_path: str, preprocessor: str = "") -> None:
        """Replace the controller's program by that in a file."""
        self.GProgramDownload(read_text(file_path), preprocessor)

    def GProgramUploadFile(self, file_path: str) -> None:
        """Write the controller's program into a file."""
        write_text(file_path, self.GProgramUpload())

    def GArrayDownload(self, name: str, first: int, last: int, array_data: Sequence[float]) -> None:
        """Write values into the elements `first` to `last` of an existing array; -1 means its first or last element."""
        begin = max(first, 0)
        values = [float(value) for value in array_data]
        end = begin + len(values) - 1 if last == G_BOUNDS else last
        if not values or end - begin + 1 != len(values) or end >= self._length(name):
            raise GclibError(Code.ARRAY_NOT_DIMENSIONED, f"{len(values)} values for {name}[{begin}] to [{end}]")
        self._open().transfer(guarded(lambda: transfer.array_download(name, values, begin)))

    def GArrayUpload(self, name: str, first: int, last: int) -> list[float]:
        """Return the elements `first` to `last` of an array; -1 means its first or last element."""
        length = self._length(name)
        begin, end = max(first, 0), length - 1 if last == G_BOUNDS else last
        if not begin <= end < length:
            raise GclibError(Code.ARRAY_NOT_DIMENSIONED, f"{name} has {length} elements")
        command = transfer.array_upload(name, begin, end)
        printed = self._open().listing(command)
        return guarded(lambda: transfer.parse_array(command, printed))

    def GArrayUploadFile(self, file_path: str, names: Iterable[str] = ()) -> None:
        """Write the named arrays, or all without names, into a CSV file with a column for each."""
        wanted = list(names) or [found[1] for found in _ARRAY.finditer(self._open().text("LA"))]
        write_text(file_path, text_of({name: self.GArrayUpload(name, -1, -1) for name in wanted}))

    def GArrayDownloadFile(self, file_path: str) -> None:
        """Write the columns of a CSV file into arrays of the same names; an array of another length is replaced."""
        for name, values in table_of(read_text(file_path)).items():
            self._dimension(name, len(values))
            self.GArrayDownload(name, -1, -1, values)

    def GMessage(self) -> str:
        """Return the messages of programs since the last call; waits for one if necessary (`-s MG` in GOpen)."""
        return self._open().message()

    def GInterrupt(self) -> int:
        """Return the status byte of the next interrupt; waits for it if necessary (`-s EI` in GOpen, and EI or UI)."""
        session = self._open()
        second = session.require("EI", Code.UNSUPPORTED_FUNCTION)
        session.wait_for(lambda: bool(second.interrupts), second.listen)
        return second.interrupts.popleft()

    def GRecord(self, method: str | int = G_QR) -> GDataRecord:
        """Return a data record: polled ("QR", 0), or the newest received ("DR", 1; needs `-s DR` and GRecordRate).

        Galil's Python module has no such method; its name and the fields are those of the C library.
        """
        session = self._open()
        if method in ("QR", G_QR):
            return GDataRecord(session.record())
        if method not in ("DR", G_DR):
            raise GclibError(Code.VALUE_RANGE, f"{method!r} is neither QR nor DR")
        second = session.require("DR", Code.DATA_RECORD_ERROR)
        second.drain()
        session.wait_for(lambda: bool(second.records), second.listen)
        newest = second.records.pop()
        second.records.clear()
        return GDataRecord(newest)

    def GRecordRate(self, period_ms: float) -> None:
        """Set the period of data records [ms], limited to 8 to 30000 samples; 0 ends the records."""
        if not isfinite(period_ms):
            raise GclibError(Code.VALUE_RANGE, f"{period_ms} ms is no period")
        session = self._open()
        second = session.require("DR", Code.DATA_RECORD_ERROR)
        if period_ms <= 0.0:
            session.text("DR 0")
            return
        samples = period_ms * _SAMPLES_IN_MS * 1000.0 / session.number("_TM")
        period = min(max(round(samples / 2.0) * 2, SHORTEST_PERIOD), LONGEST_PERIOD)
        session.text(f"DR {period},{ord(second.letter) - ord('A')}")

    def GMotionComplete(self, axes: str) -> None:
        """Wait until the profiles of all named axes (S and T are planes) have ended, without a timeout."""
        session = self._open()
        for letter in axes.replace(",", "").replace(" ", ""):
            while session.number(f"_BG{letter}"):
                self.GSleep(_LOOK)

    def _open(self) -> GclibSession:
        if self._session is None:
            raise GclibError(Code.CONNECTION_NOT_ESTABLISHED)
        return self._session

    def _length(self, name: str) -> int:
        """Return the length of an array; raises -1200 if it does not exist."""
        operand = guarded(lambda: transfer.array_length(name))
        try:
            length = int(self._open().number(operand))
        except GclibError as error:
            if error.code is not Code.QUESTION_MARK:
                raise
            raise GclibError(Code.ARRAY_NOT_DIMENSIONED, name) from error
        if length < 1:
            raise GclibError(Code.ARRAY_NOT_DIMENSIONED, name)
        return length

    def _dimension(self, name: str, length: int) -> None:
        try:
            if self._length(name) == length:
                return
            self._open().text(f"DA {name}[]")
        except GclibError as error:
            if error.code is not Code.ARRAY_NOT_DIMENSIONED:
                raise
        self._open().text(f"DM {name}[{length}]")
