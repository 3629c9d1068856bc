"""Files that are easily read wrongly, each of few numbers: units and forms by the names of columns,
tessellations of several scales, one layer of voxels, HDF5 with a user block and of MATLAB, faces of OBJ above
their corners, partitioned meshes and image data. Each is read right, or refused with its reason. (In an empty
directory.)"""

import sys
from pathlib import Path

import h5py
import numpy as np

import answers
import writers
from answers import GRAINS, SURFACE, grains, refuse, volume

FOUR, TURNS = writers.rotations(4, 1)
SEEDS = np.random.default_rng(3).uniform(0.1, 0.9, (4, 3))
NEAR = (1e-5 * SEEDS, np.zeros(4))


def columns(names, factors, orientations=FOUR, mark=","):
    """Seeds, each coordinate in its unit, and orientations under a line of names."""
    rows = np.column_stack([1e-5 * SEEDS * factors, orientations])[:, -len(names.split(mark)) :]
    return (names + "\n" + "".join(mark.join(f"{v:.12g}" for v in row) + "\n" for row in rows)).encode()


def units():
    angles = "phi1 [deg],Phi [deg],phi2 [deg]"
    for names, factors in (
        (f"x [um],y [um],z [um],{angles}", 3 * [1e6]),
        (f"x [um],y [um],z [mm],{angles}", [1e6, 1e6, 1e3]),
        (f"x [nm],y [um],z [m],{angles}", [1e9, 1e6, 1]),
        ("x_um,y_um,z_mm,phi1,Phi,phi2", [1e6, 1e6, 1e3]),
        (f"x,y [um],z [um],{angles}", 3 * [1e6]),
        ("x,y,z,phi1 [Degrees],Phi [Degrees],phi2 [Degrees]", 3 * [1]),
    ):
        grains(names.replace(",", " "), columns(names, factors), None, TURNS, "", NEAR)
    made = columns(f"x,y [um],z [mm],{angles}", [1e6, 1e6, 1e3])
    refuse(GRAINS, "x without a unit, y in um, z in mm", made, "allowed: a unit for each of x, y and z")
    made = columns(f"x [um],y [um],z [V],{angles}", [1, 1, 1])
    refuse(GRAINS, "z in V", made, "as units of x, y and z")
    for name, names in (
        ("angles in two units", "phi1 [deg],Phi [rad],phi2 [deg]"),
        ("angles in gon", "phi1 [gon],Phi [gon],phi2 [gon]"),
    ):
        refuse(GRAINS, name, columns(names, 1), "allowed: deg or rad as the unit of all three angles")


def forms():
    """The names of columns tell the kind of numbers, for fewer than four grains too."""
    vectors = TURNS[:, 1:] / TURNS[:, :1]
    for names in ("r1 r2 r3", "rx ry rz"):
        for count in 3, 4:
            name = f"{count} grains of {names}"
            made = (names + "\n" + writers.rows(10 * vectors[:count])).encode()
            refuse(GRAINS, name, made, "with angles, one of rodrigues, rodrigues_inverse")
            refuse(GRAINS, name + ", degrees", made, "names columns of Rodrigues", "angles='bunge_degrees'")
    made = columns("x y z r1 r2 r3", 1, vectors, " ")
    grains("columns r1 r2 r3", made, None, TURNS, "angles='rodrigues'", NEAR)
    back = TURNS * [1, -1, -1, -1]
    grains("columns r1 r2 r3, inverse", made, None, back, "angles='rodrigues_inverse'", NEAR)
    made = columns("phi1 Phi phi2", 1, FOUR, " ")
    refuse(GRAINS, "columns phi1 to phi2, said vectors", made, "names columns of Euler", "angles='rodrigues'")
    made = columns("q0 q1 q2 q3", 1, TURNS, " ")
    refuse(GRAINS, "columns q0 to q3", made, "with angles, one of quaternion, quaternion_inverse")


def neper():
    made = writers.tess(SEEDS, np.zeros(4), "euler-bunge", FOUR, TURNS)
    scales = b" **scale\n  *general\n   %d\n  *cellid\n   1 1 1\n   2 1 2\n   3 2 1\n   4 2 2\n***end"
    grains("a tessellation of one scale", made.replace(b"***end", scales % 1), None, TURNS, "", NEAR)
    two = made.replace(b"***end", scales % 2)
    refuse(GRAINS, "a tessellation of two scales", two, "of 2 scales, whose cells seeds alone do not tell")


