"""`robocov completion`."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from importlib import import_module
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import tyro

from robocov.controllers import CONTROLLERS
from robocov.mapfile import bundled_maps
from robocov_app.commands import COMMANDS
from robocov_app.terminal.arguments import groups_of

_BASH = """\
_robocov() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} names=""
    COMPREPLY=()
    if [ "$COMP_CWORD" -eq 1 ]; then names="{commands}"
    else case "$before" in
        --controller|--controllers) names="{controllers}" ;;
        *) case "$word" in
            -*) case "${{COMP_WORDS[1]}}" in
{options}
            esac ;;
            *) case "${{COMP_WORDS[1]}}" in
                {mapped}) names="{maps}" ;;
{words}
            esac ;;
        esac ;;
    esac; fi
    while IFS= read -r word; do COMPREPLY+=("$word"); done < <(compgen -W "$names" -- "$word")
}}
complete -o bashdefault -o default -F _robocov robocov
"""
_ZSH = "#compdef robocov\nautoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n"


@dataclass
class Arguments:
    """Print a script by which the shell completes commands, options, controllers and maps.

    Put the line into the start-up file of your shell: eval "$(robocov completion bash)" into ~/.bashrc,
    eval "$(robocov completion zsh)" into ~/.zshrc, robocov completion fish | source into config.fish.

    Example: robocov completion bash
    """

    shell: Annotated[tyro.conf.Positional[Literal["bash", "zsh", "fish"]], tyro.conf.arg(metavar="SHELL")]
    """bash, zsh or fish."""


def command(options: Arguments) -> None:
    kinds = {
        name: import_module(f"robocov_app.commands.{module}").Arguments
        for name, (module, _) in COMMANDS.items()
    }
    flags = {name: ["--help", *_flags(kind)] for name, kind in kinds.items()}
    words = {name: found for name, kind in kinds.items() if (found := _words(kind))}
    mapped = [name for name, kind in kinds.items() if {"map", "files"} & {*_positionals(kind)}]
    maps, controllers = " ".join(bundled_maps()), " ".join(CONTROLLERS)
    if options.shell == "fish":
        print("complete -c robocov -n __fish_use_subcommand -f")
        for name, (_, line) in COMMANDS.items():
            told = line.replace("'", "\\'")
            print(f"complete -c robocov -n __fish_use_subcommand -f -a {name} -d '{told}'")
            seen = f"complete -c robocov -n '__fish_seen_subcommand_from {name}'"
            for flag in flags[name]:
                more = f" -x -a '{controllers}'" if flag in ("--controller", "--controllers") else ""
                print(f"{seen} -l {flag[2:]}{more}")
            if offered := maps if name in mapped else " ".join(words.get(name, ())):
                print(f"{seen} -a '{offered}'")
        return
    print(_ZSH * (options.shell == "zsh"), end="")
    script = _BASH.format(
        commands=" ".join(COMMANDS),
        controllers=controllers,
        maps=maps,
        mapped="|".join(mapped),
        options="\n".join(_case(name, own) for name, own in flags.items()),
        words="\n".join(_case(name, own) for name, own in words.items()),
    )
    print(script, end="")


def _case(name: str, words: list[str]) -> str:
    return f'                {name}) names="{" ".join(words)}" ;;'


def _positionals(kind: Any) -> Iterator[str]:
    for name, hint in get_type_hints(kind, include_extras=True).items():
        if tyro.conf.Positional in getattr(hint, "__metadata__", ()):
            yield name


def _words(kind: Any) -> list[str]:
    """Return the words that a positional argument may be."""
    hints = get_type_hints(kind)
    choices = [hints[name] for name in _positionals(kind) if get_origin(hints[name]) is Literal]
    return [str(word) for choice in choices for word in get_args(choice)]


def _flags(kind: Any) -> Iterator[str]:
    """Yield the options that a command has, with those of its groups."""
    groups, places = groups_of(kind), {*_positionals(kind)}
    hints = get_type_hints(kind, include_extras=True)
    for each in fields(kind):
        if each.default_factory not in groups and each.name not in places:
            told = [getattr(more, "name", None) for more in getattr(hints[each.name], "__metadata__", ())]
            name = next(filter(None, told), each.name).replace("_", "-")
            yield f"--{'no-' * (each.default is True)}{name}"
    for group in groups:
        yield from _flags(group)
