"""Files of grains, heights and surfaces as other programs write them: each is read right, a value says so, or
refused with a sentence that names the file. 40 changed copies of each kind never make the program crash, hang
or take much memory. The table goes to table.md. usage: table.py READ_SCENE [short] (in an empty directory;
short: each fourth file and ten copies)"""

import re
import resource
import subprocess
import sys
from importlib.util import find_spec
from itertools import count, permutations
from pathlib import Path

import h5py
import numpy as np

import answers
import writers
from answers import GRAINS, SECONDS, SHORT, SURFACE
from answers import grains, judge, prepared, refuse, run, table, volume
from mutations import mutated
from gimp3d import surfaces

MAX_MEMORY = 1e9  # bytes
CHANGED = 10 if SHORT else 40  # of each kind


def foreign():
    """Files of other kinds, by their first bytes: what they are, and what is allowed in their place."""
    for name, begins, sentence in (
        ("PLY", b"ply\nformat ascii 1.0\n", "is a PLY file; allowed: its surface as STL or OBJ"),
        ("Gmsh's mesh", b"$MeshFormat\n4.1 0 8\n", "is a mesh of Gmsh (.msh)"),
        ("a STEP file", b"ISO-10303-21;\nHEADER;\n", "is a CAD model (STEP)"),
        ("OFF", b"OFF\n4 4 0\n", "is an OFF file"),
        ("VTK", b"<?xml version='1.0'?>\n", "is an XML file (VTK, AMF, X3D, ...)"),
        ("an x3p file", b"PK\x03\x04\x14\0", "is a zip archive (.x3p, .plux, .3mf, .FCStd, ...)"),
        ("an sdf file", b"bISO-1.0made      ", "is a surface data file (.sdf, ISO 25178-71)"),
        ("a sur file", b"DIGITAL SURF\0\0", "is a file of Digital Surf (.sur, .pro)"),
        ("Zygo's file", b"\x88\x1b\x03\x6f\0\2", "is a file of Zygo (.dat)"),
        ("an array of NumPy", b"\x93NUMPY\1\0", "is an array of NumPy (.npy)"),
        ("Fluent's mesh", b'(0 "GAMBIT to Fluent File")\n(2 3)\n', "is a mesh of Fluent (.msh, .cas)"),
        (
            "Fluent's mesh, its dimension first",
            b"(2 3)\n(10 (0 1 8 0 3))\n",
            "is a mesh of Fluent (.msh, .cas)",
        ),
        ("a deck of LS-DYNA", b"*KEYWORD\n*NODE\n", "is a deck of LS-DYNA"),
        ("a deck of CalculiX", b"** made by PrePoMax\n*Heading\n", "is a deck of Abaqus or CalculiX"),
        ("a deck of Nastran", b"$ made by Patran\nSOL 101\n", "is a deck of Nastran or LS-DYNA"),
        ("a deck of ANSYS", b"/COM,ANSYS RELEASE\n/PREP7\n", "is a deck of ANSYS (.cdb)"),
        ("a universal file", b"    -1\n  2411\n         1\n", "is a universal file of I-DEAS (.unv)"),
        ("Exodus", b"CDF\x01\0\0\0\0", "is a NetCDF file (Exodus, GMT)"),
        ("Netgen's mesh", b"mesh3d\ndimension\n3\n", "is a mesh of Netgen (.vol)"),
        ("COMSOL's mesh", b"# Created by COMSOL Multiphysics.\n", "is a mesh of COMSOL (.mphtxt)"),
        ("a drawing", b"  0\nSECTION\n  2\nHEADER\n", "is a drawing (DXF)"),
    ):
        refuse(SURFACE, name, begins + bytes(200), sentence)
    points = np.random.default_rng(4).uniform(size=(8, 3))
    nodes = "8 3 0 0\n" + "".join(f"{n} {x} {y} {z}\n" for n, (x, y, z) in enumerate(points, 1))
    refuse(SURFACE, "TetGen's nodes", nodes.encode(), "", "spacing=1e-7,1e-7")
    refuse(
        SURFACE, "numbered nodes", nodes.split("\n", 1)[1].encode(), "numbers its lines", "spacing=1e-7,1e-7"
    )
    ball = surfaces.sphere(1e-6, 1e-7)
    exact = 4 / 3 * np.pi * 1e-18
    volume("STL whose header says ply", writers.binary_stl(ball, b"ply made by a program"), exact, "", 3e-2)
    ang = b"# TEM_PIXperUM 1.0\n# GRID: SqrGrid\n 0.1 0.2 0.3 0 0 1 1 1\n"
    refuse(GRAINS, "a map of EBSD, .ang", ang, "is a map of EBSD (.ang): a line for each point")
    ctf = b"Channel Text File\nPrj\tx\nJobMode\tGrid\n"
    refuse(GRAINS, "a map of EBSD, .ctf", ctf, "is a map of EBSD (.ctf): a line for each point")
    refuse(GRAINS, "DAMASK's grid", b'<?xml version="1.0"?>\n<VTKFile type="ImageData">', "is a file of VTK")


