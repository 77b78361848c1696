"""Consumption of vehicles whose charge differs between start and end of a cycle; charge-depleting and charge-sustaining tests."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.errors import suggestion
from powertrain.language.arguments import by_name, count, of_kind
from powertrain.trials.anatomy import anatomy, charge_at_start
from powertrain.trials.cycle import drive_cycle, on_cycle
from powertrain.trials.cycle_run import SHARE, CycleRun

NEC_TOLERANCE = 0.01
"""A test is charge-sustaining up to this net energy change relative to the energy of the fuel, SAE J1711."""
NEC_LIMIT = 0.05
"""Up to this net energy change relative to the energy of the fuel a single run is corrected, SAE J1711."""
BREAK_OFF = 0.04
"""A charge-depleting test ends below this change of the charge relative to the cycle's energy demand, UN Regulation No. 154, Annex B8."""
SPREAD = (-0.04, -0.02, 0.0, 0.02, 0.04)
"""States of charge of the tests for the correction, relative to the middle one; the regulation requires five or more."""


def stores_of(run: CycleRun) -> tuple[str, ...]:
    """The components of a vehicle that carry energy from one drive to the next: those in ``stores`` of its class, else its batteries."""
    return run.anatomy.stores


def charge_corrected(run: CycleRun, *stores: str, path: float | str = 1.0) -> float:
    """Consumption [l/100 km] corrected to equal charge of the ``stores`` by one run (charge-sustaining correction).

    ``stores`` are components, such as "battery" or "flywheel"; by default those of ``stores_of``. The energy they gained counts as work of
    the engine, at its marginal efficiency over the cycle times ``path``, the efficiency from its crankshaft into the store:
      fuel - gained/(path marginal efficiency heating value)
    Additional work does not increase the friction of an engine that runs anyway, so it costs less than the mean. nan if the engine did not
    run or the vehicle did not move. ``charge_sustaining`` is the method of the regulation, with five runs.
    SAE J1711 corrects up to a net energy change of 5 % of the fuel's energy (``beyond_correction``). A plug-in hybrid that drove on its
    battery is far beyond: the marginal efficiency of an engine that hardly ran says little about the charge-sustaining consumption.
    Errors: ParameterError for a store that the vehicle does not have, and for a ``path`` that is not above 0 and at most 1.
    """
    gained = _gained(run, *stores)
    share: float = SHARE.check(path, "charge_corrected: path")
    if not run.fuel > 0:
        return math.nan
    return run.litres_per_100km * (1 - gained / (share * run.marginal_efficiency) / run.heat)


def beyond_correction(run: CycleRun, *stores: str) -> str:
    """Why a run is too far from equal charge for a correction; empty if it is not."""
    change = _gained(run, *stores) / run.heat if run.fuel > 0 else 0.0
    if abs(change) <= NEC_LIMIT:
        return ""
    name = " and ".join(stores or stores_of(run))
    return (
        f"the {name} {'gained' if change > 0 else 'gave'} {abs(change):.0%} of the fuel's energy, too far from equal charge for a "
        f"correction, which holds up to {NEC_LIMIT:.0%}; start at the charge that the vehicle sustains (drive_cycle(..., starts=...), "
        "powertrain run --start ...), or use trials.charge_sustaining"
    )


def _gained(run: CycleRun, *stores: str) -> float:
    """Energy [J] that the stores gained. Errors: ParameterError for a store that the vehicle does not have."""
    of_kind("charge_corrected", run, CycleRun, "a run of drive_cycle()")
    table = run.audit.components["stored"]
    for store in stores:
        if store not in table.index:
            known = [str(name) for name in table.index]
            raise pt.ParameterError(
                f"charge_corrected: {run.anatomy.vehicle} has no component {store!r}{suggestion(store, known)}"
            )
    return sum(float(table.loc[store]) for store in stores or stores_of(run))


