from __future__ import annotations

import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.components.differentials import BevelDifferential, Differential, LimitedSlipDifferential
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.gearless.linkage import LinkageDifferential
from powertrain.components.gearless.spherical_cam import SphericalCamDifferential
from powertrain.trials.differential import differential_map, plot_differential_map

DIFFERENCES, TORQUES = [4.0, 17.6], [-200.0, 100.0, 400.0]


def test_limited_slip_by_its_bias() -> None:
    """T_slow/T_fast = bias, so the loss is (bias - 1)/(bias + 1) |T| difference/2."""
    bias = 2.5
    found = differential_map(
        LimitedSlipDifferential(bias_drive=bias, bias_coast=bias, preload=0.0), DIFFERENCES, TORQUES
    )
    for d in DIFFERENCES:
        for t in TORQUES:
            point = found.sel(difference=d, torque=t)
            loss = (bias - 1) / (bias + 1) * abs(t) * d / 2
            assert float(point["loss"]) == pytest.approx(loss, rel=1e-9)
            assert float(point["left"] + point["right"]) == pytest.approx(t)
            wanted = 1 - loss / (t * 88) if t > 0 else 1 / (1 + loss / (-t * 88))
            assert float(point["efficiency"]) == pytest.approx(wanted)


@pytest.mark.parametrize(
    "kind",
    few([BevelDifferential(), CircularCamDifferential(), SphericalCamDifferential(), LinkageDifferential()]),
    ids=lambda d: type(d).__name__,
)
def test_losses_are_never_negative_and_torques_balance(kind: Differential) -> None:
    found = differential_map(kind, DIFFERENCES, TORQUES)
    assert float(found["loss"].min()) >= -1e-6
    assert (found["left"] + found["right"]).values == pytest.approx(np.broadcast_to(TORQUES, (2, 3)), rel=1e-3)
    assert float(found["efficiency"].max()) <= 1 + 1e-9


def test_means_are_over_time_where_torques_jump() -> None:
    """At a jump a result has samples on both sides, which must not count for more."""
    differential = SphericalCamDifferential(sharing="single")
    point = differential_map(differential, [10.0], [100.0]).isel(difference=0, torque=0)
    psi = (np.arange(20_000) + 0.5) * np.pi * differential.cam.N / differential.cam.M / 20_000
    kappa = differential.cycle.kappa(psi).mean()
    assert float(point["right"] - point["left"]) == pytest.approx(100 * kappa, rel=2e-4)


def test_figure_and_bad_differences() -> None:
    ax = plot_differential_map(differential_map(BevelDifferential(eta=0.9), DIFFERENCES, [100.0, 200.0]))
    assert "Speed difference" in ax.get_xlabel()
    with pytest.raises(pt.ParameterError, match="this map has 1 and 2"):
        plot_differential_map(differential_map(BevelDifferential(), [1.0], [100.0, 200.0]))
    with pytest.raises(pt.ParameterError, match="a speed difference of 0 rad/s is not allowed"):
        differential_map(BevelDifferential(), [0.0], [100.0])
