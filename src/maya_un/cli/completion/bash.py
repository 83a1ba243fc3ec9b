"""The completion script for bash; zsh uses it through `bashcompinit`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from maya_un.cli.completion.tree import CompletionCommand

_HEAD = """\
# Completion of `maya` for {shell}. Made by `maya completion {shell}`; make it again after an update.
"""

_WAY = """\
_maya() {
    local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
    local path=maya place=0 words= word i
    for ((i = 1; i < COMP_CWORD; i++)); do
        word=${COMP_WORDS[i]}
        if _maya_is_command "$path $word"; then
            path="$path $word" place=0
        elif [[ $word != -* ]] && ! _maya_takes_value "$path ${COMP_WORDS[i-1]}"; then
            place=$((place + 1))
        fi
    done
    if _maya_takes_value "$path $previous"; then
        words=$(_maya_values "$path $previous")
    elif [[ $current == -* ]]; then
        words=$(_maya_options "$path")
    else
        words=$(_maya_words "$path|$place")
    fi
    case $words in
        @files)
            local IFS=$'\\n'
            COMPREPLY=($(compgen -f -- "$current"))
            return
            ;;
        @*) words=$(maya completion values "${words#@}" 2>/dev/null) ;;
    esac
    COMPREPLY=($(compgen -W "$words" -- "$current"))
}
"""


def script(commands: Iterable[CompletionCommand], shell: str = "bash") -> str:
    """Return the script for bash or zsh."""
    known = list(commands)
    blocks = [
        _HEAD.format(shell=shell),
        "autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else "",
        _is_function("_maya_is_command", [command.path for command in known if command.path != "maya"]),
        _is_function("_maya_takes_value", list(_valued(known))),
        _told_function("_maya_values", _values(known)),
        _told_function("_maya_options", ((one.path, " ".join(option.name for option in one.options)) for one in known)),
        _told_function("_maya_words", _words(known)),
        _WAY,
        "complete -o filenames -F _maya maya\n" if shell == "bash" else "complete -F _maya maya\n",
    ]
    return "\n".join(block for block in blocks if block).rstrip()


def _valued(commands: Iterable[CompletionCommand]) -> Iterator[str]:
    return (f"{one.path} {option.name}" for one in commands for option in one.options if option.valued)


def _values(commands: Iterable[CompletionCommand]) -> Iterator[tuple[str, str]]:
    for one in commands:
        for option in one.options:
            if option.values:
                yield f"{one.path} {option.name}", option.values


def _words(commands: Iterable[CompletionCommand]) -> Iterator[tuple[str, str]]:
    for one in commands:
        if one.commands:
            yield f"{one.path}|0", " ".join(name for name, _ in one.commands)
        for place, values in enumerate(one.arguments):
            if values:
                yield f"{one.path}|{place}", values


def _is_function(name: str, words: list[str]) -> str:
    """Return a shell function that succeeds if its argument is one of `words`."""
    lines = " |\\\n        ".join(f'"{word}"' for word in words)
    return f'{name}() {{\n    case "$1" in\n        {lines}) return 0 ;;\n    esac\n    return 1\n}}\n'


def _told_function(name: str, table: Iterable[tuple[str, str]]) -> str:
    """Return a shell function that prints the words for its argument."""
    lines = "\n".join(f'        "{key}") echo "{words}" ;;' for key, words in table)
    return f'{name}() {{\n    case "$1" in\n{lines}\n    esac\n}}\n'
