"""Gwyddion's own files (.gwy): "GWYP" and one object. An object is a name, NUL, the size of the rest (32
bits, little endian), and components: a name, NUL, a letter for the kind, the value. A capital letter is an
array of that kind, with its length first. See
gwyddion.net/documentation/user-guide-en/gwyfile-format.html.

Not by the package gwyfile 0.3.0, which keeps one of two channels with the same title
(findings/gwyfile_same_titles.sh).
"""

import struct

import numpy as np

MAGIC = b"GWYP"
NUMBERS = {"b": "<u1", "c": "<u1", "i": "<i4", "q": "<i8", "d": "<f8"}
DEEPEST = 50  # objects in objects


class Damaged(ValueError):
    """The bytes are no such object."""


class Object(dict):
    """The components of an object by their names; `name` is its own."""

    def __init__(self, name):
        super().__init__()
        self.name = name


def text_at(data, at, end):
    """A string that ends with NUL, and where the rest begins."""
    stop = data.find(b"\0", at, end)
    if stop < 0:
        raise Damaged(f"a name or text that begins at byte {at} has no end")
    return data[at:stop].decode("utf-8", "replace"), stop + 1


def room(at, size, end):
    """Where so many bytes end."""
    if size > end - at:
        raise Damaged(f"{size} bytes are announced at byte {at}, where {end - at} are left")
    return at + size


def length_at(data, at, end):
    """A 32-bit length, and where the rest begins."""
    return struct.unpack_from("<I", data, at)[0] if room(at, 4, end) else 0, at + 4


def object_at(data, at, end, depth=0):
    """An Object, and where the rest begins."""
    if depth > DEEPEST:
        raise Damaged(f"objects stand in each other {depth} times")
    name, at = text_at(data, at, end)
    size, at = length_at(data, at, end)
    stop = room(at, size, end)
    found = Object(name)
    while at < stop:
        key, at = text_at(data, at, stop)
        kind = chr(data[room(at, 1, stop) - 1])
        found[key], at = value_at(data, at + 1, stop, kind, depth)
    return found, stop


def value_at(data, at, end, kind, depth):
    """A component's value, and where the rest begins."""
    if kind in NUMBERS:
        kind_of_number = np.dtype(NUMBERS[kind])
        stop = room(at, kind_of_number.itemsize, end)
        return np.frombuffer(data, kind_of_number, 1, at)[0], stop
    if kind == "s":
        return text_at(data, at, end)
    if kind == "o":
        return object_at(data, at, end, depth + 1)
    count, at = length_at(data, at, end)
    if kind.lower() in NUMBERS:
        kind_of_number = np.dtype(NUMBERS[kind.lower()])
        stop = room(at, count * kind_of_number.itemsize, end)
        return np.frombuffer(data, kind_of_number, count, at), stop
    if kind not in "SO":
        raise Damaged(f"there is no kind {kind!r} of component (byte {at - 5})")
    values = []
    for _ in range(count):  # ends at the latest where the bytes do
        value, at = value_at(data, at, end, kind.lower(), depth)
        values.append(value)
    return values, at


def load(path):
    """The container of a file; Damaged says what is wrong with it."""
    with open(path, "rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise Damaged("it does not begin with GWYP")
        data = MAGIC + file.read()
    return object_at(data, len(MAGIC), len(data))[0]
