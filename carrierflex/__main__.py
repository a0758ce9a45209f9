"""``python -m carrierflex`` is the ``carrierflex`` command."""

from carrierflex.workflows.command_line import main

if __name__ == "__main__":
    main()