@dataclass(frozen=True)
class ChargeSustaining:
    """Tests of a hybrid from several states of charge, and the consumption at equal charge by their regression.

    ``tests``: one row per test with soc [1], charge [W.h/km] (positive if the battery gained), consumption [l/100 km], CO2 [g/km], and
    net energy change over the energy of the fuel [1]. ``K_fuel`` [l/100 km per W.h/km] and ``K_co2`` [g/W.h] are the slopes.
    """

    tests: pd.DataFrame
    K_fuel: float
    K_co2: float

    @property
    def nearest(self) -> pd.Series[float]:
        """The test with the smallest change of charge."""
        return self.tests.iloc[int(np.argmin(np.abs(self.tests["charge"].to_numpy())))]

    @property
    def litres_per_100km(self) -> float:
        """Consumption of the nearest test minus K_fuel times its charge [l/100 km]."""
        return float(self.nearest["consumption"] - self.K_fuel * self.nearest["charge"])

    @property
    def co2_per_km(self) -> float:
        """Carbon dioxide of the nearest test minus K_co2 times its charge [g/km]."""
        return float(self.nearest["carbon dioxide"] - self.K_co2 * self.nearest["charge"])

    @property
    def sustains(self) -> bool:
        """Whether the nearest test is within the tolerance of SAE J1711: net energy change below 1 % of the fuel's energy."""
        return bool(abs(self.nearest["net energy change"]) <= NEC_TOLERANCE)


def charge_sustaining(
    vehicle: pt.Component,
    cycle: DriveCycle | str | None = None,
    *,
    soc: float | None = None,
    spread: Sequence[float] = SPREAD,
    **options: Any,
) -> ChargeSustaining:
    """Consumption at equal charge by the method of UN Regulation No. 154, Annex B8, Appendix 2, and SAE J1711.

    The cycle is driven from several states of charge. A least-squares line through consumption over electric energy has the slope K, which
    corrects the test with the smallest change of charge:
      FC_CS = FC - K_fuel EC,  EC = energy gained by the battery/distance
    The energy gained is that of the charge, at the open-circuit voltage: equal charge is an equal state of charge. At the terminals the
    battery takes more, by its losses.

    Parameters
    ----------
    vehicle : Component
        A vehicle with one battery and an engine.
    cycle : DriveCycle or str, optional
        A cycle or its name; by default that of the vehicle.
    soc : float, optional
        State of charge [1] around which the tests start; by default the vehicle's own start value.
    spread : sequence of float
        Offsets from ``soc`` [1], one per test.
    **options
        Options of ``drive_cycle``.

    Returns
    -------
    ChargeSustaining

    Raises
    ------
    ParameterError
        If the vehicle does not have one battery and an engine, for fewer than two different states of charge, if a run ended early, and
        for tests that are further from equal charge than from each other: their straight line says nothing about it.
    """
    battery = _the_battery(vehicle, "charge_sustaining")
    middle = charge_at_start(vehicle, battery) if soc is None else soc
    if len(set(spread)) < 2:
        raise pt.ParameterError(f"charge_sustaining needs two or more different states of charge; spread is {spread!r}")
    plant = pt.compile(on_cycle(vehicle, cycle))
    runs = [_from_soc(plant, battery, middle + offset, **options) for offset in spread]
    rows = [
        {
            "soc": middle + offset,
            "charge": -run.wh_per_km,
            "consumption": run.litres_per_100km,
            "carbon dioxide": run.co2_per_km,
            "net energy change": run.net_energy_change,
        }
        for offset, run in zip(spread, runs, strict=True)
    ]
    tests = pd.DataFrame(rows)
    _check_reach(tests)
    K_fuel, K_co2 = (
        float(np.polyfit(tests["charge"], tests[name], 1)[0]) for name in ("consumption", "carbon dioxide")
    )
    return ChargeSustaining(tests, K_fuel, K_co2)


def _check_reach(tests: pd.DataFrame) -> None:
    """Raise ParameterError if equal charge lies outside the tests by more than their span: a plug-in hybrid that drives on its battery."""
    charges = tests["charge"].to_numpy(float)
    if np.abs(charges).min() > np.ptp(charges):
        means, low, high = ("discharge" if charges[0] < 0 else "charge"), np.abs(charges).min(), np.abs(charges).max()
        begun = f"from states of charge of {tests['soc'].min():g} to {tests['soc'].max():g}"
        raise pt.ParameterError(
            f"charge_sustaining: the tests, {begun}, {means} the battery by {low:.4g} to {high:.4g} W.h/km, too far from equal charge for "
            "a correction: give soc, the state of charge that the vehicle sustains, or a larger spread"
        )


