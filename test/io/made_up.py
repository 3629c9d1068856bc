"""What made_up.f90 makes, worked out anew: all that a particle carries follows from its place in the file.
Numpy alone, so that ParaView's Python can use it too."""

import numpy

BLOCKS = 41
STEPS = [0, 10, 20, 30]
# Number, names of the components (none for a scalar), unit
FIELDS = {
    "velocity": (1, "xyz", "m/s"),
    "stress": (2, "xx yy zz yz xz xy".split(), "Pa"),
    "density": (3, [""], "kg/m3"),
    "pair": (4, "12", ""),
    "domain": (5, "123456789", "m"),
    "stress_recovered": (6, "xy xx zz yz xz yy".split(), "Pa"),
}
SYMMETRIC = "xx yy zz xy yz xz".split()  # a symmetric tensor in a file, as VTK has it


def time_of(step):
    return step * 1.25e-12


def in_file_order(name, values):
    """The columns of a field as they stand in an HDF5 file."""
    names = list(FIELDS.get(name, (0, ""))[1])
    return (
        values[:, [names.index(part) for part in SYMMETRIC]] if sorted(names) == sorted(SYMMETRIC) else values
    )


def von_mises(name, values):
    """From the stress deviator as a full tensor."""
    full = in_file_order(name, values)[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    deviator = full - numpy.trace(full, axis1=1, axis2=2)[:, None, None] * numpy.eye(3) / 3
    return numpy.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))


def particles(step):
    """Count, position, id and fields (in the order in which the program has them)."""
    count = sum((b * b * 7 + step) % 61 for b in range(1, BLOCKS + 1))
    k = numpy.arange(count, dtype=float)
    position = numpy.stack([k * 1e-9, 1 / (k + 3), step - k], axis=1)
    fields = {}
    for name, (number, components, _) in FIELDS.items():
        fields[name] = numpy.stack(
            [(k + 0.1) / (10.0 * number + c) - step for c in range(1, len(components) + 1)], axis=1
        )
        if name.startswith("stress"):
            fields[name.replace("stress", "von_mises")] = von_mises(name, fields[name])[:, None]
    return count, position, 2**54 + 3 * numpy.arange(count, dtype=numpy.int64) + 1, fields


def names_of(field):
    """Of its components, in the order in which the program has them."""
    components = FIELDS.get(field, (0, [""], ""))[1]
    return [f"{field}_{part}" if part else field for part in components]


def unit_of(field):
    return "Pa" if field.startswith("von_mises") else FIELDS[field][2]


def levels(step):
    """Number, lower and upper corner, cell size, particles of each level."""
    count = particles(step)[0]
    held = {1: count // 3, 2: 0, 3: count - count // 3}
    return [
        (
            n,
            numpy.array([0.1, 0.2, 0.3]) * n + step * (n - 1),
            numpy.array([10.0, 11.0, 12.0]) + step * (n - 1),
            2.0 ** (1 - n) / 3,
            held[n],
        )
        for n in (1, 2, 3)
    ]