def layers():
    """A layer of one voxel fills the box, whatever its thickness; its other sides are those of the box."""
    voxels = np.arange(100).reshape(10, 10, 1) % 4 + 1
    for nx in False, True:
        made = writers.dream3d(voxels, FOUR, (0.1, 0.1, 0.1), nx)
        grains(f"one layer of DREAM.3D{'-NX' if nx else ''}", made, voxels, TURNS)
    made = writers.tesr(voxels, "quaternion", FOUR, TURNS, voxel=(0.1, 0.1, 0.1))
    grains("one layer of a .tesr in 3D", made, voxels, TURNS)
    upright = voxels.reshape(10, 1, 10)
    grains("one layer along y", writers.dream3d(upright, FOUR, (0.1, 0.1, 0.1)), upright, TURNS)
    made = writers.dream3d(voxels, FOUR, (0.1, 0.2, 0.1))
    refuse(GRAINS, "one layer of other proportions", made, "allowed: a box of the same proportions")


def hdf5(userblock, matlab, **arrays):
    with h5py.File("made.h5", "w", userblock_size=userblock) as file:
        for name, values in arrays.items():
            file[name] = values.T if matlab else values
            if matlab:
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
            if name == "height" and not matlab:
                file[name].attrs["spacing"] = [5e-8, 4e-8]
    return Path("made.h5").read_bytes()


def user_blocks():
    y, x = np.mgrid[:31, :41]
    height = 2e-7 * np.exp(-(((x - 12) / 9) ** 2) - ((y - 20) / 6) ** 2)
    means = (height[1:, 1:] + height[1:, :-1] + height[:-1, 1:] + height[:-1, :-1]) / 4
    exact = (means + 40 * 5e-8 - height.min()).sum() * 20e-16
    for block in 0, 512, 4096:
        made = hdf5(block, False, orientations=FOUR, positions=NEAR[0])
        grains(f"HDF5, user block of {block} bytes", made, None, TURNS, "", NEAR)
        volume(f"heights, user block of {block} bytes", hdf5(block, False, height=height), exact)
    for count in 3, 4:
        made = hdf5(512, True, orientations=FOUR[:count])
        refuse(GRAINS, f"{count} grains of MATLAB", made, "is a file of MATLAB (save -v7.3)")
    old = b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(200) + bytes(200)
    refuse(GRAINS, "grains of MATLAB in the old form", old, "is a file of MATLAB; allowed: HDF5 by h5create")
    made = hdf5(512, True, height=height)
    refuse(SURFACE, "heights of MATLAB", made, "is a file of MATLAB (save -v7.3)", "spacing=5e-8,4e-8")


def faces():
    """A cube whose faces stand above, between and below its corners."""
    corners = 1e-6 * (np.array([[n & 1, n >> 1 & 1, n >> 2] for n in range(8)]) - 0.5)
    sides = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]]
    v = ["v " + " ".join(f"{value:.6g}" for value in corner) for corner in corners]
    f = ["f " + " ".join(map(str, side)) for side in sides]
    back = ["f " + " ".join(str(number - 9) for number in side) for side in sides]
    before = ["f " + " ".join(str(n if n > 4 else n - 5) for n in side) for side in sides]
    for name, lines in (
        ("faces above corners", f + v),
        ("faces between corners", v[:4] + f[:3] + v[4:] + f[3:]),
        ("faces above and below", f[:2] + v + f[2:]),
        ("faces that count back", v + back),
        ("faces that count back and on", v[:4] + before + v[4:]),
    ):
        volume(name, "\n".join(["# made", *lines, ""]).encode(), 1e-18, "", 2e-2)
    for name, lines, sentence in (
        ("a face of a ninth corner", [*v, *f[:5], "f 2 4 9 6"], "line 14: '9' is not the number of a vertex"),
        ("a face that counts back too far", [*v[:4], "f -1 -2 -5", *v[4:], *f], "line 5: '-5' is not the"),
    ):
        refuse(SURFACE, name, "\n".join([*lines, ""]).encode(), sentence)


def other_kinds():
    parts = b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PartitionedEntities\n2\n0\n"
    refuse(SURFACE, "a partitioned mesh of Gmsh", parts, "gmsh.model.mesh.unpartition()")
    xml = b'<?xml version="1.0"?>\n'
    grid = b'<VTKFile version="1.0" type="ImageData">\n  <ImageData WholeExtent="0 8 0 8 0 0"'
    for name, head in (
        ("image data", b"# vtk DataFile Version 5.1\nmade\nASCII\nDATASET STRUCTURED_POINTS\n"),
        ("image data, XML", xml + grid),
        ("image data, without its first line", grid),
    ):
        refuse(SURFACE, name, head, "is image data of VTK; allowed: heights")
    head = b"# vtk DataFile Version 5.1\nmade\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    refuse(SURFACE, "a mesh of VTK", head, "is a file of VTK; allowed: its surface as STL")
    ang = b"# TEM_PIXperUM 1.0\n# GRID: SqrGrid\n 0.1 0.2 0.3 0 0 1 1 1\n"
    refuse(GRAINS, "a map of EBSD", ang, "orix: the mean of the equivalent orientations nearest to one")


units()
forms()
neper()
layers()
user_blocks()
faces()
other_kinds()
print(f"{len(answers.table) - answers.failures} of {len(answers.table)} right")
sys.exit(answers.failures > 0)