def cube(edge):
    """Corners, six tetrahedra and the twelve triangles of the surface of a cube about the origin (m)."""
    corners = edge * (np.array([[n & 1, n >> 1 & 1, n >> 2] for n in range(8)]) - 0.5)
    ways = [[0, 1 << a, (1 << a) + (1 << b), 7] for a, b, _ in permutations(range(3))]
    faces = [tuple(sorted(set(one) - {n})) for one in ways for n in one]
    return corners, np.array(ways), np.array([face for face in faces if faces.count(face) == 1])


def gmsh_mesh(corners, cells, skin):
    """A mesh as Gmsh writes it by default (4.1): cells and surface, no physical groups."""
    box = "{} {} {} {} {} {}".format(*corners.min(axis=0), *corners.max(axis=0))
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Entities", "0 0 1 1", f"99 {box} 0 0"]
    lines += [f"1 {box} 0 1 99", "$EndEntities", "$Nodes", "1 8 1 8", "3 1 0 8", *map(str, range(1, 9))]
    lines += [" ".join(map(str, corner)) for corner in corners] + ["$EndNodes", "$Elements"]
    lines += [f"2 {len(cells) + len(skin)} 1 {len(cells) + len(skin)}"]
    number = count(1)
    for start, elements in (f"2 99 2 {len(skin)}", skin), (f"3 1 4 {len(cells)}", cells):
        lines += [start] + [f"{next(number)} " + " ".join(map(str, one + 1)) for one in elements]
    return "\n".join([*lines, "$EndElements", ""]).encode()


def meshes():
    """Volume meshes that store the triangles of their surface too: the command in the refusal makes a surface
    that is read, of the volume of the cells."""
    corners, cells, skin = cube(2e-6)
    files = {"Gmsh's mesh with its surface.msh": gmsh_mesh(corners, cells, skin)}
    able = all(map(find_spec, ("meshio", "pyvista")))
    if able:
        import meshio

        for ending in ("vtk", "inp"):
            meshio.Mesh(corners, {"triangle": skin, "tetra": cells}).write(f"both.{ending}")
            files[f"a mesh with its surface.{ending}"] = Path(f"both.{ending}").read_bytes()
    for name, content in files.items():
        _, scene = prepared(SURFACE, name, content, "")
        status, said, _ = run(scene)
        command = re.search('python -c "(.*?)"', said)
        if status != 2 or not command:
            judge(name, False, f"status {status}: {said}")
            continue
        Path(name).write_bytes(content)
        python = compile(command[1].replace("FILE", name.replace("'", "\\'")), name, "exec")
        if not able:
            right = "extract_cells" in python.co_names
            judge(name, right, "refused; its command was not tried (no meshio, pyvista)")
            continue
        exec(python, {})
        status, said, out = run(prepared(SURFACE, name, Path("a.stl").read_bytes(), "")[1])
        found = re.search(r"^body .* volume (\S+) m3", out, re.M)
        seen = float(found[1]) if found else said
        judge(name, bool(found) and abs(seen / 8e-18 - 1) < 1e-6, f"status {status}: {seen}")


