"""How the files of this folder were made: ``python tests/data/msl/sample.py FOLDER`` with whole trajectories as CSV files.

The trajectories are those of the Modelica Association's MAP-LIB_ReferenceResults for the Modelica Standard Library 4.0.0, computed by
Dymola 2020x with DASSL at a tolerance of 1e-6. Their own error is below 1e-4 of a signal's range but for First, FirstGrounded (3e-4),
Oscillator (5e-4) and GenerationOfFMUs (9e-4). Kept are 100 instants, both sides of every event, and the changes of the modes.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from reference import FLAGS, FOLDER, sequence

COUNT = 100
SOURCE = "Modelica Association, MAP-LIB_ReferenceResults for MSL 4.0.0: Dymola 2020x, DASSL, tolerance 1e-6"


def sample(path: Path, family: str) -> str:
    """The text of a file of samples."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    table = np.array(rows, float)
    time = table[:, 0]
    twice = np.flatnonzero(np.diff(time) == 0)
    kept = np.unique(np.concatenate([np.linspace(0, len(time) - 1, COUNT).round().astype(int), twice, twice + 1]))
    flags = {name for name in head if name.rpartition(".")[2] in FLAGS}
    modes = {name: sequence(time, table[:, head.index(name)]) for name in head if name.endswith(".mode")}
    columns = [i for i, name in enumerate(head) if name not in flags]
    lines = [f"# Modelica.Mechanics.{family}.Examples.{path.stem}", f"# {SOURCE}"]
    lines += [f"# mode {json.dumps([name, found])}" for name, found in modes.items()]
    lines += [",".join(head[i] for i in columns)]
    lines += [",".join([f"{row[0]:.12g}", *(f"{row[i]:.8g}" for i in columns[1:])]) for row in table[kept]]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Writes the samples of every trajectory in the folders Rotational and Translational."""
    for path in sorted(Path(sys.argv[1]).glob("*/*.csv")):
        target = FOLDER / path.parent.name / path.name
        target.parent.mkdir(exist_ok=True)
        target.write_text(sample(path, path.parent.name), encoding="utf-8")


if __name__ == "__main__":
    main()
