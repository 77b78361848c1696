"""A progress bar for long computations."""

from __future__ import annotations

import time
from typing import Any

_PATIENCE = 2.0


class Bar:
    """A progress bar over points: always, never, or (None) if the computation takes more than two seconds."""

    def __init__(self, wanted: bool | None, total: int) -> None:
        self._wanted, self._total = wanted, total
        self._bar: Any = None
        self._start = time.perf_counter()

    def reach(self, count: int) -> None:
        """Set the number of points that are done."""
        if self._wanted is False:
            return
        if self._bar is None and (self._wanted or time.perf_counter() - self._start > _PATIENCE):
            from tqdm.auto import tqdm

            self._bar = tqdm(total=self._total, unit=" points", desc="steady")
        if self._bar is not None:
            self._bar.update(count - self._bar.n)

    def close(self) -> None:
        """The end."""
        if self._bar is not None:
            self._bar.close()
