"""E5 by model='j2' and by its VUMAT."""

import re

from run_scene import ROOT, replace, run
from checks import check, finish, require
from vumat_fields import far, newest

BUILT_IN = "model='j2', density=2710, young=70e9, poisson=0.33, yield_stress=60e6, hardening_modulus=3.5e9"
VUMAT = "model='vumat', density=2710, library='./j2.so', constants=70e9,0.33,60e6,3.5e9, states=1"

for scene in ("bilinear_patch", "bilinear_levels"):
    text = (ROOT / f"input/{scene}.nml").read_text()
    for name, law in (("j2", BUILT_IN), ("vumat", VUMAT)):
        run(re.sub(r"directory='[^']*'", f"directory='{scene}_{name}'", replace(text, BUILT_IN, law)), 1)
    built_in, ours = newest(f"{scene}_j2"), newest(f"{scene}_vumat")
    require("there is flow", built_in["plastic_strain"].max() > 1e-3)
    for field, other in (("SDV1", "plastic_strain"), ("stress", "stress"), ("velocity", "velocity")):
        check(f"{scene}: {field} off model='j2', relative", far(ours[field], built_in[other]), 1e-10)
finish()
