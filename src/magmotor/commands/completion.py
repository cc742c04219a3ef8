"""Print a script with which bash or zsh completes the commands of magmotor and their flags.

`magmotor completion bash >> ~/.bashrc` or `magmotor completion zsh >> ~/.zshrc` installs it. The
flags are those that the command's `--help` names.
"""

from typing import Literal

import tyro

from magmotor.commands import COMMANDS
from magmotor.commands.output import write_verbatim
from magmotor.commands.parsing import parse_options

FIRST = {
    "movie": "top motor",
    "view": "top motor disk",
    "sweep": "top disk motor status combine movie cluster",
    "export": "top motor disk run",
    "examples": "list show run copy",
    "completion": "bash zsh",
}
"""First arguments of commands, other than files."""

BASH = """\
_magmotor() {
    local word="${COMP_WORDS[COMP_CWORD]}" k
    local -a command
    command=()
    COMPREPLY=()
    if [ "$COMP_CWORD" = 1 ]; then
        COMPREPLY=($(compgen -W "%(commands)s" -- "$word"))
    elif [ "${word#-}" != "$word" ]; then
        for k in 1 2 3; do
            case "${COMP_WORDS[k]}" in -*) break ;; esac
            command+=("${COMP_WORDS[k]}")
        done
        if [ "${command[*]}" != "$_magmotor_command" ]; then
            _magmotor_command="${command[*]}"
            _magmotor_flags=$(magmotor "${command[@]}" --help 2>/dev/null | grep -oE -e '--[a-z-]+')
        fi
        COMPREPLY=($(compgen -W "$_magmotor_flags" -- "$word"))
    elif [ "$COMP_CWORD" = 2 ]; then
        case "${COMP_WORDS[1]}" in %(cases)s esac
        COMPREPLY=($(compgen -W "${command[*]}" -- "$word"))
    elif [ "$COMP_CWORD ${COMP_WORDS[1]}" = "3 examples" ]; then
        COMPREPLY=($(compgen -W "$(magmotor examples list | cut -d " " -f 1)" -- "$word"))
    fi
}
complete -o default -F _magmotor magmotor
"""
"""Other words are completed as names of files."""

ZSH = "autoload -Uz compinit bashcompinit && compinit && bashcompinit\n" + BASH


def main() -> None:
    """Print the script."""
    parse_options(write, __doc__)


def write(shell: tyro.conf.Positional[Literal["bash", "zsh"]]) -> None:
    """Print the script of a shell."""
    cases = " ".join(f"{name}) command=({words}) ;;" for name, words in FIRST.items())
    script = {"bash": BASH, "zsh": ZSH}[shell]
    write_verbatim(script % {"commands": " ".join(COMMANDS), "cases": cases})
