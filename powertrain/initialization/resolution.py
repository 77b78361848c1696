"""How finely a run resolves time: events of known instants that are closer together count as one."""

from __future__ import annotations

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.switch import timed
from powertrain.dae.tolerances import NOW

_COARSE = 1e-6
"""Resolution of time (s) from which a start is noted, far below the sampling periods and pulses of drivelines."""


def coarse_time(dae: HybridDae, t: float) -> tuple[str, ...]:
    """A note where a start is so late that short pulses are lost, such as at a time since 1970; none without signals of time."""
    resolution = NOW * abs(t)
    if resolution < _COARSE or not (dae.schedules or timed(dae)[1]):
        return ()
    return (
        f"at t = {t:.9g} s, events of time signals within {resolution:.2g} s count as one, so shorter pulses are lost; count time "
        "from the start of the run",
    )
