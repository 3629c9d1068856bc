"""What test scripts check with. What fails is printed with FAILED in front of it and counted; `finish` ends the
script with status 1 where anything has failed."""

import sys

import numpy as np

faults = []  # sentences on what has failed


def require(what, holds, found=None):
    """A condition; `found` is printed where it does not hold. Gives back whether it does."""
    if not holds:
        faults.append(what)
    print(
        f"ok      {what}" if holds else f"FAILED: {what}" + (f": {found}" if found is not None else ""),
        flush=True,
    )
    return bool(holds)


def check(what, value, bound):
    """A measured figure, or an array of them: a number whose magnitude is at most the bound."""
    holds = bool(np.all(np.abs(value) <= bound))
    if not holds:
        faults.append(what)
    start = "ok      " if holds else "FAILED: "
    print(f"{start}{what}: {np.max(np.abs(value)):.3g} (at most {bound:.3g})", flush=True)


def close(what, value, expected, bound):
    """A measured figure within a share of what is expected."""
    require(
        f"{what}: {value:.6g}, expected {expected:.6g} within {100 * bound:.3g} %",
        near(value, expected, bound),
    )


def near(value, expected, tolerance=1e-9):
    """Whether two numbers differ by at most so much of the larger one; None is near nothing."""
    return value is not None and abs(value - expected) <= tolerance * max(abs(value), abs(expected))


def finish():
    """End the script."""
    sys.exit(1 if faults else 0)
