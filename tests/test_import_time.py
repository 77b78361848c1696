"""``import powertrain`` stays light: what only some analyses need is imported where it is used."""

from __future__ import annotations

import subprocess
import sys

HEAVY = [
    "scipy",
    "scipy.integrate",
    "matplotlib",
    "pandas",
    "xarray",
    "control",
    "netCDF4",
    "plotly",
    "powertrain.plant",
    "powertrain.compiler.flatten",
]


def test_import_loads_no_heavy_module_and_lists_what_there_is() -> None:
    program = (
        "import sys, powertrain, powertrain.components; print(*{*powertrain.__all__, 'components'}.difference(dir(powertrain)), "
        f"*(name for name in {HEAVY!r} if name in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
