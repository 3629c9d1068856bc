"""Stress over plastic strain: the laws that are identified, and the tables that a scene takes of them."""

import numpy as np

STRAINS = 60  # rows of a table
LARGEST = 4.0  # plastic strain where a table ends


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


def table(stress, first):
    """Plastic strains and stresses (Pa) of a law for `hardening_strain` and `hardening_stress`; `first` is a
    strain that is small for it."""
    strain = np.concatenate([[0.0], np.geomspace(first, LARGEST, STRAINS)])
    return strain, stress(strain)


def material_words(young, yield_stress, exponent):
    """yield_stress, or the table, of the power law as a &material has them."""
    if exponent == 0:
        return f"yield_stress={yield_stress:.9g}"
    strain, stress = table(lambda e: power_law(young, yield_stress, exponent, e), 0.05 * yield_stress / young)
    return (
        "hardening_strain="
        + ",".join(f"{value:.7g}" for value in strain)
        + ",\n          hardening_stress="
        + ",".join(f"{value:.7g}" for value in stress)
    )
