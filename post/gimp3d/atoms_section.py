"""Atoms of a snapshot in a section picture: the planes of atoms next to the section as discs, in the colours of the
particles' stress; atoms out of the lattice's structure have a rim."""

import numpy as np
from matplotlib.collections import EllipseCollection

from .run_data import Particles, time_of_snapshot


class AtomsSection:
    """The real atoms within half a nearest distance of a plane: places in the section (m), stresses (Pa, six
    components), and which have left the structure that most have."""

    def __init__(self, atoms, across, up, normal, plane):
        position = atoms["position"]
        real = np.round(atoms["type"].reshape(-1)).astype(int) == 1
        near = nearest_distance(position[real])
        chosen = real & (np.abs(position[:, normal] - plane) < 0.5 * near)
        structure = np.round(atoms["structure"].reshape(-1)).astype(int)
        usual = np.bincount(structure[real]).argmax() if real.any() else 0
        self.x, self.z = position[chosen][:, across], position[chosen][:, up]
        self.stress = atoms["stress"][chosen]
        self.strange = structure[chosen] != usual
        self.size = near

    def draw(self, ax, values, like, factor, value_factor):
        """Discs with values (Pa) in the colours of the collection `like`."""
        discs = EllipseCollection(
            *(np.full(self.x.size, 0.8 * self.size / factor) for _ in range(2)),
            np.zeros(self.x.size),
            units="xy",
            offsets=np.stack([self.x, self.z], axis=1) / factor,
            offset_transform=ax.transData,
            array=values / value_factor,
            cmap=like.get_cmap(),
            edgecolors=np.where(self.strange, "C3", "none"),
            linewidths=0.6,
        )
        discs.set_clim(*like.get_clim())
        discs.set_rasterized(True)
        ax.add_collection(discs, autolim=False)


def nearest_distance(position):
    """Between neighbours, by the middle of the box: surfaces have others."""
    from scipy.spatial import cKDTree

    if len(position) < 2:
        return 0.0
    return float(np.median(cKDTree(position).query(position, k=2)[0][:, 1]))


def atoms_beside(run, particles, across, up, normal, plane):
    """What the run wrote of its atoms with the snapshot `particles`; None where it has none in the plane."""
    for group in run.case.get("atoms", []):
        name = group.get("name", ["atoms"])[0]
        path = particles.path.with_name(particles.path.name.replace("particles", f"atoms_{name}", 1))
        if path.is_file() and abs(time_of_snapshot(path) - particles.time) <= 1e-9 * particles.time:
            found = AtomsSection(Particles(path), across, up, normal, plane)
            return found if found.x.size else None
    return None