def all_grains():
    angles, quaternions = writers.rotations(12, 1)
    chance = np.random.default_rng(2)
    seeds = chance.uniform(0.05, 0.95, (12, 3))
    weights = chance.uniform(0.1, 0.3, 12)
    voxels = chance.integers(0, 13, (10, 5, 2)).astype(int)
    voxels[0, 0, 0], voxels[1, 0, 0] = 12, 0
    near = (1e-5 * seeds, 1e-5 * weights)
    lines = {
        "bunge_degrees": angles,
        "bunge_radians": np.radians(angles),
        "rodrigues": writers.descriptor("rodrigues", angles, quaternions),
        "rodrigues_inverse": -writers.descriptor("rodrigues", angles, quaternions),
        "axis_angle": writers.descriptor("axis-angle", angles, quaternions),
        "quaternion": quaternions,
        "quaternion_inverse": quaternions * [1, -1, -1, -1],
        "matrix_inverse": writers.descriptor("rotmat", angles, quaternions),
        "kocks_degrees": writers.descriptor("euler-kocks", angles, quaternions),
        "roe_degrees": writers.descriptor("euler-roe", angles, quaternions),
    }
    none = np.zeros(12)
    for form, numbers in lines.items():
        text = writers.rows(np.column_stack([1e-5 * seeds, numbers]), "%.15e").encode()
        grains(f"lines x y z and {form}", text, None, quaternions, f"angles='{form}'", (near[0], none))
    more = np.column_stack([np.arange(1, 13), 10 * seeds, angles, np.ones(12)])
    for name, head, mark in (
        ("blanks", "Grain X(um) Y(um) Z(um) phi1(deg) PHI(deg) phi2(deg) phase", " "),
        ("semicolons", "id;X [um];Y [um];Z [um];Euler 1;Euler 2;Euler 3;size", ";"),
        ("commas and quotes", '"id","x_um","y_um","z_um","phi_1","Phi","phi_2","area"', ","),
    ):
        lines_of = [mark.join(f"{v:.15g}" for v in row) for row in more]
        text = "\n".join(["# made", head, *lines_of]) + "\n"
        grains(f"columns with names, {name}", text.encode(), None, quaternions, "", (near[0], none))
        if mark == ";":
            text = text.replace(".", ",").encode()
            grains("columns with names, decimal commas", text, None, quaternions, "", (near[0], none))
    features = np.column_stack([np.arange(1, 13), 1e-5 * seeds, np.radians(angles), np.ones(12)])
    body = "\n".join(",".join(f"{v:.9g}" for v in row) for row in features) + "\n"
    head = "Feature_ID,Centroids_0,Centroids_1,Centroids_2,EulerAngles_0,EulerAngles_1,EulerAngles_2,Phases\n"
    after = "12\nFeature_ID,NumNeighbors,NeighborList\n1,2,3,4\n2,1,1\n"
    radians = "angles='bunge_radians'"
    made = ("12\n" + head + body + after).encode()
    grains("features of DREAM.3D as CSV", made, None, quaternions, radians, (near[0], none))
    made = ("13\n" + head + body).encode()
    refuse(GRAINS, "fewer features than said", made, "has 12 rows and says 13", radians)
    table_of = "x y z qw qx qy qz\n" + writers.rows(np.column_stack([1e-5 * seeds, quaternions]), "%.15e")
    grains(
        "columns qw qx qy qz", table_of.encode(), None, quaternions, "angles='quaternion'", (near[0], none)
    )
    refuse(GRAINS, "columns qw to qz, form not said", table_of.encode(), "names columns of quaternions")
    some = table_of.replace("qw qx qy qz", "a b c d").encode()
    refuse(
        GRAINS, "columns of other names", some, "line 1: names the columns 'x y z a b c d'; allowed: x y z"
    )
    short = ("phi1 Phi phi2 phase\n" + writers.rows(angles)).encode()
    refuse(GRAINS, "a name without a column", short, "line 2 must be 4 numbers")
    said = ("phi1[deg] Phi[deg] phi2[deg]\n" + writers.rows(angles)).encode()
    refuse(GRAINS, "columns in degrees, said radians", said, "and angles is 'radians'", "angles='radians'")
    text = writers.rows(np.column_stack([1e-5 * seeds, angles]), "%.9e").replace(".", ",").encode()
    grains("lines with decimal commas", text, None, quaternions, "", (near[0], none))
    for form in ("bunge_radians", "rodrigues", "quaternion"):
        refuse(GRAINS, f"{form} not said", writers.rows(lines[form]).encode(), "allowed: with angles, one of")
    refuse(GRAINS, "degrees as radians", writers.rows(angles).encode(), "another angles", "angles='radians'")
    refuse(GRAINS, "no quaternions", writers.rows(2 * quaternions).encode(), "is none", "angles='quaternion'")
    for name in (
        "rodrigues",
        "euler-bunge",
        "euler-kocks",
        "euler-roe",
        "rotmat",
        "axis-angle",
        "quaternion",
    ):
        made = writers.tess(seeds, weights, name, angles, quaternions)
        grains(f"Neper .tess, {name}", made, None, quaternions, "", near)
    made = writers.tess(seeds, weights, "rodrigues", angles, quaternions, ":active")
    refuse(
        GRAINS, "Neper .tess, active", made, "for opposite rotations; allowed: with angles, such as 'rodrig"
    )
    grains("Neper .tess, active, said", made, None, quaternions, "angles='rodrigues'", near)
    made = writers.tess(seeds * [2, 1, 1], weights, "rodrigues", angles, quaternions, size=(2.0, 1.0, 1.0))
    refuse(GRAINS, "Neper .tess of another shape", made, "allowed: a box of the same proportions")
    size = (0.1, 0.2, 0.5)
    for how in ("ascii", "binary8", "binary16", "binary16_big", "binary32"):
        made = writers.tesr(voxels, "rodrigues", angles, quaternions, how, size)
        grains(f"Neper .tesr, {how}", made, voxels, quaternions)
    made = writers.tesr(voxels, "quaternion", angles, quaternions, "binary16", size, "beside.raw")
    grains("Neper .tesr with a file beside it", made, voxels, quaternions)
    made = writers.dream3d(voxels, angles, size)
    grains("DREAM.3D", made, voxels, quaternions)
    grains("DREAM3D-NX", writers.dream3d(voxels, angles, size, nx=True), voxels, quaternions)
    refuse(GRAINS, "DREAM.3D in degrees", made, "and angles is 'degrees'", "angles='degrees'")
    made = writers.dream3d(voxels, angles, size, average=False)
    refuse(GRAINS, "DREAM.3D without features", made, "Find Feature Average Orientations")
    refuse(GRAINS, "DREAM.3D of another shape", writers.dream3d(voxels, angles), "of the same proportions")
    changed("columns of grains", GRAINS, "\n".join([head, *lines_of]).encode())
    changed("Neper", GRAINS, writers.tess(seeds, weights, "rodrigues", angles, quaternions))
    changed("Neper's voxels", GRAINS, writers.tesr(voxels, "rodrigues", angles, quaternions, voxel=size))
    changed("DREAM.3D", GRAINS, writers.dream3d(voxels, angles, size))


