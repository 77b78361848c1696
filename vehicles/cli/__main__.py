"""``python -m powertrain.vehicles.cli`` is the command ``powertrain``."""

from __future__ import annotations

from powertrain.vehicles.cli.app import main

main(prog_name="powertrain")