def charge_depleting(
    vehicle: pt.Component,
    cycle: DriveCycle | str | None = None,
    *,
    soc: float = 0.95,
    most: int = 20,
    starts: Mapping[str, Any] | None = None,
    **options: Any,
) -> pd.DataFrame:
    """The charge-depleting test of a plug-in hybrid: the cycle is repeated until the charge no longer changes.

    Every cycle begins with the charge and the temperatures with which the last one ended; ``starts`` hold for the first.
    The test ends when the change of the charge falls below 4 % of the energy demand of the cycle (UN Regulation No. 154, Annex B8,
    3.2.4.5). The distance before the last row is the charge-depleting cycle range. If the test ends after ``most`` cycles without
    reaching this, a RuntimeWarning says that there is no such range.

    Parameters
    ----------
    vehicle : Component
        A vehicle with one battery and an engine.
    cycle : DriveCycle or str, optional
        A cycle or its name; by default that of the vehicle.
    soc : float
        State of charge at the start [1].
    most : int
        Largest number of cycles.
    starts : mapping of str to float, optional
        Initial values by name, except for the state of charge, as in ``drive_cycle``.
    **options
        Options of ``drive_cycle``.

    Returns
    -------
    pandas.DataFrame
        One row per cycle, including the last: soc at its end [1], distance [km] since the start, W.h/km from the battery, l/100 km, g/km
        CO2, and the change of the charge over the energy demand of the cycle [1].

    Raises
    ------
    ParameterError
        If the vehicle does not have one battery and an engine, for a ``most`` below 1, and if a run ended early.
    """
    battery, cycles = _the_battery(vehicle, "charge_depleting"), count("charge_depleting: most", most)
    plant, rows, driven, change = pt.compile(on_cycle(vehicle, cycle)), [], 0.0, math.inf
    begun = by_name("starts", starts)
    for _ in range(cycles):
        run = _from_soc(plant, battery, soc, begun, **options)
        begun = _as_warm(run, begun)
        soc, driven = float(run.result[f"{battery}.soc"][-1]), driven + run.distance / 1e3
        change = abs(run.electricity) / run.demand
        rows.append(
            {
                "soc": soc,
                "distance": driven,
                "from the battery": run.wh_per_km,
                "consumption": run.litres_per_100km,
                "carbon dioxide": run.co2_per_km,
                "relative change": change,
            }
        )
        if change < BREAK_OFF:
            break
    else:
        warnings.warn(
            f"charge_depleting: after {most} cycles, {driven:.1f} km, the charge still changes by {change:.0%} of the energy demand of "
            f"the cycle, at a state of charge of {soc:.2f}; the range is longer: give a larger most, or a longer cycle",
            RuntimeWarning,
            stacklevel=2,
        )
    return pd.DataFrame(rows, index=pd.RangeIndex(1, len(rows) + 1, name="cycle"))


def electric_share(run: CycleRun) -> float:
    """Share of the distance that a hybrid drove with its engines off [1]; nan if it did not move.

    Errors: ParameterError for a vehicle without an engine.
    """
    of_kind("electric_share", run, CycleRun, "a run of drive_cycle()")
    if not run.anatomy.engines:
        raise pt.ParameterError(f"electric_share needs a vehicle with an engine; {run.anatomy.vehicle} has none")
    t, v = run.result.time, run.speed
    on = np.max([run.result[f"{engine}.on"] for engine in run.anatomy.engines], axis=0)
    driven = float(np.trapezoid(v, t))
    return float(np.trapezoid(np.where(on > 0.5, 0.0, v), t)) / driven if driven else math.nan


def _from_soc(
    plant: pt.Plant[Any], battery: str, soc: float, starts: Mapping[str, Any] | None = None, **options: Any
) -> CycleRun:
    begun = by_name("starts", starts)
    if (charge := f"{battery}.soc") in begun:
        raise pt.ParameterError(
            f"starts: give {charge} = {begun[charge]} as soc: the tests start at states of charge of their own"
        )
    run = drive_cycle(plant, starts={**begun, charge: soc}, **options)
    if run.message:
        raise pt.ParameterError(f"from a state of charge of {soc:.3f}: {run.message}")
    return run


def _as_warm(run: CycleRun, starts: Mapping[str, Any]) -> dict[str, Any]:
    """``starts`` for a run that begins with the temperatures at the end of this one."""
    result, units = run.result, run.result.units
    warm = {name: float(result[name][-1]) for name in result.compiled.states if units[name] == "K"}
    return {name: value for name, value in starts.items() if units[name] != "K"} | warm


def _the_battery(vehicle: pt.Component, asked: str) -> str:
    parts = anatomy(vehicle)
    if len(parts.batteries) != 1 or not parts.engines:
        raise pt.ParameterError(
            f"{asked} needs a vehicle with one battery and an engine; {parts.vehicle} has {len(parts.batteries)} batteries and "
            f"{len(parts.engines)} engines"
        )
    return parts.batteries[0]
