"""``python -m powertrain`` runs the command that is installed under this name; the core does not know which that is."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points


def main() -> None:
    """The console script ``powertrain`` of the installed distributions."""
    commands = list(entry_points(group="console_scripts", name="powertrain"))
    if not commands:
        sys.exit("the command powertrain is not installed; in a checkout: python -m pip install -e .")
    commands[0].load()(prog_name="powertrain")


if __name__ == "__main__":
    main()