def all_heights():
    """A hill that no turn or mirror brings onto itself."""
    spacing = (5e-8, 4e-8)
    y, x = np.mgrid[:31, :41]
    heights = 2e-7 * np.exp(-(((x - 12) / 9) ** 2) - ((y - 20) / 6) ** 2) + 3e-9 * x + 1e-9 * y
    width = np.array([40, 30]) * spacing
    floor = heights.min() - width.max()
    cells = (heights[1:, 1:] + heights[1:, :-1] + heights[:-1, 1:] + heights[:-1, :-1]) / 4 - floor
    exact = cells.sum() * spacing[0] * spacing[1]
    apart = "spacing=5e-8,4e-8"
    in_nm = writers.places(1e9 * heights, np.multiply(1e9, spacing))
    table_of = np.loadtxt(writers.places(heights, spacing).decode().splitlines())
    mixed = "% made\nheight (nm) n y (um) x (um)\n" + "".join(
        f"{1e9 * z:.9g} {n} {1e6 * y:.9g} {1e6 * x:.9g}\n" for n, (x, y, z) in enumerate(table_of)
    )
    mixed = mixed.encode()
    for name, content, more in (
        ("heights", writers.matrix(heights), apart),
        ("heights with decimal commas", writers.matrix(heights, comma=True), apart),
        ("heights in nm", writers.matrix(1e9 * heights), apart + ", scale=1e-9"),
        ("Gwyddion's text", writers.gwyddion(heights, spacing), ""),
        ("Gwyddion's text in nm", writers.gwyddion(heights, spacing, "nm", "nm"), ""),
        ("lines x y z", writers.places(heights, spacing), ""),
        ("lines x y z, y first", writers.places(heights, spacing, "yx"), ""),
        ("lines x y z in no order", writers.places(heights, spacing, "mixed"), apart),
        ("columns x y z", b"x y z\n" + writers.places(heights, spacing), ""),
        ("columns in nm", b"X [nm]\tY [nm]\tHeight [nm]\n" + in_nm.replace(b" ", b"\t"), ""),
        ("columns in nm, commas", b"\"x_nm\",\"y_nm\",\"z_nm\"\r\n" + in_nm.replace(b" ", b","), ""),
        (
            "columns in nm, decimal commas",
            b"x/nm;y/nm;z/nm\n" + in_nm.replace(b" ", b";").replace(b".", b","),
            "",
        ),
        ("columns, heights first, places in um", mixed, ""),
        ("lines x y z in um", writers.places(1e6 * heights, np.multiply(1e6, spacing)), "scale=1e-6"),
        ("Surfer's grid", writers.surfer(heights, spacing), ""),
    ):
        volume(name, content, exact, more)
    square = heights * 1.0
    esri = exact * 5e-8 / 4e-8
    floor = square.min() - max(40 * 5e-8, 30 * 5e-8)
    cells = (square[1:, 1:] + square[1:, :-1] + square[:-1, 1:] + square[:-1, :-1]) / 4 - floor
    esri = cells.sum() * 25e-16
    volume("ESRI's grid", writers.esri(square, 5e-8), esri)
    blank = square.copy()
    blank[3, 4] = -9999
    refuse(SURFACE, "ESRI's grid with no data", writers.esri(blank, 5e-8), "which marks a missing value")
    refuse(SURFACE, "heights in nm, no scale", writers.matrix(1e9 * heights), "with scale=1 are", apart)
    spike = heights.copy()
    spike[4, 5] = 1e-3
    refuse(SURFACE, "a spike", writers.matrix(spike), "an outlier", apart)
    made = writers.gwyddion(heights, spacing)
    refuse(SURFACE, "Gwyddion's text and another scale", made, "and scale is 1e-9", "scale=1e-9")
    refuse(SURFACE, "Gwyddion's text and another spacing", made, "and spacing is", "spacing=5e-7,4e-7")
    refuse(SURFACE, "Gwyddion's text in V", made.replace(b"units: m", b"units: V"), "which is no length")
    refuse(SURFACE, "Gwyddion's own file", b"GWYP" + bytes(200), "gimp3d-post heights FILE", apart)
    some = b"".join(writers.places(heights, spacing).splitlines(True)[:-7])
    refuse(SURFACE, "lines x y z, some missing", some, "7 of the 1271 places of their grid")
    head = b"x y z\n"
    refuse(SURFACE, "columns x y z, some missing", head + some, "7 of the 1271 places of their grid")
    refuse(SURFACE, "columns of other names", b"a b c\n" + some, "line 1: names the columns 'a b c'")
    refuse(SURFACE, "heights in V", b"x[m] y[m] z[V]\n" + some, "allowed: m, mm, um, nm, pm or Angstrom")
    refuse(
        SURFACE,
        "columns in nm and another scale",
        b"x[nm] y[nm] z[nm]\n" + in_nm,
        "and scale is",
        "scale=1e-6",
    )
    refuse(SURFACE, "a name too few", b"x z\n" + some, "names the columns 'x z'")
    refuse(SURFACE, "a name too many", b"x y z error\n" + some, "has 3 numbers, and line 1 names 4 columns")
    refuse(
        SURFACE,
        "a line above the heights",
        b"Heights of my tip\n" + writers.matrix(heights),
        "names the columns",
    )
    loose = writers.places(heights + 0 * x, spacing).decode().split()
    loose = np.array(loose, float).reshape(-1, 3)
    loose[:, :2] += np.random.default_rng(1).uniform(0, 4e-8, (len(loose), 2))
    refuse(SURFACE, "places that are no grid", writers.rows(loose, "%.9e").encode(), "no places of a", apart)
    changed("Gwyddion", SURFACE, made)
    changed("lines x y z", SURFACE, writers.places(heights, spacing))
    changed("columns x y z", SURFACE, b"X [nm]\tY [nm]\tHeight [nm]\n" + in_nm.replace(b" ", b"\t"))
    first_rows(heights, spacing)


