"""Print a script with which bash completes the commands of magmotor and their flags.

`magmotor completion bash >> ~/.bashrc` installs it. The flags are those that the command's `--help`
names.
"""

from typing import Literal

import tyro

from magmotor.commands import COMMANDS

BASH = """\
_magmotor() {
    local word=${COMP_WORDS[COMP_CWORD]} command
    COMPREPLY=()
    if [ "$COMP_CWORD" = 1 ]; then
        COMPREPLY=($(compgen -W "%(commands)s" -- "$word"))
    elif [ "${word#-}" != "$word" ]; then
        command="${COMP_WORDS[1]} ${COMP_WORDS[2]}"
        case ${COMP_WORDS[2]} in -*) command=${COMP_WORDS[1]} ;; esac
        if [ "$command" != "$_magmotor_command" ]; then
            _magmotor_flags=$(magmotor $command --help 2>/dev/null | grep -oE -e '--[a-zA-Z-]+')
            _magmotor_command=$command
        fi
        COMPREPLY=($(compgen -W "$_magmotor_flags" -- "$word"))
    fi
}
complete -o default -F _magmotor magmotor
"""
"""Other words are completed as names of files."""


def main() -> None:
    """Print the script."""
    tyro.cli(write, description=__doc__)


def write(shell: tyro.conf.Positional[Literal["bash"]]) -> None:
    """Print the script of a shell."""
    print(BASH % {"commands": " ".join(COMMANDS)}, end="")
