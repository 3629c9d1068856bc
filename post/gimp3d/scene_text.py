"""Scenes as text that is edited: values of namelist groups."""

import math
import numbers
import os

from .run_data import groups_in, read_namelists


class BadSetting(Exception):
    """What a study asks for is not there; the text says what."""


def written(value):
    """A value as a namelist has it: a number, a truth, a text, a path, or a list of them, which gets commas;
    also of NumPy. Raises BadSetting where a scene cannot hold the value."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)) and value:
        return ",".join(written(part) for part in value)
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str) and not any(ord(sign) < 32 and sign != "\t" for sign in value):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, numbers.Integral):
        return repr(int(value))
    if isinstance(value, numbers.Real) and math.isfinite(value):
        return repr(float(value))
    raise BadSetting(
        f"the value {value!r} cannot stand in a scene; allowed: finite numbers, truths, texts of one line, "
        "paths, and lists of them"
    )


def is_flat(grid):
    """Whether the values of &grid say that the scene is given by its section."""
    return grid.get("geometry", ["3d"])[0].lower() != "3d"


def with_y(values):
    """The values of a scene, with what a section may leave out: one cell along y, between symmetry sides."""
    for grid in values.get("grid", []):
        if not (is_flat(grid) and "cell_size" in grid):
            continue
        for name, y in (("lower", 0.0), ("upper", grid["cell_size"][0])):
            if len(grid.get(name, [])) == 2:
                grid[name] = [grid[name][0], y, grid[name][1]]
        if len(grid.get("boundary", [])) == 4:
            grid["boundary"] = [*grid["boundary"][:2], "symmetry", "symmetry", *grid["boundary"][2:]]
    return values


class Scene:
    """The text of a scene. Groups are counted from 0, among those of their name."""

    def __init__(self, text):
        self.text = text

    def groups(self, name):
        """The groups of this name with their places in the text (namelist_text.Group). Raises Unreadable."""
        return [group for group in groups_in(self.text) if group.name == name.lower()]

    def values(self):
        """As run_data.read_namelists; of a section with y."""
        return with_y(read_namelists(self.text))

    def set(self, group, variable, value, which=None):
        """Give a variable a value (None: take it out) in all groups of a name, or in one. Raises BadSetting
        where there is no such group, and where a scene cannot hold the value."""
        groups = self.groups(group)
        if which is not None:
            groups = groups[which : which + 1]
        if not groups:
            raise BadSetting(
                f"the scene has no &{group}" + (f" number {which + 1}" if which is not None else "")
            )
        new = "" if value is None else f"{variable}={written(value)}"
        for one in reversed(groups):
            old = one.variables.get(variable.lower())
            if old:
                self.replace(old, new)
            elif new:
                comma = "," if one.variables else ""
                self.text = self.text[: one.add_at] + f"{comma} {new}" + self.text[one.add_at :]

    def replace(self, old, new):
        """Put a text in the place of a variable; an empty one takes the comma behind it out too."""
        behind = self.text[old.last :]
        if not new and old.comma >= 0:
            comma = old.comma - old.last
            behind = behind[:comma] + behind[comma + 1 :]
            if not behind[:comma].strip(" \t"):
                behind = behind.lstrip(" \t")
        apart = " " if new and behind[:1] not in " \t\r\n,/!&" else ""
        self.text = self.text[: old.first] + new + apart + behind

    def add(self, group, **variables):
        """A group more, at the end."""
        listed = ", ".join(f"{name}={written(value)}" for name, value in variables.items())
        self.text = self.text.rstrip("\n") + f"\n&{group} {listed} /\n"

    def remove(self, group, first=0):
        """Take out the groups of a name, from the first-th on."""
        for one in reversed(self.groups(group)[first:]):
            self.text = self.text[: one.first] + self.text[one.last :].lstrip(" \t")

    def ensure(self, group):
        if not self.groups(group):
            self.add(group)