def first_rows(heights, spacing):
    """The same hill, its first row on top or at the bottom, makes the same case: rows read the wrong way make
    another one. The number of particles that a body of 16 particles a cell edge has in a corner says which."""
    counts = {}
    for name, content, more in (
        ("bottom", writers.matrix(heights), "spacing=5e-8,4e-8"),
        ("top", writers.matrix(heights, top=True), "spacing=5e-8,4e-8, first_row='top'"),
        ("Gwyddion", writers.gwyddion(heights, spacing), ""),
        ("ESRI", writers.esri(heights, 5e-8), "spacing=5e-8,5e-8"),
        ("mirrored", writers.matrix(heights, top=True), "spacing=5e-8,4e-8"),
    ):
        stem, scene = prepared(SURFACE, "first row " + name, content, more)
        scene = scene.replace(", formats='none'", "")
        status, said, _ = run(scene)
        if status:
            return judge("first row " + name, False, said)
        with h5py.File(sorted(Path(f"out/{stem}").glob("particles_*.hdf"))[0]) as file:
            points = file["VTKHDF/Points"][()]
            mass = file["VTKHDF/PointData/mass"][()]
        counts[name] = (points * mass[:, None]).sum(axis=0) / mass.sum()
    for name in ("top", "Gwyddion"):
        off = np.abs(counts[name] - counts["bottom"]).max()
        judge(
            f"first row, {name}",
            off < 1e-10,
            f"centre of mass {1e9 * off:.4f} nm off the one of the rows turned",
        )
    off = np.abs(counts["mirrored"] - counts["bottom"]).max()
    judge("first row, mirrored on purpose", off > 1e-8, f"centre of mass {1e9 * off:.1f} nm off")
    judge("first row, ESRI", np.sign(counts["ESRI"][1]) == np.sign(counts["bottom"][1]), "on the same side")


