"""The completion script for fish, with a description of each word."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from maya_un.cli.completion.tree import FILES, CompletionCommand

_WAY = """\
function __maya
    set -l path maya
    set -l place 0
    set -l before (commandline -opc)
    set -l current (commandline -ct)
    set -l previous $before[-1]
    set -l last ''
    for word in $before[2..-1]
        if contains -- "$path $word" $__maya_commands
            set path "$path $word"
            set place 0
        else if not string match -q -- '-*' $word; and not contains -- "$path $last" $__maya_valued
            set place (math $place + 1)
        end
        set last $word
    end
    if contains -- "$path $previous" $__maya_valued
        __maya_values "$path $previous" "$current"
    else if string match -q -- '-*' "$current"
        __maya_options $path
    else
        __maya_words "$path|$place" "$current"
    end
end

complete -c maya -f -a '(__maya)'
"""


def script(commands: Iterable[CompletionCommand]) -> str:
    """Return the script."""
    known = list(commands)
    paths = [one.path for one in known if one.path != "maya"]
    valued = [f"{one.path} {option.name}" for one in known for option in one.options if option.valued]
    blocks = [
        "# Completion of `maya` for fish. Made by `maya completion fish`; make it again after an update.\n",
        f"set -g __maya_commands {_list(paths)}\n",
        f"set -g __maya_valued {_list(valued)}\n",
        _function("__maya_values", _values(known)),
        _function("__maya_options", ((one.path, _option_lines(one)) for one in known)),
        _function("__maya_words", _words(known)),
        _WAY,
    ]
    return "\n".join(blocks).rstrip()


def _values(commands: Iterable[CompletionCommand]) -> Iterator[tuple[str, list[str]]]:
    for one in commands:
        for option in one.options:
            if option.values:
                yield f"{one.path} {option.name}", _told(option.values)


def _option_lines(command: CompletionCommand) -> list[str]:
    return [_printed(option.name, option.about) for option in command.options]


def _words(commands: Iterable[CompletionCommand]) -> Iterator[tuple[str, list[str]]]:
    for one in commands:
        if one.commands:
            yield f"{one.path}|0", [_printed(name, about) for name, about in one.commands]
        for place, values in enumerate(one.arguments):
            if values:
                yield f"{one.path}|{place}", _told(values)


def _told(values: str) -> list[str]:
    """Return the lines that print values of a kind."""
    if values == FILES:
        return ['__fish_complete_path "$argv[2]"']
    if values.startswith("@"):
        return [f"maya completion values {values[1:]} 2>/dev/null"]
    return [f"string split ' ' -- {_quoted(values)}"]


def _printed(word: str, about: str) -> str:
    return f"printf '%s\\t%s\\n' {_quoted(word)} {_quoted(about)}"


def _function(name: str, table: Iterable[tuple[str, list[str]]]) -> str:
    """Return a shell function that runs the lines for its first argument."""
    cases = [
        "\n".join([f"        case {_quoted(key)}", *(f"            {line}" for line in lines)]) for key, lines in table
    ]
    return "\n".join([f"function {name}", "    switch $argv[1]", *cases, "    end", "end", ""])


def _list(words: Iterable[str]) -> str:
    return " ".join(_quoted(word) for word in words)


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
