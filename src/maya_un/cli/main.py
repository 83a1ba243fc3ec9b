"""Entry point of `maya`: imports little, handles `stop` and `status` at once, and passes other commands to `app`.

`stop` and `status` bypass the command parser and every heavy import; a test checks `sys.modules`.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

from maya_un import __version__
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings, asks_for_json, from_environment, split
from maya_un.errors import MayaError
from maya_un.interpreter import quiet_collector


def program() -> int:
    """Run the process `maya`: like `main`, with garbage collection configured for its command."""
    gc.disable()  # short commands end before they have created garbage
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
        return _dispatch(rest, settings)
    except MayaError as error:
        return output.complain(error, settings)
    except KeyboardInterrupt:
        return output.INTERRUPTED
    except BrokenPipeError:
        return output.FAILED
    except Exception as error:  # noqa: BLE001 - the last resort: a person gets a sentence, the log the traceback
        from maya_un.http.log import written_down

        return output.complain(written_down(error), settings)
    except BaseException as error:
        from asyncio import CancelledError  # already imported wherever one was raised

        if isinstance(error, CancelledError):
            return output.INTERRUPTED
        raise


def _dispatch(rest: list[str], settings: OutputSettings) -> int:
    if not rest or rest[0] in {"--help", "-h", "help"}:
        from maya_un.cli.help import OVERVIEW

        output.say(OVERVIEW)
        return output.DONE
    if rest[0] == "--version":
        return output.answer({"version": __version__}, f"maya-un {__version__}", settings)
    if rest[0] in {"stop", "status"}:
        from maya_un.cli import quick

        return quick.run(rest[0], rest[1:], settings)
    if rest[0] != "dmc":
        from maya_un.quantities import join_units

        rest = join_units(rest)
    if rest[0] in {"fk", "ik", "reach"} and len(rest) == 4 and not any(word.startswith("--") for word in rest):
        from maya_un.cli import offline

        return offline.answer(rest[0], rest[1:], settings)
    if rest[:2] == ["completion", "values"]:
        from maya_un.cli.completion import values

        return values.run(rest[2:])
    if not gc.isenabled():
        quiet_collector()
    from maya_un.cli import app

    return app.run(rest, settings)


if __name__ == "__main__":
    sys.exit(program())