def all_surfaces():
    ball = surfaces.sphere(1e-6, 1e-7)
    ball = ball - [0, 0, 1e-6]  # its centre in the origin
    corner = ball.reshape(-1, 3, 3)
    exact = np.abs(np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum()) / 6
    big = 1e6 * ball
    from_here = "scale=1e-6"
    two = np.concatenate([ball * 0.5 - [8e-7, 0, 0], ball * 0.5 + [8e-7, 0, 0]])
    for name, content, share, more in (
        ("STL", writers.binary_stl(ball), 1, ""),
        ("STL whose header says solid", writers.binary_stl(ball, b"solid made by a program"), 1, ""),
        ("STL with bytes behind", writers.binary_stl(ball, behind=b"\0" * 37), 1, ""),
        ("STL as text", writers.text_stl(big), 1, from_here),
        ("STL as text of two solids", writers.text_stl(1e6 * two, 2), 0.25, from_here),
        ("STL as text, NUL and Ctrl-Z behind", writers.text_stl(big) + b"\0\x1a\n", 1, from_here),
        (
            "STL off by round-off",
            writers.text_stl(writers.off_by_round_off(big), digits="%.9e"),
            1,
            from_here,
        ),
        ("OBJ of MeshLab", writers.meshlab(big), 1, from_here),
        ("OBJ with lines that go on", writers.meshlab(big, continued=True), 1, from_here),
        ("OBJ with CR LF", writers.meshlab(big, continued=True).replace(b"\n", b"\r\n"), 1, from_here),
    ):
        volume(name, content, share * exact, more, 3e-2)
    inner = np.concatenate([ball, 0.5 * ball])
    refuse(SURFACE, "a shell in a shell", writers.binary_stl(inner), "overlaps itself")
    cut = np.concatenate([ball, ball + [1e-6, 0, 0]])
    refuse(SURFACE, "shells that cut each other", writers.binary_stl(cut), "overlaps itself")
    wide = writers.text_stl(writers.off_by_round_off(big, 1e-3), digits="%.9e")
    refuse(SURFACE, "corners far apart", wide, "is not closed", from_here)
    changed("MeshLab", SURFACE, writers.meshlab(big), from_here)
    changed("STL", SURFACE, writers.binary_stl(ball))


