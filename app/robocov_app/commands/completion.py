"""`robocov completion`."""

from dataclasses import dataclass, fields
from importlib import import_module
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import tyro

from robocov.controllers import CONTROLLERS
from robocov.mapfile import list_bundled_maps
from robocov_app.commands import COMMANDS
from robocov_app.terminal.arguments import list_option_groups
from robocov_app.terminal.output import echo

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
    flags, words, mapped = {}, {}, []
    for name, (module, _, _) in COMMANDS.items():
        own, words[name], positionals = _described(import_module(f"robocov_app.commands.{module}").Arguments)
        flags[name] = ["--help", *own]
        mapped += [name] * bool({"map", "files"} & positionals)
    maps, controllers = " ".join(list_bundled_maps()), " ".join(CONTROLLERS)
    if options.shell == "fish":
        echo("complete -c robocov -n __fish_use_subcommand -f")
        for name, (_, line, _) in COMMANDS.items():
            told = line.replace("'", "\\'")
            echo(f"complete -c robocov -n __fish_use_subcommand -f -a {name} -d '{told}'")
            seen = f"complete -c robocov -n '__fish_seen_subcommand_from {name}'"
            for flag in flags[name]:
                more = f" -x -a '{controllers}'" if flag in ("--controller", "--controllers") else ""
                echo(f"{seen} -l {flag[2:]}{more}")
            if offered := maps if name in mapped else " ".join(words[name]):
                echo(f"{seen} -a '{offered}'")
        return
    cases = [
        "\n".join(f'                {name}) names="{" ".join(own)}" ;;' for name, own in some.items() if own)
        for some in (flags, words)
    ]
    names: dict[str, str] = {"commands": " ".join(COMMANDS), "controllers": controllers, "maps": maps}
    script = _BASH.format(**names, mapped="|".join(mapped), options=cases[0], words=cases[1])
    echo(_ZSH * (options.shell == "zsh") + script, end="")


def _described(kind: Any) -> tuple[list[str], list[str], set[str]]:
    """Return a command's options, its groups' too, and words and names of its positional arguments."""
    hints, plain, groups = (
        get_type_hints(kind, include_extras=True),
        get_type_hints(kind),
        list_option_groups(kind),
    )
    flags, positionals = [], set()
    words: list[str] = []
    for each in fields(kind):
        more = getattr(hints[each.name], "__metadata__", ())
        if tyro.conf.Positional in more:
            positionals.add(each.name)
            words += get_args(plain[each.name]) if get_origin(plain[each.name]) is Literal else ()
        elif each.default_factory not in groups:
            name = next((told.name for told in more if getattr(told, "name", None)), each.name)
            flags.append(f"--{'no-' * (each.default is True)}{name.replace('_', '-')}")
            flags += each.metadata.get("aliases", ())
    return flags + [flag for group in groups for flag in _described(group)[0]], words, positionals
