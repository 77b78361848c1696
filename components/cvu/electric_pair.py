"""Two electric machines on a common link, controlled by torque: a variable unit whose speed ratio may be infinite."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Input, Parameter, Symbol, Variable, connect, parameter, signal_input, variable, within
from powertrain.components.electric.capacitor import Capacitor
from powertrain.components.electric.machine import ElectricMachine
from powertrain.components.rotational.interfaces import TwoFlanges

SHARE = 0.9
"""Share of a machine's torque available to the speed control; the rest is for the power of the link."""
LEAST = 1e-3
"""A machine counts as having at least this share of its largest torque."""


class ElectricPair(TwoFlanges):
    """Two electric machines with speeds controlled to the proportion n_a : n_b, and the capacitor of their link.

    slip = (n_b w_a - n_a w_b)/n,  n^2 = n_a^2 + n_b^2
    tau = k slip/sqrt(1 + (k slip)^2 ((n_b/(n limit_a))^2 + (n_a/(n limit_b))^2)),  limit = 0.9 tau_limit of the machine
    (tau_a, tau_b) = tau (-n_b, n_a)/n - P (w_a, w_b)/(w_a^2 + w_b^2 + slow^2),  P = k_E (E_0 - E),  E_0 = C V_0^2/2

    tau_a and tau_b drive their shafts. The first term acts across the desired proportion: it takes the power tau slip >= 0 from the shafts,
    which is returned to the link. It is zero at the desired proportion, so one machine drives with the power that the other generates. The
    second term is the smallest torque that takes the power P from the shafts, which charges the link and compensates the losses. The speed
    ratio is n_b/n_a; only one of the two may be zero. A shaft may therefore pass rest and turn backward, where the ratio V = w_b/w_a of
    other units is infinite. The first term leaves a tenth of each machine's torque for the second. A link voltage outside [V_min, V_max]
    ends a simulation with an error.
    """

    k: Parameter = parameter("N.m.s/rad", "Gain of the control of the speeds", default=100.0, above=0)
    k_E: Parameter = parameter("1/s", "Gain of the control of the link's energy", default=100.0, above=0)
    V_0: Parameter = parameter("V", "Set point of the link's voltage", default=400.0, above=0)
    V_min: Parameter = parameter("V", "Minimum voltage of the link", default=100.0, above=0)
    V_max: Parameter = parameter("V", "Maximum voltage of the link", default=800.0, above=0)
    slow: Parameter = parameter("rad/s", "Speed below which less power is taken", default=1.0, above=0)
    n_a: Input = signal_input("1", "Desired speed of flange_a; only the proportion to n_b counts")
    n_b: Input = signal_input("1", "Desired speed of flange_b; only the proportion to n_a counts")
    slip: Variable = variable("rad/s", "Deviation of the speeds from the desired proportion", guess=0)
    tau: Variable = variable("N.m", "Torque against this deviation")
    machine_a: ElectricMachine = ElectricMachine(tau_max=300, P_max=100e3, J=0.02, P_0=0)
    machine_b: ElectricMachine = ElectricMachine(tau_max=300, P_max=100e3, J=0.02, P_0=0)
    link: Capacitor = Capacitor()

    def check(self) -> Equations:
        """The set point must be within the range."""
        yield self.V_min < self.V_0
        yield self.V_max > self.V_0

    def equations(self) -> Equations:
        """Machines at the flanges, and the control of their torques."""
        yield connect(self.flange_a, self.machine_a.shaft)
        yield connect(self.flange_b, self.machine_b.shaft)
        yield connect(self.machine_a.bus, self.machine_b.bus, self.link.bus)
        n = ca.sqrt(self.n_a.value**2 + self.n_b.value**2)
        within(n, 1e-6, ca.inf, name="size of the desired speeds of the two machines, n", unit="1")
        within(self.link.v, self.V_min, self.V_max, name="voltage of the link", unit="V")
        a, b = self.n_a.value / n, self.n_b.value / n
        yield from self._across(a, b)
        w_a, w_b = self.machine_a.w, self.machine_b.w
        charging = self.k_E * self.link.C * (self.V_0**2 - self.link.v**2) / 2
        share = charging / (w_a**2 + w_b**2 + self.slow**2)
        yield self.machine_a.torque_demand.value == -b * self.tau - share * w_a
        yield self.machine_b.torque_demand.value == a * self.tau - share * w_b

    def _across(self, a: Symbol, b: Symbol) -> Equations:
        """The torque that controls the proportion, within the limits of both machines."""
        yield self.slip == b * self.machine_a.w - a * self.machine_b.w
        wanted = self.k * self.slip
        limit_a, limit_b = (
            ca.fmax(SHARE * machine.tau_limit, LEAST * machine.tau_max) for machine in (self.machine_a, self.machine_b)
        )
        used = (b / limit_a) ** 2 + (a / limit_b) ** 2
        yield self.tau == wanted / ca.sqrt(1 + wanted**2 * used)

    def initial(self) -> Equations:
        """The link is charged."""
        yield self.link.v == self.V_0
