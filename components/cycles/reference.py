"""The speed of a drive cycle as a signal."""

from __future__ import annotations

from typing import Annotated

from powertrain import Component, Equations, Output, ParameterError, schedule, signal_output
from powertrain.components.cycles.cycle import DriveCycle

AT_REST = DriveCycle("rest", ((0.0, 0.0), (1.0, 0.0)))


class CycleSpeed(Component):
    """The speed of a drive cycle, and its mean acceleration over the next ``preview`` seconds.

    v_ref = v(t),  a_ref = (v(t + preview) - v(t))/preview

    The preview is the driver's look-ahead time. Errors: ParameterError if the preview is not positive.
    """

    cycle: DriveCycle = AT_REST
    preview: Annotated[float, "s"] = 1.0
    v_ref: Output = signal_output("m/s", "Speed of the cycle")
    a_ref: Output = signal_output("m/s2", "Mean acceleration of the cycle over the preview")

    def equations(self) -> Equations:
        """The cycle at two times: now and later."""
        if not self.preview > 0:
            raise ParameterError(f"{self._label}: the preview of {self.preview:g} s must be > 0 s")
        times, speeds = self.cycle.times, self.cycle.speeds
        now, later = schedule(times, speeds), schedule(times - self.preview, speeds)
        yield self.v_ref.value == now
        yield self.a_ref.value == (later - now) / self.preview
