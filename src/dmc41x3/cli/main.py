"""Entry of `dmc`."""

from __future__ import annotations

import sys
import traceback
from asyncio import CancelledError
from collections.abc import Sequence

from dmc41x3 import __version__
from dmc41x3.cli import commands, console
from dmc41x3.cli.console import asks_for_json, from_environment, split_options
from dmc41x3.errors import CodedError, InternalError


def program() -> int:
    """Run the process `dmc`; return its exit code."""
    code = main()
    console.forget_unprinted()
    return code


def main(argv: Sequence[str] | None = None) -> int:
    """Execute one command line (without the program's name) and return its exit code; never raises."""
    line = sys.argv[1:] if argv is None else argv
    settings = from_environment()._replace(json=asks_for_json(line))
    console.tolerate_any_terminal()
    try:
        settings, rest = split_options(line, settings)
        if rest[:1] == ["--version"]:
            return console.answer({"version": __version__}, f"dmc {__version__}", settings)
        return commands.run(rest, settings)
    except CodedError as error:
        return console.complain(error, settings)
    except (KeyboardInterrupt, CancelledError):
        return console.INTERRUPTED
    except BrokenPipeError:
        return console.FAILED
    except Exception as error:  # noqa: BLE001 - a defect: print its traceback, then one sentence
        traceback.print_exc()
        return console.complain(InternalError(reason=f"{type(error).__name__}: {error}"), settings)


if __name__ == "__main__":
    sys.exit(program())
