"""Files as other programs write them, made here from numbers that are known: tessellations of Neper, HDF5 of
DREAM.3D, heights of Gwyddion and of maps' programs, surfaces of MeshLab. Each writer gives the bytes."""

import struct
from pathlib import Path

import h5py
import numpy as np


def rotations(count, seed):
    """Random rotations as Bunge's angles in degrees, and as quaternions w x y z that turn the sample's axes
    into the crystal's."""
    chance = np.random.default_rng(seed)
    phi1, phi2 = chance.uniform(1, 359, (2, count))
    big = np.degrees(np.arccos(chance.uniform(-0.95, 0.95, count)))
    angles = np.stack([phi1, big, phi2], axis=1)
    half = np.radians(angles) / 2
    add, less = half[:, 0] + half[:, 2], half[:, 0] - half[:, 2]
    c, s = np.cos(half[:, 1]), np.sin(half[:, 1])
    return angles, np.stack([c * np.cos(add), s * np.cos(less), s * np.sin(less), c * np.sin(add)], axis=1)


def descriptor(name, angles, quaternions):
    """Orientations in one of Neper's descriptors."""
    w, x, y, z = quaternions.T
    if name == "rodrigues":
        return quaternions[:, 1:] / quaternions[:, :1]
    if name == "quaternion":
        return quaternions
    if name == "axis-angle":
        half = np.arccos(np.clip(w, -1, 1))
        return np.column_stack([quaternions[:, 1:] / np.sin(half)[:, None], np.degrees(2 * half)])
    if name == "rotmat":  # Bunge's g: its rows are the crystal's axes
        g = [
            [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
        ]
        return np.moveaxis(np.array(g), -1, 0).reshape(-1, 9)
    if name == "euler-kocks":
        return np.column_stack([angles[:, 0] - 90, angles[:, 1], 90 - angles[:, 2]])
    if name == "euler-roe":
        return np.column_stack([angles[:, 0] - 90, angles[:, 1], angles[:, 2] + 90])
    return angles


def rows(table, form="%18.12f"):
    return "".join("  " + " ".join(form % value for value in row) + "\n" for row in table)


def tess(seeds, weights, name, angles, quaternions, convention="", size=(1.0, 1.0, 1.0)):
    """A tessellation in Neper's format 3.4, with what a reader of grains may look at; edges, faces and
    polyhedra are those of the domain alone."""
    cells = len(seeds)
    corners = [[x, y, z] for z in (0, size[2]) for y in (0, size[1]) for x in (0, size[0])]
    text = f"***tess\n **format\n   3.4\n **general\n   3 standard\n **cell\n  {cells}\n  *crysym\n   cubic\n"
    text += "  *seed\n" + "".join(
        f"  {n + 1:3d} {x:.12f} {y:.12f} {z:.12f} {w:.12f}\n"
        for n, ((x, y, z), w) in enumerate(zip(seeds, weights))
    )
    text += f"  *ori\n   {name}{convention}\n" + rows(descriptor(name, angles, quaternions))
    text += " **vertex\n  8\n" + "".join(
        f"  {n + 1:3d} {x:.12f} {y:.12f} {z:.12f}     0\n" for n, (x, y, z) in enumerate(corners)
    )
    return (text + " **edge\n  0\n **face\n  0\n **polyhedron\n  0\n***end\n").encode()


def tesr(voxels, name, angles, quaternions, how="ascii", voxel=(0.1, 0.1, 0.1), file=None):
    """A raster tessellation in Neper's format 2.1; `voxels` counts x first. With `file` the voxels stand
    there."""
    flat = voxels.transpose(2, 1, 0).ravel()
    head = "***tesr\n **format\n   2.1\n **general\n   3\n   " + " ".join(map(str, voxels.shape)) + "\n   "
    head += " ".join(f"{v:.12f}" for v in voxel) + f"\n **cell\n   {len(angles)}\n"
    head += f"  *ori\n   {name}\n" + rows(descriptor(name, angles, quaternions)) + f" **data\n   {how}\n"
    code = {"binary8": "u1", "binary16": "<u2", "binary16_big": ">u2", "binary32": "<u4"}.get(how)
    body = (
        flat.astype(code).tobytes()
        if code
        else b"".join(b" ".join(b"%d" % v for v in flat[k : k + 20]) + b"\n" for k in range(0, len(flat), 20))
    )
    if file:
        Path(file).write_bytes(body)
        body = f"   *file {Path(file).name}\n".encode()
    return head.encode() + body + b"\n***end\n"


def dream3d(voxels, angles, spacing=(0.25, 0.25, 0.25), nx=False, average=True):
    """Grains as DREAM.3D 6.5 keeps them, or DREAM3D-NX: single precision, radians, row 0 for none."""
    name = Path("made.dream3d")
    table = np.vstack([[0, 0, 0], np.radians(angles)]).astype(np.float32)
    ids = voxels.transpose(2, 1, 0)[..., None].astype(np.int32)
    with h5py.File(name, "w") as file:
        if nx:
            container = file.create_group("DataStructure/DataContainer")
            container.attrs["_DIMENSIONS"] = np.array(voxels.shape, np.uint64)
            container.attrs["_SPACING"] = np.array(spacing, np.float32)
            container.attrs["_ORIGIN"] = np.zeros(3, np.float32)
            cells, grains = container.create_group("Cell Data"), container.create_group("Cell Feature Data")
        else:
            container = file.create_group("DataContainers/SyntheticVolumeDataContainer")
            geometry = container.create_group("_SIMPL_GEOMETRY")
            geometry["DIMENSIONS"] = np.array(voxels.shape, np.int64)
            geometry["SPACING"] = np.array(spacing, np.float32)
            geometry["ORIGIN"] = np.zeros(3, np.float32)
            cells, grains = container.create_group("CellData"), container.create_group("Grain Data")
        cells["FeatureIds"] = ids
        cells["EulerAngles"] = table[voxels.transpose(2, 1, 0)]
        cells["Phases"] = (ids > 0).astype(np.int32)
        if average:
            grains["AvgEulerAngles" if nx else "EulerAngles"] = table
        grains["Phases"] = np.r_[0, np.ones(len(angles), int)].astype(np.int32)[:, None]
    return name.read_bytes()


def gwyddion(heights, spacing, unit="m", lengths="µm"):
    """Gwyddion's export as text: first line on top, with its header. `heights` counts y first, from the
    bottom."""
    factor = {"µm": 1e-6, "nm": 1e-9, "m": 1.0}
    ny, nx = heights.shape
    text = f"# Channel: Z-Axis\n# Width: {nx * spacing[0] / factor[lengths]:.4f} {lengths}\n"
    text += f"# Height: {ny * spacing[1] / factor[lengths]:.4f} {lengths}\n# Value units: {unit}\n"
    text += "".join("\t".join(f"{v / factor[unit]:.7g}" for v in row) + "\n" for row in heights[::-1])
    return text.encode()


def places(heights, spacing, order="xy", digits="%.9e"):
    """Lines x y z. `order`: which runs first, or mixed."""
    ny, nx = heights.shape
    y, x = np.mgrid[:ny, :nx]
    table = np.stack([x * spacing[0], y * spacing[1], heights], axis=-1)
    if order == "yx":
        table = table.transpose(1, 0, 2)
    table = table.reshape(-1, 3)
    if order == "mixed":
        table = np.random.default_rng(5).permutation(table)
    return "".join(" ".join(digits % v for v in row) + "\n" for row in table).encode()


def esri(heights, cell, blank=None):
    ny, nx = heights.shape
    text = f"ncols         {nx}\nnrows         {ny}\nxllcorner     100.0\nyllcorner     200.0\n"
    text += f"cellsize      {cell!r}\nNODATA_value  {-9999 if blank is None else blank}\n"
    return (text + "".join(" ".join(f"{v:.9g}" for v in row) + "\n" for row in heights[::-1])).encode()


def surfer(heights, spacing):
    ny, nx = heights.shape
    text = f"DSAA\n{nx} {ny}\n0 {(nx - 1) * spacing[0]!r}\n0 {(ny - 1) * spacing[1]!r}\n"
    text += f"{heights.min():.9g} {heights.max():.9g}\n"
    flat = heights.ravel()  # from the bottom on, ten a line
    return (
        text + "".join(" ".join(f"{v:.9g}" for v in flat[k : k + 10]) + "\n" for k in range(0, len(flat), 10))
    ).encode()


def matrix(heights, comma=False, top=False):
    text = "".join(" ".join(f"{v:.9e}" for v in row) + "\n" for row in (heights[::-1] if top else heights))
    return (text.replace(".", ",").replace(" ", "\t") if comma else text).encode()


def corners_of(triangles):
    """Corners without doubles, and triangles by their numbers."""
    corner, number = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return corner, number.reshape(-1, 3)


def meshlab(triangles, continued=False):
    """OBJ as MeshLab writes it: vn before v, in turns, faces a//n; some programs break lines with \\."""
    corner, faces = corners_of(triangles)
    out = ["####", "#", "# OBJ File Generated by Meshlab", "#", "####", f"# Vertices: {len(corner)}"]
    for x in corner:
        n = x / max(np.linalg.norm(x), 1e-30)
        out += [f"vn {n[0]:.6f} {n[1]:.6f} {n[2]:.6f}", f"v {x[0]:.6f} {x[1]:.6f} {x[2]:.6f}"]
    broken = " \\\n   " if continued else " "
    out += [f"f {a}//{a}{broken}{b}//{b}{broken}{c}//{c}" for a, b, c in faces + 1]
    return ("\n".join(out) + "\n# end of file\n").encode()


def text_stl(triangles, solids=1, digits="%.6e"):
    """STL as text, of one or several solids; normals are 0 as many programs leave them."""
    out = []
    for k, part in enumerate(np.array_split(triangles, solids)):
        out.append(f"solid part{k}")
        for t in part:
            out += ["  facet normal 0 0 0", "    outer loop"]
            out += ["      vertex " + " ".join(digits % v for v in x) for x in t]
            out += ["    endloop", "  endfacet"]
        out.append(f"endsolid part{k}")
    return ("\n".join(out) + "\n").encode()


def binary_stl(triangles, header=b"made", behind=b""):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *t.astype("<f4").ravel(), 0) for t in triangles)
    return header.ljust(80, b"\0") + struct.pack("<I", len(triangles)) + body + behind


