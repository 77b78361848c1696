"""Built power-split transmissions from their descriptions, with what is published of them.

Toyota: P410 transaxle, repair manual (2010 on): teeth 30/23/78, 22/18/58, 54/55, 24/77, total reduction 3.267. Before: G. Davies,
"Graham's Toyota Prius" (ecrostech): MG1 = 3.6 ICE - 2.6 MG2.

AHS-2 (2ML70): S. Garrett, A New Kid on the Block: 2ML70 (RPO M99), Gears: fixed gears 3.69, 1.70, 1.00, 0.73; EVT 1 from infinity to
1.70, EVT 2 from 1.70 to 0.50. How its three planetaries and four clutches are joined: GM's patent US 6 953 409.

Fendt Vario: Farmers Weekly, 17 November 1995 and 18 October 1997: the engine at the carrier, the sun at the output, the ring at the
pump, the motors at the output; ranges to 31 and 20 mph; at 50 km/h all mechanical; 81.1 % of the engine's power at the wheels.

Steyr S-Matic: Farmers Weekly, 12 March 1999 and 16 June 2000: the unit turns from minus to plus the input's speed while the output
goes from 0 to 100 %; all mechanical at 8 km/h in the first of four ranges; half of the power hydrostatic at most; shifts at equal speeds.
"""

from __future__ import annotations

import numpy as np
import pytest
from two_mode import C1, C2, C3, C4, ahs2

from powertrain.components.differentials.teeth import Planets, Ring, Sun, basic_ratio
from powertrain.components.transmissions import HOUSING, Lever, Network, UnitLoss, flow, relative_ratio

SPLIT = basic_ratio(Sun(30), Ring(78), Planets(23, n=4))
"""Toyota's power split device, which can be put together with four planets."""


def toyota(*gears: Lever, motor: str = "ring") -> Network:
    """Engine at the carrier, MG1 at the sun, MG2 at the ring or in gear with it."""
    return Network((Lever("split", "mg1", "ring", "in", SPLIT), *gears), ("mg1", motor))


def speeds(network: Network, r: float) -> dict[str, float]:
    """Speeds of all shafts over that of the input."""
    factors = network.speeds() @ np.array([1.0, r])
    return {name: float(factors[node]) for name, node in network.nodes.items() if node >= 0}


def test_toyota_first_generations() -> None:
    """MG1 = 3.6 ICE - 2.6 MG2; at 62 mph with the engine at rest MG2 turns at 3,664 rpm and MG1 at -9,527 rpm (Davies)."""
    network = Network((Lever("split", "mg1", "out", "in", SPLIT),), ("mg1", "out"))
    assert network.speeds()[network.nodes["mg1"]] == pytest.approx([3.6, -2.6], rel=1e-12)
    assert round((network.speeds()[network.nodes["mg1"]] @ [0, 59.1 * 62]).item()) == -9527
    assert network.mechanical_point("mg1") == pytest.approx(3.6 / 2.6)
    found = flow(network, [0.5, 3.6 / 2.6, 1.8], 10.0)
    assert found.tau[0] == pytest.approx(found.tau_in / 3.6)  # 28 % of the engine's torque is MG1's
    assert np.sign(found.K.round(12)).tolist() == [1, 0, -1]  # split, all mechanical, recirculation


def test_toyota_p410() -> None:
    counter, final = Lever("counter", "ring", "c", HOUSING, -55 / 54), Lever("final", "c", "out", HOUSING, -77 / 24)
    reduction = Lever("reduction", "mg2", "ring", HOUSING, basic_ratio(Sun(22), Ring(58), Planets(18, n=5)))
    network = toyota(reduction, counter, final, motor="mg2")
    at = speeds(network, 0.3)
    total = at["ring"] / 0.3
    assert np.floor(1000 * total) / 1000 == 3.267
    assert -at["mg2"] / at["ring"] == pytest.approx(2.636, abs=5e-4)
    assert at["mg1"] == pytest.approx(18 / 5 - 143 / 145 * -at["mg2"])  # as owners found from these teeth
    assert network.mechanical_point("mg1") * total == pytest.approx(3.6 / 2.6)
    lossy = flow(network, np.linspace(0.05, 0.5, 19), 300.0, loss=UnitLoss(0.85, 0.85))
    best = np.linspace(0.05, 0.5, 19)[lossy.efficiency[0].argmax()]
    assert best == pytest.approx(network.mechanical_point("mg1"), abs=0.05)


