"""Stress over plastic strain: the laws that are identified, and the tables that a scene takes of them.

Under a tip a law has E over the yield stress and numbers of its own, its shape, in coordinates in which runs
are planned and polynomials are smooth; `reported` are the constants as the field writes them."""

from dataclasses import dataclass

import numpy as np

STRAINS = 60  # rows of a table
LARGEST = 4.0  # plastic strain where a table ends
TENTH = 0.1  # plastic strain that Ludwik's hardening is measured at


def power_law(young, yield_stress, exponent, strain):
    """sigma_y (1 + E eps / sigma_y)^n: stress (Pa) at plastic strains."""
    return yield_stress * (1 + young * np.asarray(strain) / yield_stress) ** exponent


def ludwik(young, yield_stress, factor, exponent, strain):
    """sigma_y + K eps^n."""
    return yield_stress + factor * np.asarray(strain) ** exponent


def voce(young, yield_stress, rise, rate, strain):
    """sigma_y + Q (1 - exp(-b eps))."""
    return yield_stress + rise * (1 - np.exp(-rate * np.asarray(strain)))


LAWS = {
    "power": (power_law, ["young", "yield_stress", "hardening_exponent"]),
    "ludwik": (ludwik, ["young", "yield_stress", "hardening_factor", "hardening_exponent"]),
    "voce": (voce, ["young", "yield_stress", "hardening_rise", "hardening_rate"]),
}


@dataclass(frozen=True)
class Law:
    """low, high: of the shape's coordinates; names: of the constants, which `constants(yield_stress, shape)`
    gives, with a title and a unit for each. `flows`: it has a yield stress."""

    name: str
    low: tuple
    high: tuple
    names: tuple
    titles: tuple
    scales: tuple
    flows: bool = True

    @property
    def parameters(self):
        """Names of what is found."""
        return ("modulus", "yield_stress", *self.names) if self.flows else ("modulus",)

    def constants(self, yield_stress, shape):
        """Of the law, as LAWS has them; shape: a sequence of its coordinates (numbers or arrays)."""
        if self.name == "ludwik":
            return shape[1] * yield_stress / TENTH ** shape[0], shape[0]
        if self.name == "voce":
            return shape[0] * yield_stress, np.exp(shape[1])
        return tuple(shape)

    def coordinate(self, name, value, yield_stress):
        """The place and value of the coordinate that a constant (SI) is, where it is one by itself: else
        None."""
        if self.name == "power" or (self.name, name) == ("ludwik", "hardening_exponent"):
            return 0, value
        if (self.name, name) == ("voce", "hardening_rate"):
            return 1, float(np.log(value))
        return None

    def stress(self, young, yield_stress, shape, strain):
        """Pa, at plastic strains; an elastic law has its modulus here."""
        if not self.flows:
            return np.asarray(young) + 0 * np.asarray(strain)
        return LAWS[self.name][0](young, yield_stress, *self.constants(yield_stress, shape), strain)

    def material_words(self, young, yield_stress, shape):
        """The variables of a &material beside its density and elastic moduli."""
        if not self.flows:
            return ""
        if self.name == "power" and shape[0] == 0:
            return f"yield_stress={yield_stress:.9g}"
        strain, stress = table(
            lambda e: self.stress(young, yield_stress, shape, e), 0.05 * yield_stress / young
        )
        listed = lambda values: ",".join(f"{value:.7g}" for value in values)
        return f"hardening_strain={listed(strain)},\n          hardening_stress={listed(stress)}"


KNOWN = {
    law.name: law
    for law in (
        Law("power", (0.0,), (0.55,), ("exponent",), ("hardening exponent",), ((1.0, ""),)),
        Law(
            "ludwik", (0.2, 0.0), (0.8, 3.0), ("hardening_factor", "hardening_exponent"),
            ("hardening factor K", "hardening exponent"), ((1e-6, "MPa"), (1.0, "")),
        ),
        Law(
            "voce", (0.0, float(np.log(4.0))), (3.0, float(np.log(60.0))),
            ("hardening_rise", "hardening_rate"),
            ("hardening rise Q", "hardening rate b"), ((1e-6, "MPa"), (1.0, "")),
        ),
        Law("elastic", (), (), (), (), (), flows=False),
    )
}  # fmt: skip
POWER = KNOWN["power"]


def table(stress, first):
    """Plastic strains and stresses (Pa) of a law for `hardening_strain` and `hardening_stress`; `first` is a
    strain that is small for it."""
    strain = np.concatenate([[0.0], np.geomspace(first, LARGEST, STRAINS)])
    return strain, stress(strain)
