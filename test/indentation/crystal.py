"""Pile-up around a sphere in a copper crystal, by its harmonics around the tool's axis. Run in the directory
of crystal_long.sh."""

import sys
from pathlib import Path

import numpy as np

from gimp3d.run_data import Particles

MIDDLE = np.array([6.0, 6.0, 10.0])  # of the contact, um
RINGS = [(1.5, 1.9), (1.9, 2.3), (2.3, 2.7)]  # um from the axis, beyond the contact's radius of 1.5 um
SECTORS = 48
FOLDS = {"001": 4, "011": 2, "111": 3}
# A mirror plane of the pile-up when the crystal is turned by 20 degrees: it turns with the crystal
MIRROR = {"001": 45 + 20, "011": 0 + 20, "111": 30 + 20}  # degrees from x; on (001) that is [110]
failures = 0


def surface(directory):
    """Height of the surface (um) in rings and sectors: that of the highest particle's upper side."""
    fields = Particles(sorted(Path(directory).glob("particles_*.hdf"))[-1]).fields
    place = 1e6 * fields["position"] - MIDDLE
    top = place[:, 2] + 1e6 * np.abs(fields["domain"][:, 2::3]).sum(axis=1)
    radius, angle = np.hypot(place[:, 0], place[:, 1]), np.arctan2(place[:, 1], place[:, 0])
    sector = ((angle + np.pi) / (2 * np.pi) * SECTORS).astype(int) % SECTORS
    heights = np.full((len(RINGS), SECTORS), -np.inf)
    for i, (inner, outer) in enumerate(RINGS):
        ring = (radius > inner) & (radius < outer)
        np.maximum.at(heights[i], sector[ring], top[ring])
    return heights, fields


for face, fold in FOLDS.items():
    heights, fields = surface(face)
    if not np.all(np.isfinite(heights)):
        print(f"FAILED: ({face}): a sector of the surface without particles")
        failures += 1
        continue
    waves = np.fft.rfft(heights.mean(axis=0))[:13] * 2 / SECTORS * 1e3
    harmonics = np.abs(waves)
    strongest = fold * (1 + harmonics[fold::fold].argmax())
    crest = -np.degrees(np.angle(waves[strongest])) / strongest - 180 + 180 / SECTORS
    half = 180 / strongest  # a mirror plane has a crest or a trough
    off = (crest - MIRROR[face] + half / 2) % half - half / 2
    own = harmonics[fold::fold].max()
    other = max(harmonics[n] for n in range(1, 13) if n % fold)
    print(f"   ({face}): harmonics 1 to 12 [nm] " + " ".join(f"{h:.1f}" for h in harmonics[1:]))
    print(
        f"   ({face}): highest {1e3 * heights.max():.0f} nm, lattice turned by "
        f"{fields['lattice_rotation'].max():.0f} degrees, slip up to {fields['slip'].max():.2f}"
    )
    good = own >= 5 * other and abs(off) < 5
    failures += not good
    print(
        f"{'   ' if good else 'FAILED: '}({face}): {fold}-fold by {own:.1f} nm, all else at most {other:.1f} "
        f"nm: {own / other:.3g} times; mirror plane, by harmonic {strongest}, {off:+.1f} degrees off"
    )
sys.exit(1 if failures else 0)
