"""Completion of the ``carrierflex`` command in a shell: its commands, options and choices."""

from dataclasses import dataclass
from typing import Literal

#: Shells, each with the folder in which it looks for what it completes.
Shell = Literal["bash", "zsh", "fish"]


@dataclass(frozen=True)
class Completion:
    """Script for a shell."""

    shell: Shell
    text: str


def main(shell: Shell) -> Completion:
    """Show the script that completes commands and options in a shell.

    It goes where the shell looks for it::

        carrierflex completion bash > ~/.local/share/bash-completion/completions/carrierflex
        carrierflex completion zsh > ~/.zfunc/_carrierflex        # a folder of fpath
        carrierflex completion fish > ~/.config/fish/completions/carrierflex.fish

    Parameters
    ----------
    shell
        Shell that completes.

    Returns
    -------
    Completion
        The script, which knows the commands of this version.
    """
    from carrierflex.workflows.command_line import application

    return Completion(shell, application(shows_related=True).generate_completion(shell=shell))
