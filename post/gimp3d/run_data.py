"""Reading what a run wrote, or is still writing: histories (Tecplot ASCII), particles (HDF5), the values it
used (case.nml)."""

import math
import os
import re
from pathlib import Path

import numpy as np

from .namelist_text import BadText, groups_of

# of snapshots nothing changes any more; some file systems have no locks
os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")


class Unreadable(Exception):
    """A file is not what it should be; the text says which and why."""


class NoColumn(Unreadable, KeyError):
    """A file has no quantity of a name; the text says which it has."""

    __str__ = Exception.__str__

    def __init__(self, path, name, there):
        super().__init__(f"{path}: no {name!r}; there are {', '.join(there)}")
        self.name = name


# What code that reads a file raises where the file is whole, but does not hold what it should
senseless = (KeyError, IndexError, TypeError, ValueError, AttributeError, ArithmeticError)


def why(error):
    """What one of `senseless` says, as the end of a sentence."""
    if isinstance(error, NoColumn):
        return f"lacks {error.name!r}"
    if isinstance(error, (KeyError, IndexError)):
        return f"lacks {error}"
    return f"does not make sense ({error})"


def text_in(path):
    """The text of a file, without a byte order mark. Raises Unreadable."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise Unreadable(f"{path}: {error.strerror}")
    except UnicodeDecodeError as error:
        raise Unreadable(f"{path}: no text (byte {error.start} is none of UTF-8)")


def split_unit(name):
    """'load_z [N]' and 'load_z(N)' -> ('load_z', 'N')."""
    found = re.match(r"([^\[(]*?)\s*(?:[\[(]([^\])]*)[\])])?\s*$", name)
    return (found[1].strip(), found[2] or "") if found else (name.strip(), "")


class History:
    """A Tecplot ASCII file of points: its columns by their bare names, their units, the numbers of zones and
    rows. A last line that has no end is left out."""

    def __init__(self, path):
        self.path = path = Path(path)
        self.zones = 0
        self.notes = {}  # AUXDATA
        names, blocks, in_variables, packed = [], [], False, False
        text = text_in(path)
        lines = text.splitlines()
        if text and not text.endswith("\n"):
            lines.pop()  # of a run that is writing it, or was killed
        for number, line in enumerate(lines, 1):
            text = line.strip()
            upper = text.upper()
            continued, in_variables = in_variables, False
            note = re.fullmatch(r'AUXDATA\s+(\w+)\s*=\s*"(.*)"', text)
            if note:
                self.notes[note[1]] = note[2]
            if not text or upper.startswith(("#", "TITLE", "AUXDATA")):
                continue
            if upper.startswith("VARIABLES") or (continued and text.startswith('"')):
                in_variables = True
                names += [split_unit(name) for name in re.findall(r'"([^"]*)"', text)]
            elif upper.startswith("ZONE"):
                self.zones += 1
                packed = "DATAPACKING=BLOCK" in upper.replace(" ", "")
                blocks.append((packed, []))
            else:
                try:
                    values = [float(word) for word in text.split()]
                except ValueError:
                    raise Unreadable(f"{path}:{number}: not a row of numbers: {text[:60]}")
                if not packed and len(values) != len(names):
                    raise Unreadable(f"{path}:{number}: {len(values)} values for {len(names)} columns")
                if not blocks:
                    raise Unreadable(f"{path}:{number}: numbers before the first ZONE")
                blocks[-1][1].extend(values)
        if not names:
            raise Unreadable(f"{path}: no VARIABLES line")
        if len(dict(names)) != len(names):
            raise Unreadable(f"{path}: a column's name stands twice")
        self.units = dict(names)
        table = np.concatenate(
            [np.empty((0, len(names)))] + [self._zone(path, len(names), *block) for block in blocks]
        )
        self.rows = len(table)
        self.columns = {name: table[:, i] for i, (name, _) in enumerate(names)}

    @staticmethod
    def _zone(path, width, packed, values):
        if len(values) % width:
            raise Unreadable(f"{path}: a zone of {len(values)} values for {width} columns")
        return np.reshape(values, (width, -1)).T if packed else np.reshape(values, (-1, width))

    def __getitem__(self, name):
        """A column. Raises NoColumn."""
        if name not in self.columns:
            raise NoColumn(self.path, name, self.columns)
        return self.columns[name]

    def frame(self):
        """A pandas data frame (needs pandas)."""
        import pandas

        return pandas.DataFrame(self.columns)


def carried(history, axis, time, places):
    """Where places (n x 3, m) that go with a tool are at a time (s), by the tool's history; they are given at
    the start. Of runs of older versions, whose tools move along their axis alone, the depth says it."""
    if "rotation_w" not in history.columns:
        return places + np.interp(time, history["time"], history["depth"]) * np.asarray(axis)
    at = lambda name: np.interp(time, history["time"], history[name])
    point = np.array([at(f"position_{i}") for i in "xyz"])
    start = np.array([history[f"position_{i}"][0] for i in "xyz"])
    turn = np.array([at(f"rotation_{i}") for i in "wxyz"])
    w, v = turn[0] / np.linalg.norm(turn), turn[1:] / np.linalg.norm(turn)
    arm = np.asarray(places) - start
    return point + arm + 2 * np.cross(v, np.cross(v, arm) + w * arm)


def particle_files(directory):
    """All particle files in a directory, also those of earlier runs: `particles_<step>.hdf`, of older
    versions `.h5`."""
    return [path for ending in ("h5", "hdf") for path in sorted(directory.glob(f"particles_*.{ending}"))]


def snapshot_paths(directory):
    """The HDF5 snapshots of a run in order: the files that its index particles.xdmf lists. Earlier runs may
    have left others beside them. Empty where the run wrote none. Raises Unreadable where there are particle
    files without an index, and where a listed file is not there."""
    index = directory / "particles.xdmf"
    if not index.is_file():
        if particle_files(directory):
            raise Unreadable(
                f"{directory}: there is no particles.xdmf, the run's list of its snapshots: without it, "
                "particles_*.hdf may be those of an earlier run"
            )
        return []
    names = dict.fromkeys(re.findall(r"particles_\d+\.(?:hdf|h5)", text_in(index)))
    lost = [name for name in names if not (directory / name).is_file()]
    if lost:
        raise Unreadable(f"{index}: lists {lost[0]}, which is not there")
    return [directory / name for name in names]


def time_of_snapshot(path):
    """Of a particle file, s."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return float(np.ravel(file.attrs["time"])[0])
    except (OSError, KeyError) as error:
        raise Unreadable(f"{path}: {error}")


