"""Scenes as text that is edited: values of namelist groups."""

import re

from .run_data import read_namelists, words_of_group

group_start = re.compile(r"^[ \t]*&(\w+)", re.M)


class BadSetting(Exception):
    """What a study asks for is not there; the text says what."""


def written(value):
    """A value as a namelist has it; lists with commas. Arrays and numbers of NumPy too."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return ",".join(written(part) for part in value)
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    return repr(value)


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
        """For each group of this name: where it starts and ends, where its `/` stands, and the span of the
        values of each variable."""
        found, at = [], 0
        while start := group_start.search(self.text, at):
            spans, current, before = {}, None, start.end()
            for word in words_of_group(self.text, start.end(), start[1]):
                at = word.end()
                if word["end"]:
                    slash = before
                elif word["name"]:
                    current = word["name"].lower()
                    spans[current] = (word.start(), word.end())
                else:
                    spans[current] = (spans[current][0], word.end())
                before = word.end()
            if start[1].lower() == name:
                found.append((start.start(), at, slash, spans))
        return found

    def values(self):
        """As run_data.read_namelists; of a section with y."""
        return with_y(read_namelists(self.text))

    def set(self, group, variable, value, which=None):
        """Give a variable a value (None: take it out) in all groups of a name, or in one."""
        groups = self.groups(group)
        if which is not None:
            groups = groups[which : which + 1]
        if not groups:
            raise BadSetting(
                f"the scene has no &{group}" + (f" number {which + 1}" if which is not None else "")
            )
        for start, end, slash, spans in reversed(groups):
            if variable in spans:
                first, last = spans[variable]
                new = "" if value is None else f"{variable}={written(value)}"
                if value is None:
                    last = re.compile(r"[ \t]*,?[ \t]*").match(self.text, last).end()
                self.text = self.text[:first] + new + self.text[last:]
            elif value is not None:
                comma = ", " if spans else " "
                self.text = self.text[:slash] + f"{comma}{variable}={written(value)}" + self.text[slash:]

    def add(self, group, **variables):
        """A group more, at the end."""
        listed = ", ".join(f"{name}={written(value)}" for name, value in variables.items())
        self.text = self.text.rstrip("\n") + f"\n&{group} {listed} /\n"

    def remove(self, group, first=0):
        """Take out the groups of a name, from the first-th on."""
        for start, end, _, _ in reversed(self.groups(group)[first:]):
            self.text = self.text[:start] + self.text[end:].lstrip(" \t")

    def ensure(self, group):
        if not self.groups(group):
            self.add(group)
