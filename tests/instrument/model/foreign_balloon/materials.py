"""Rubber laws of the pressed balloons, in kPa, as materials of felupe.

The laws `gent` and `ogden` are scaled, so that their free balloon has the same radius at 8 kPa as the
balloon of the law `mooney-rivlin`. The scale factor follows from the finite-element solution, because the
pressure of a free balloon at a given radius is proportional to the moduli.
"""

import felupe.constitution.tensortrax as mat
import tensortrax.math as tm

MOONEY_RIVLIN_KPA = {"C10": 131.511, "C01": 51.167}
GENT_LIMIT = 30.0
#: Exponents and moduli of Ogden's law, W = Σ μ/α (λ₁^α + λ₂^α + λ₃^α − 3). The moduli are relative.
OGDEN_EXPONENTS, OGDEN_MODULI = (1.3, 5.0, -2.0), (6.3, 0.012, -0.1)
#: Shear modulus of all laws before they are scaled: that of the law `mooney-rivlin`.
SHEAR_MODULUS_KPA = 2 * sum(MOONEY_RIVLIN_KPA.values())


def _gent(C, mu, limit):
    """Return the strain energy of Gent (1996) for the isochoric part of the right Cauchy-Green tensor C."""
    first_invariant = tm.linalg.det(C) ** (-1 / 3) * tm.trace(C)
    return -mu * limit / 2 * tm.log(1 - (first_invariant - 3) / limit)


def material(law, scale=1.0):
    """Return the material of a law of `cases.LAWS`, with all moduli multiplied by a scale factor."""
    models = mat.models.hyperelastic
    if law == "mooney-rivlin":
        moduli = {name: scale * modulus for name, modulus in MOONEY_RIVLIN_KPA.items()}
        return mat.Hyperelastic(models.mooney_rivlin, **moduli)
    if law == "gent":
        return mat.Hyperelastic(_gent, mu=scale * SHEAR_MODULUS_KPA, limit=GENT_LIMIT)
    # The moduli of felupe are the shares of the shear modulus, which is Σ μ α / 2 in Ogden's notation.
    shares = [m * a / 2 for m, a in zip(OGDEN_MODULI, OGDEN_EXPONENTS, strict=True)]
    moduli = [scale * SHEAR_MODULUS_KPA * share / sum(shares) for share in shares]
    return mat.Hyperelastic(models.ogden, mu=moduli, alpha=list(OGDEN_EXPONENTS))
