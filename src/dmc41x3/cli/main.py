"""Entry of `dmc`."""

from __future__ import annotations

import sys
import traceback
from asyncio import CancelledError
from collections.abc import Sequence

from dmc41x3 import __version__
from dmc41x3.cli import app, output
from dmc41x3.cli.settings import asks_for_json, from_environment, split
from dmc41x3.errors import CodedError, InternalError


def program() -> int:
    """Be the process `dmc`."""
    code = main()
    output.forget_unprinted()
    return code


def main(argv: Sequence[str] | None = None) -> int:
    """Carry out one command line (without the program's name) and return its exit code; never raises."""
    line = sys.argv[1:] if argv is None else argv
    settings = from_environment()._replace(json=asks_for_json(line))
    output.tolerate_any_terminal()
    try:
        settings, rest = split(line, settings)
        if rest[:1] == ["--version"]:
            return output.answer({"version": __version__}, f"dmc {__version__}", settings)
        return app.run(rest, settings)
    except CodedError as error:
        return output.complain(error, settings)
    except (KeyboardInterrupt, CancelledError):
        return output.INTERRUPTED
    except BrokenPipeError:
        return output.FAILED
    except Exception as error:  # noqa: BLE001 - a defect: one sentence behind its traceback
        traceback.print_exc()
        return output.complain(InternalError(reason=f"{type(error).__name__}: {error}"), settings)


if __name__ == "__main__":
    sys.exit(program())
