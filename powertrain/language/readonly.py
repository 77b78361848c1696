"""Read-only values by name."""

from __future__ import annotations

from typing import Any, NoReturn

from powertrain.errors import ParameterError


class ReadOnlyValues(dict[str, float]):
    """Numbers by name. A change in place would have no effect, so it is an error that says what to do ``instead``."""

    def __init__(self, values: dict[str, float], instead: str) -> None:
        super().__init__(values)
        self._instead = instead

    def __setitem__(self, name: str, value: float) -> NoReturn:
        raise ParameterError(f"parameters[{name!r}] = {value!r} would have no effect; {self._instead}")

    def _refuse(self, *given: Any, **named: Any) -> NoReturn:
        raise ParameterError(f"a change of parameters would have no effect; {self._instead}")

    __delitem__ = __ior__ = clear = pop = popitem = _refuse
    setdefault: Any = _refuse
    update: Any = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (dict(self),)
