"""The command `maya completion`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the command to `app`; `how` contains the options of all commands."""
    app.command(**how)(completion)


def completion(
    context: typer.Context,
    shell: Annotated[Literal["bash", "zsh", "fish"], typer.Argument(metavar="bash|zsh|fish")],
) -> int:
    """Print the script that lets a shell complete `maya` commands.

    bash: maya completion bash > ~/.local/share/bash-completion/completions/maya

    zsh: maya completion zsh > ~/.maya.zsh, and source it in ~/.zshrc after compinit

    fish: maya completion fish > ~/.config/fish/completions/maya.fish
    """
    from maya_un.cli import output
    from maya_un.cli.completion import bash, fish, tree

    known = tree.commands(context.find_root().command)
    output.say(fish.script(known) if shell == "fish" else bash.script(known, shell))
    return output.DONE
