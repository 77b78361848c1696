"""``python -m powertrain.cli`` is the command ``powertrain``, also where nothing is installed."""

from __future__ import annotations

from powertrain.cli.app import main

if __name__ == "__main__":
    main(prog_name="powertrain")
