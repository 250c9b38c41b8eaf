"""`robocov completion`."""

from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, fields
from importlib import import_module
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

import tyro

from robocov.controllers import CONTROLLERS
from robocov.mapfile import list_bundled_maps
from robocov_app.commands import COMMANDS
from robocov_app.terminal.arguments import list_option_groups
from robocov_app.terminal.output import echo

_BASH_TEMPLATE = """\
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
                {map_commands}) names="{maps}" ;;
{words}
            esac ;;
        esac ;;
    esac; fi
    while IFS= read -r word; do COMPREPLY+=("$word"); done < <(compgen -W "$names" -- "$word")
}}
complete -o bashdefault -o default -F _robocov robocov
"""
_ZSH_PROLOGUE = (
    "#compdef robocov\nautoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n"
)
"""Beginning of the script for zsh, which makes zsh understand completions of bash."""
_CONTROLLER_OPTIONS = ("--controller", "--controllers")
"""Options that take controllers."""
_CONTROLLER_ARGUMENT = "names"
"""Name of the positional argument that takes controllers."""
_MAP_ARGUMENTS = {"map", "files"}
"""Names of positional arguments that take maps."""


@dataclass
class Arguments:
    """Print a shell script that completes commands, options, controllers and maps.

    Add a line to the startup file of your shell:

      ~/.bashrc    eval "$(robocov completion bash)"
      ~/.zshrc     eval "$(robocov completion zsh)"
      config.fish  robocov completion fish | source

    Example: robocov completion bash
    """

    shell: Annotated[tyro.conf.Positional[Literal["bash", "zsh", "fish"]], tyro.conf.arg(metavar="SHELL")]
    """bash, zsh or fish."""


class _Completions(NamedTuple):
    """Words that the shell offers after a command.

    Attributes
    ----------
    options : list of str
        Names of options, such as ``--robots``.
    words : list of str
        Choices of the positional arguments, which may include names of controllers.
    takes_maps : bool
        Whether a positional argument is a map.
    """

    options: list[str]
    words: list[str]
    takes_maps: bool


def command(options: Arguments) -> None:
    """Run `robocov completion`."""
    completions = {}
    for name, subcommand in COMMANDS.items():
        module = import_module(f"robocov_app.commands.{subcommand.module}")
        completions[name] = _collect_completions(module.Arguments)
    if options.shell == "fish":
        for line in _write_fish_script(completions):
            echo(line)
        return
    script = _write_bash_script(completions)
    if options.shell == "zsh":
        script = _ZSH_PROLOGUE + script
    echo(script, end="")


def _collect_completions(kind: type) -> _Completions:
    """Collect the completions of a command from the dataclass of its options."""
    positionals = [field for field in fields(kind) if _is_positional(kind, field)]
    choices = get_type_hints(kind)
    words: list[str] = []
    for field in positionals:
        if get_origin(choices[field.name]) is Literal:
            words += get_args(choices[field.name])
        elif field.name == _CONTROLLER_ARGUMENT:
            words += CONTROLLERS
    names = {field.name for field in positionals}
    return _Completions(["--help", *_list_options(kind)], words, bool(names & _MAP_ARGUMENTS))


def _list_options(kind: Any) -> list[str]:
    """List the options of a dataclass and of the option groups in it, including aliases."""
    groups = list_option_groups(kind)
    options = []
    for field in fields(kind):
        if not _is_positional(kind, field) and field.default_factory not in groups:
            options.append(_name_option(kind, field))
            options += field.metadata.get("aliases", ())
    for group in groups:
        options += _list_options(group)
    return options


def _is_positional(kind: Any, field: "Field[Any]") -> bool:
    return tyro.conf.Positional in _get_annotations(kind, field)


def _name_option(kind: Any, field: "Field[Any]") -> str:
    """Return the option that sets a field; a flag that is on by default has the prefix ``--no-``."""
    name = field.name
    for annotation in _get_annotations(kind, field):
        name = getattr(annotation, "name", None) or name
    prefix = "--no-" if field.default is True else "--"
    return prefix + name.replace("_", "-")


def _get_annotations(kind: Any, field: "Field[Any]") -> tuple[Any, ...]:
    """Return the annotations of a field that tyro interprets."""
    hints = get_type_hints(kind, include_extras=True)
    annotations: tuple[Any, ...] = getattr(hints[field.name], "__metadata__", ())
    return annotations


def _write_bash_script(completions: Mapping[str, _Completions]) -> str:
    """Return the script for bash."""
    return _BASH_TEMPLATE.format(
        commands=" ".join(COMMANDS),
        controllers=" ".join(CONTROLLERS),
        maps=" ".join(list_bundled_maps()),
        map_commands="|".join(name for name, completion in completions.items() if completion.takes_maps),
        options=_write_cases({name: completion.options for name, completion in completions.items()}),
        words=_write_cases({name: completion.words for name, completion in completions.items()}),
    )


def _write_cases(words_by_command: Mapping[str, list[str]]) -> str:
    """Return a bash case for each command that has words, which sets `names` to the words to offer."""
    cases = []
    for name, words in words_by_command.items():
        if words:
            cases.append(f'                {name}) names="{" ".join(words)}" ;;')
    return "\n".join(cases)


def _write_fish_script(completions: Mapping[str, _Completions]) -> Iterator[str]:
    """Yield the lines of the script for fish."""
    controllers = " ".join(CONTROLLERS)
    maps = " ".join(list_bundled_maps())
    yield "complete -c robocov -n __fish_use_subcommand -f"
    for name, completion in completions.items():
        summary = COMMANDS[name].summary.replace("'", "\\'")
        yield f"complete -c robocov -n __fish_use_subcommand -f -a {name} -d '{summary}'"
        prefix = f"complete -c robocov -n '__fish_seen_subcommand_from {name}'"
        for option in completion.options:
            line = f"{prefix} -l {option[2:]}"
            if option in _CONTROLLER_OPTIONS:
                line += f" -x -a '{controllers}'"
            yield line
        words = maps if completion.takes_maps else " ".join(completion.words)
        if words:
            yield f"{prefix} -a '{words}'"
