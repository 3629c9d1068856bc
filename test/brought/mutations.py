"""Copies of a file with the faults that copying, editors and transfers make."""

import numpy as np


def mutated(content, chance):
    """A copy with one of the faults that copying, editors and transfers make."""
    kind = chance.integers(7)
    at, to = sorted(chance.integers(0, len(content), 2))
    if kind == 0:
        return content[:to]
    if kind == 1:
        return content[:at] + content[to:]
    if kind == 2:
        return content[:to] + content[at:]
    if kind == 3:
        return (
            content[:at]
            + bytes(chance.integers(0, 256, 1 + chance.integers(8), dtype=np.uint8))
            + content[at:]
        )
    if kind == 4:
        spot = bytearray(content)
        for place in chance.integers(0, len(content), 1 + chance.integers(4)):
            spot[place] = chance.integers(256)
        return bytes(spot)
    if kind == 5:
        return content.replace(b"\n", b"\r\n") if chance.integers(2) else content.replace(b" ", b"\t")
    digits = [n for n, byte in enumerate(content) if 48 <= byte < 58] or [0]
    place = digits[chance.integers(len(digits))]
    return (
        content[:place] + bytes(chance.choice([b"", b"-", b"999999999", b"1e308", b"nan"])) + content[place:]
    )
