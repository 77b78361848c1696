"""What a search of modes has found is tried again before the next search of the same run: a car takes off the same way each time."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from powertrain.engine.buffers import Array

_MOST = 16


class Recall:
    """The last results of searches: which modes were tried or changed, and what they became."""

    def __init__(self, m: Array) -> None:
        self._m = m
        self.forget()

    def forget(self) -> None:
        """Begin a run: no run depends on those before it."""
        self._found: list[tuple[NDArray[np.intp], Array]] = []

    def again(self, consistent: Callable[[], bool]) -> bool:
        """Leave in ``m`` the first result that is consistent here too; without one ``m`` is as it was."""
        start = self._m.copy()
        for k, (places, modes) in enumerate(self._found):
            self._m[places] = modes
            if consistent():
                self._found.insert(0, self._found.pop(k))
                return True
            self._m[:] = start
        return False

    def keep(self, tried: Iterable[int], before: Array) -> None:
        """``m`` is the one result of a search that began at ``before``."""
        places = np.union1d(np.fromiter(tried, dtype=np.intp), np.flatnonzero(before != self._m))
        self._found.insert(0, (places, self._m[places]))
        del self._found[_MOST:]