def test_ahs2_fixed_gears_and_mechanical_points() -> None:
    """The first and second gear give R_3 and R_1 R_2; then the fourth, the printed 0.73, follows: 1 - 0.70/2.69 = 0.7398 (truncated)."""
    R_3 = 3.69 - 1
    product = R_3 / (1.70 - 1)
    R_1 = R_2 = np.sqrt(product)
    gears = [ahs2(R_1, R_2, R_3).range(*held).fixed_ratio() for held in ((C1, C4), (C1, C2), (C2, C4), (C2, C3))]
    assert gears[:3] == pytest.approx([3.69, 1.70, 1.00], abs=1e-9)
    assert np.floor(100 * gears[3]) / 100 == 0.73
    first, second = ahs2(R_1, R_2, R_3).range(C1), ahs2(R_1, R_2, R_3).range(C2)
    assert second.mechanical_point("B") == pytest.approx(1 / gears[3])  # the fourth gear holds B
    assert first.mechanical_point("B") == 0  # EVT 1 begins at an infinite reduction
    shift = 1 / 1.70
    both = [speeds(range_, shift) for range_ in (first, second)]
    for name in ("A", "B", "carriers", "in"):
        assert both[0][name] == pytest.approx(
            both[1][name], abs=1e-9
        )  # EVT 1 and 2 meet at 1.70, at equal speeds of all shafts


def test_ahs2_power_of_the_machines() -> None:
    """In EVT 2 little goes through the machines between its mechanical points: K = (r - r_A)(r - r_B)/(r (r_A - r_B)), any ratios."""
    network = ahs2(1.97, 1.97, 2.69).range(C2)
    r_A, r_B = network.mechanical_point("A"), network.mechanical_point("B")
    r = np.linspace(r_A, r_B, 101)
    K = flow(network, r, 100.0).K
    assert abs(K).max() == pytest.approx((np.sqrt(r_B) - np.sqrt(r_A)) ** 2 / (r_B - r_A), rel=1e-3)
    assert abs(K).max() < 0.18
    assert flow(ahs2(1.97, 1.97, 2.69).range(C1), [1e-6], 100.0).K[0] == pytest.approx(1, abs=1e-4)


def vario(ring_over_sun: float, eta: float = 1.0) -> Network:
    """Carrier driven, ring at the pump, sun at the motors and the output: type 2, output-coupled."""
    return Network.split_path("Hba", "output", -ring_over_sun, eta)


@pytest.mark.parametrize("ring_over_sun", [1.5, 2.0, 3.0])
def test_fendt_vario(ring_over_sun: float) -> None:
    """All hydrostatic when it starts, all mechanical at 50 km/h, linear between, whatever the teeth."""
    network = vario(ring_over_sun)
    assert network.unit == ("2", "out")
    top = network.mechanical_point("2")
    assert top == pytest.approx(1 + ring_over_sun)
    km_h = np.array([1e-6, 10.0, 25.0, 40.0, 50.0])
    found = flow(network, km_h / 50 * top, 100.0)
    np.testing.assert_allclose(found.K, 1 - km_h / 50, atol=1e-6)
    assert found.V[0] == pytest.approx(0, abs=1e-6)  # the pump begins without displacement
    lossy = flow(network, km_h[1:] / 50 * top, 100.0, loss=UnitLoss(0.8, 0.8))
    assert lossy.efficiency[0] == pytest.approx(
        1 - 0.2 * (1 - km_h[1:] / 50)
    )  # the carrier's torque is shared in a constant ratio
    assert lossy.efficiency[0, 1:].min() > 0.811 > lossy.efficiency[0, 0] - 0.03


def test_fendt_vario_ranges() -> None:
    """31 and 20 mph: a pair of gears behind; the powers are the same at the same part of the range's top speed."""
    planetary = Lever("differential", "last", "2", "in", -2.0)
    high, slow = (
        Network((planetary, Lever("range", "last", "out", HOUSING, i)), ("2", "last")) for i in (1.2, 1.2 * 31 / 20)
    )
    tops = [each.mechanical_point("2") for each in (high, slow)]
    assert tops[0] / tops[1] == pytest.approx(31 / 20)
    for part in (0.2, 0.7):
        K = [flow(each, [part * top], 50.0).K[0] for each, top in zip((high, slow), tops, strict=True)]
        assert K[0] == pytest.approx(K[1]) == pytest.approx(1 - part)


def test_steyr_s_matic() -> None:
    """V from -1 to 1 for an output from 0 to 100 %: R = 1/2, a differential with R_o = -1 and the output at its carrier (type 4)."""
    R_o = -1.0
    assert relative_ratio("abH", R_o) == 0.5
    network = Network.split_path("abH", "input", R_o)
    r = np.array([1e-9, 0.25, 0.5, 0.75, 1 - 1e-9])
    found = flow(network, r, 100.0)
    np.testing.assert_allclose(found.V, 2 * r - 1)
    assert network.mechanical_point("2") == 0.5  # 8 km/h, the middle of a first range to 16 km/h
    assert found.K[3:] == pytest.approx([1 / 3, 0.5], abs=1e-6)  # at most half of the power is hydrostatic
    assert found.K[1] == pytest.approx(-1)  # below the mechanical point power comes back