# the order of the components of a symmetric tensor in histories, and here
tensor = ["xx", "yy", "zz", "yz", "xz", "xy"]


def text_of(table, attribute):
    """An attribute that is a text; an empty one where there is none."""
    text = table.attrs.get(attribute, "")
    return text.decode() if isinstance(text, bytes) else str(text)


def in_order(values, components):
    """The columns of a field by the names of its components (`stress_xx stress_yy ...`); those of a symmetric
    tensor, which VTK's files have in another order, in that of `tensor`."""
    parts = [name.rsplit("_", 1)[-1] for name in components]
    return values[:, [parts.index(part) for part in tensor]] if sorted(parts) == sorted(tensor) else values


def columns_of(field, width, components):
    """Names of the columns of a field, in the order of in_order, from those that its file gives them: of old
    files without any x, y, z or xx ... or numbers."""
    parts = [name.rsplit("_", 1)[-1] for name in components]
    if len(parts) != width or sorted(parts) == sorted(tensor):
        parts = {3: list("xyz"), 6: tensor}.get(width) or [str(n + 1) for n in range(width)]
    return [f"{field}_{part}" for part in parts] if width > 1 else [field]


class Particles:
    """Ids, fields by name (with `position`; symmetric tensors as xx yy zz yz xz xy), the names of their
    `columns` and time of a particle file, in the order of the file; the boxes of the levels (lower and upper
    corner, m) and their cell sizes (m), coarsest first: none where there is only one level."""

    def __init__(self, path):
        import h5py

        self.path = path = Path(path)
        try:
            with h5py.File(path, "r") as file:
                group = file["VTKHDF"]
                self.time = float(np.ravel(file.attrs["time"])[0])
                self.fields, named = {"position": group["Points"][...]}, {}
                # of releases up to 0.2.0, each component a table of its own: name -> number of a component ->
                # values
                apart = {}
                for name, data in group["PointData"].items():
                    if "component_of" in data.attrs:
                        apart.setdefault(text_of(data, "component_of"), {})[int(data.attrs["component"])] = (
                            data[...]
                        )
                    else:
                        named[name] = text_of(data, "components").split()
                        self.fields[name] = in_order(data[...], named[name])
                for name, parts in apart.items():
                    self.fields[name] = np.stack([parts[number] for number in sorted(parts)], axis=1)
                self.ids = self.fields.pop("id").reshape(-1)
                self.boxes, self.cells = np.empty((0, 2, 3)), np.empty(0)
                if "level_cell" in group.get("FieldData", {}):
                    self.boxes = np.stack(
                        [group["FieldData/level_lower"][...], group["FieldData/level_upper"][...]], axis=1
                    )
                    self.cells = group["FieldData/level_cell"][...]
        except (OSError, KeyError) as error:
            raise Unreadable(f"{path}: {error}")
        for name, data in self.fields.items():
            if data.shape[0] != self.ids.size:
                raise Unreadable(f"{path}: {name} has {data.shape[0]} rows for {self.ids.size} particles")
        self.columns = {
            name: columns_of(name, math.prod(data.shape[1:]), named.get(name, []))
            for name, data in self.fields.items()
        }

    def __getitem__(self, name):
        """A field. Raises NoColumn."""
        if name not in self.fields:
            raise NoColumn(self.path, name, self.fields)
        return self.fields[name]

    def smooth_stress(self):
        """The recovered stress (particles, 6; Pa; xx yy zz yz xz xy); of snapshots before 0.3.0, which have
        none, the raw one."""
        return self.fields.get("stress_recovered", self.fields["stress"])


def groups_in(source):
    """The groups of a scene (its path, or its text), in its order, with their places (namelist_text.Group).
    Raises Unreadable."""
    text, where = (source, "the scene") if isinstance(source, str) else (text_in(source), source)
    try:
        return groups_of(text)
    except BadText as fault:
        raise Unreadable(f"{where}: {fault}") from None


def read_namelists(source):
    """The groups of a scene (its path, or its text): name -> list of dictionaries, one for each time the
    group stands there; every variable is a list of its values. Names are in lower case. Raises Unreadable."""
    groups = {}
    for group in groups_in(source):
        values = {name: variable.values for name, variable in group.variables.items()}
        groups.setdefault(group.name, []).append(values)
    return groups


def depth_of(case):
    """Levels finer than the grid that a scene has, one in the other: a &level refines the one before or the
    one that `of` names, 1 for the grid."""
    depth, before = 0, 0
    for level in case.get("level", []):
        before = int(level["of"][0]) if "of" in level else before + 1
        depth = max(depth, before)
    return depth
