"""The command `maya completion`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the command to `app`; `how` contains the options of all commands."""

    @app.command(**how)
    def completion(shell: Annotated[Literal["bash", "zsh", "fish"], typer.Argument(metavar="bash|zsh|fish")]) -> int:
        """Print the script that lets a shell complete `maya` commands.

        bash reads it from ~/.local/share/bash-completion/completions/maya, fish from
        ~/.config/fish/completions/maya.fish. For zsh, write it to ~/.maya.zsh, and source that in ~/.zshrc after
        compinit.

        Example: maya completion bash > ~/.local/share/bash-completion/completions/maya
        """
        from dmc41x3.cli.parsing import parser
        from maya_un.cli import output
        from maya_un.cli.completion import bash, fish, tree

        known = tree.commands(parser(app, ""))
        output.say(fish.script(known) if shell == "fish" else bash.script(known, shell))
        return output.DONE
