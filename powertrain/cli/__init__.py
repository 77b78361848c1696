"""The command line ``powertrain``: catalogue, runs on cycles, maps, reproduced papers, the design of split-path transmissions.

Every command is a module that imports what it computes with only when it runs, so that help comes at once.
Exit codes: 0 done; 1 the model, the simulation or a file failed, with one paragraph on why; 2 the command line is wrong; 130 interrupted.
"""

from __future__ import annotations

from powertrain.cli.app import main

__all__ = ["main"]