def changed(kind, text, content, more=""):
    """All copies through the reader at once: each has an answer, status 0 or 2, one sentence."""
    names = []
    chance = np.random.default_rng(7)
    for n in range(CHANGED):
        stem, scene = prepared(text, f"{kind} {n}", mutated(content, chance), more)
        Path(f"{stem}.nml").write_text(scene)
        names.append(f"{stem}.nml")
    try:
        done = subprocess.run([sys.argv[1], *names], capture_output=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return judge(f"{CHANGED} changed files, {kind}", False, "hangs")
    blocks = done.stdout.decode("latin-1").split("\n== ")
    statuses = [int(block.split("\n", 1)[0].split()[-1]) for block in blocks if block]
    short = [b for b, s in zip(blocks, statuses) if s == 2 and b.rstrip("\n").count("\n") != 1]
    read = statuses.count(0)
    judge(
        f"{CHANGED} changed files, {kind}",
        done.returncode == 0 and len(statuses) == CHANGED and set(statuses) <= {0, 2} and not short,
        f"{read} read, {statuses.count(2)} refused"
        + (f": {done.stderr[-300:]!r}" if done.returncode else ""),
    )


foreign()
meshes()
all_grains()
all_heights()
all_surfaces()
memory = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
judge("most memory of a process", memory < MAX_MEMORY, f"{memory / 1e6:.0f} MB")
lines = ["| file | seen | right |", "|---|---|---|"] + [f"| {n} | {s} | {r} |" for n, s, r in table]
Path("table.md").write_text("\n".join(lines) + "\n")
print(f"{len(table) - answers.failures} of {len(table)} right")
sys.exit(answers.failures > 0)
