"""The subcommands of `python -m planner`: each module adds its parser and runs its command."""