def off_by_round_off(triangles, relative=2e-7, seed=3):
    """Each corner of each triangle somewhere else by so much of the extent."""
    chance = np.random.default_rng(seed)
    return triangles + np.ptp(triangles) * relative * chance.uniform(-1, 1, triangles.shape)


def gwy_object(name, *components):
    """One object of Gwyddion's own format: its name, the size of what follows, and components (key, kind, value):
    'o' an object, 's' a string, 'i' and 'd' numbers, 'D' an array, 'b' a truth value."""
    body = b""
    for key, kind, value in components:
        body += key.encode() + b"\0" + kind.encode()
        if kind == "o":
            body += value
        elif kind == "s":
            body += value.encode() + b"\0"
        elif kind == "D":
            body += struct.pack("<I", value.size) + np.asarray(value, "<f8").tobytes()
        else:
            body += struct.pack({"i": "<i", "d": "<d", "b": "<B"}[kind], value)
    return name.encode() + b"\0" + struct.pack("<I", len(body)) + body


def gwy(*channels):
    """Gwyddion's own file. Channels: (number, title, heights from the bottom on, spacing, unit of the heights); first
    row on top, as its program keeps them."""
    unit = lambda text: gwy_object("GwySIUnit", ("unitstr", "s", text))
    parts = [("/filename", "s", "made.gwy")]
    for number, title, heights, spacing, z in channels:
        rows, columns = heights.shape
        field = gwy_object(
            "GwyDataField",
            ("xres", "i", columns),
            ("yres", "i", rows),
            ("xreal", "d", columns * spacing[0]),
            ("yreal", "d", rows * spacing[1]),
            ("xoff", "d", 3e-6),
            ("yoff", "d", -1e-6),
            ("si_unit_xy", "o", unit("m")),
            ("si_unit_z", "o", unit(z)),
            ("data", "D", heights[::-1]),
        )
        parts += [(f"/{number}/data", "o", field), (f"/{number}/data/title", "s", title)]
        parts.append((f"/{number}/data/visible", "b", 1))
    return b"GWYP" + gwy_object("GwyContainer", *parts)
