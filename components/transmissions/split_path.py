"""Split-path transmissions: a differential and a variable unit in parallel."""

from __future__ import annotations

from powertrain import Equations, Input, Parameter, connect, parameter, signal_input
from powertrain.components.blocks import Constant, Feedback
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.cvu.unit import CVU
from powertrain.components.differentials.fundamental import FundamentalDifferential
from powertrain.components.differentials.interfaces import ThreeMembers
from powertrain.components.rotational.clutch import Clutch
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.transmissions.interfaces import VariableTransmission
from powertrain.components.transmissions.layout import Coupling, Layout, members, switched


class _SplitPath(VariableTransmission):
    """Partial: input flange_a (position 1), output flange_b (position 3), the variable unit at position 2."""

    cvu: VariableUnit = CVU(eta_ab=0.9, eta_ba=0.9)
    coupling: Coupling = "input"
    differential: ThreeMembers = FundamentalDifferential(ratio=-1.7, eta_ab=0.95, eta_ba=0.95)


class SplitPathTransmission(_SplitPath):
    """A split-path CVT: power flows from flange_a to flange_b through a differential, and partly through a variable unit.

    ``layout`` gives the positions of the differential's members at 1 (input, flange_a), 2 and 3 (output, flange_b): "bHa" is b at 1, H at
    2, a at 3. Input-coupled (Fig. 8, eqs. 23 and 24), the unit is between 1 and 2; output-coupled, between 3 and 2:

    input-coupled: V = w_2/w_1,  r = w_3/w_1 = R + (1 - R) V,  R = (w_3 - w_2)/(w_1 - w_2)
    output-coupled: V = w_2/w_3,  r = R/(1 - V + R V),  from (w_3 - V w_3) = R (w_1 - V w_3)

    flange_b of the unit is on the side of the differential. The transmission has no inertia: connect inertias to its flanges.
    Errors: ParameterError for a layout or coupling that does not exist.
    Source: D. Yu, N. Beachley, Gear Technology, July/August 1986, pp. 13-16.
    """

    layout: Layout = "bHa"

    def equations(self) -> Equations:
        """The differential's members at their positions."""
        one, two, three = (getattr(self.differential, name) for name in members(self.layout))
        inside = self.coupling == "input"
        yield connect(self.flange_a, one)
        yield connect(self.flange_b, three)
        yield connect(self.cvu.flange_a, one if inside else three)
        yield connect(self.cvu.flange_b, two)
        yield connect(self.ratio, self.cvu.ratio)


class SwitchedSplitPathTransmission(_SplitPath):
    """A split-path transmission in which clutches exchange two members of the differential while driving (combinations I-IX).

    Four clutches connect the two members to the two positions that they exchange: for shift = 0 as in ``first``, for shift = 1
    as in ``second``; between 0 and 1 one pair opens while the other closes. All four slip at most by w_p - w_q, the speed difference
    between the two positions, so a shift at equal speeds is free of slip (V = 1 if 1 and 2 change in an input-coupled
    transmission).

    The members have inertias J_a, J_b, J_h, and the variable unit's shaft J_v, because nothing else holds them while their clutches are
    open. If all clutches hold at once, their shares of the torque are not determined; one distribution is used, and the notes of the result
    say so. With a unit of exact ratio V = 1 the torque of the mesh is then undetermined, too, which may end the simulation: let the pairs
    overlap while they slip, or use a unit that creeps. Errors: ParameterError if the two layouts do not differ by exactly two members.
    Source: D. Yu, N. Beachley, Gear Technology, July/August 1986, Table 1 and p. 16.
    """

    first: Layout = "bHa"
    second: Layout = "Hba"
    J_a: Parameter = parameter("kg.m2", "Moment of inertia of member a", default=1e-3, above=0)
    J_b: Parameter = parameter("kg.m2", "Moment of inertia of member b", default=1e-3, above=0)
    J_h: Parameter = parameter("kg.m2", "Moment of inertia of the carrier", default=1e-3, above=0)
    J_v: Parameter = parameter("kg.m2", "Moment of inertia of the variable unit's shaft at 2", default=1e-3, above=0)
    capacity: Parameter = parameter("N.m", "Torque of a closed clutch while it slips", default=1e3, above=0)
    shift: Input = signal_input("1", "0: the first layout, 1: the second")
    clutches: tuple[Clutch, ...] = (Clutch(fn_max=1, mue_pos=((0.0, 1.0),)),) * 4
    shafts: tuple[Inertia, ...] = (Inertia(J=1),) * 3
    place: Inertia = Inertia(J=1)
    one: Constant = Constant(k=1)
    opening: Feedback = Feedback()

    def equations(self) -> Equations:
        """The member that keeps its position, and the two that change."""
        yield from self._data()
        input_coupled = self.coupling == "input"
        p, q, stays = switched(self.first, self.second)
        names = members(self.first)
        shaft: dict[str, Inertia] = dict(zip(("a", "b", "carrier"), self.shafts, strict=True))
        for name, part in shaft.items():
            yield connect(part.flange_a, getattr(self.differential, name))
        x, y = shaft[names[p]].flange_b, shaft[names[q]].flange_b
        straight, crossed = self.clutches[:2], self.clutches[2:]
        at_p = [straight[0].flange_a, crossed[0].flange_a]
        at_q = [straight[1].flange_a, crossed[1].flange_a]
        yield connect(x, straight[0].flange_b, crossed[1].flange_b)
        yield connect(y, straight[1].flange_b, crossed[0].flange_b)
        places = {p: at_p, q: at_q, stays: [shaft[names[stays]].flange_b]}
        places[0 if input_coupled else 2].append(self.cvu.flange_a)
        places[1].append(self.place.flange_b)
        yield connect(self.cvu.flange_b, self.place.flange_a)
        yield connect(self.flange_a, *places[0])
        yield connect(*places[1])
        yield connect(self.flange_b, *places[2])

    def _data(self) -> Equations:
        for part, J in zip((*self.shafts, self.place), (self.J_a, self.J_b, self.J_h, self.J_v), strict=True):
            yield part.J == J
        for clutch in self.clutches:
            yield clutch.fn_max == clutch.force(self.capacity)
        yield connect(self.one.y, self.opening.u1)
        yield connect(self.shift, self.opening.u2, *(clutch.f_normalized for clutch in self.clutches[2:]))
        yield connect(self.opening.y, *(clutch.f_normalized for clutch in self.clutches[:2]))
        yield connect(self.ratio, self.cvu.ratio)
