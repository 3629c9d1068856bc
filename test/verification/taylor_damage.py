"""Where a Taylor bar of 4340 steel fails at 250 m/s, input/taylor_damage.nml, on two grids: at its foot
alone, around the axis first, where the release waves from its side meet. A particle fails where the sum of
plastic strain over Johnson and Cook's strain of failure has come to 1: no other has. usage: taylor_damage.py
(in an empty directory; GIMP3D is the program)"""

from pathlib import Path

import h5py
import numpy as np

from run_scene import ROOT, replace, run
from checks import check, finish, require
from runs import energy, snapshots

RADIUS = 3.81e-3  # m
WAVE = np.sqrt(200e9 * (1 - 0.29) / (1 + 0.29) / (1 - 2 * 0.29) / 7830)  # m/s
found = {}
for cells in (4, 5):
    name, cell = f"bar_{cells}", RADIUS / cells
    text = replace((ROOT / "input/taylor_damage.nml").read_text(), "0.762e-3", f"{cell!r}")
    upper = ",".join(repr(n * cell) for n in (round(2.4 * cells), round(2.4 * cells), round(7.2 * cells)))
    text = replace(text, "upper=9.144e-3,9.144e-3,27.432e-3", f"upper={upper}")
    run(replace(text, "'out/taylor_damage', every=20e-6", f"'{name}', every=2e-6, formats='hdf5'"), 2)
    rows, first = snapshots(name), None
    with h5py.File(sorted(Path(name).glob("particles_*.hdf"))[0]) as file:
        bits = (
            1 << int(file["VTKHDF/PointData/id"].attrs["first_bits"])
        ) - 1  # in common of a particle's parts
    begun = dict(zip(rows[0].ids, rows[0].fields["position"]))
    for now in rows:
        failed = now.fields["damage"].ravel() >= 1
        if failed.any() and first is None:
            first = now.time, np.array([begun[i & bits] for i in now.ids[failed]])
    last = rows[-1].fields
    failed, place = last["damage"].ravel() >= 1, last["position"]
    share = last["mass"].ravel()[failed].sum() / last["mass"].sum()
    where = np.array([begun[i & bits] for i in rows[-1].ids[failed]])
    inner = np.hypot(*where[:, :2].T) < 0.5 * RADIUS
    foot, length = np.hypot(place[:, 0], place[:, 1]).max() + cell / 4, place[:, 2].max() + cell / 4
    print(
        f"   {cells} cells a radius: first by {1e6 * first[0]:.0f} us at most "
        f"{1e3 * np.hypot(*first[1][:, :2].T).max():.2f} mm from the axis; at the end "
        f"{100 * share:.2f} % of the mass, {inner.sum()} by the axis to {1e3 * where[inner, 2].max():.2f} mm "
        f"high, {(~inner).sum()} at the rim "
        f"to {1e3 * where[~inner, 2].max() if (~inner).any() else 0:.2f} mm; foot {1e3 * foot:.2f} mm, "
        f"length {1e3 * length:.2f} mm"
    )
    found[cells] = first[0], share, foot, length
    require(f"{name}: it fails next to the axis first", np.hypot(*first[1][:, :2].T).max() < 0.5 * RADIUS)
    require(f"{name}: at the foot alone", where[:, 2].max() < 0.55 * RADIUS)
    require(
        f"{name}: no tension and no shear in what has failed",
        np.abs(last["stress"][failed][:, 3:]).max() < 1e-6 * np.abs(last["stress"]).max(),
    )
    check(f"{name}: balance of energy", energy(name)["balance_error"], 0.05)
    require(
        f"{name}: when release waves meet on the axis, after {1e6 * RADIUS / WAVE:.1f} us, and their "
        "reflections",
        RADIUS / WAVE < first[0] < 5 * RADIUS / WAVE,
    )
for k, what in ((2, "foot"), (3, "length")):
    check(f"{what}: one grid against the other", found[5][k] / found[4][k] - 1, 0.05)
require(
    "a share of 0.2 to 4 % of the mass fails on both", all(0.002 < found[cells][1] < 0.04 for cells in found)
)
finish()
