"""What cells, width and speeds leave in the features of runs, by pairs of runs that differ in one of them.

Such pairs do not show the order of the error: on finer cells still, the features change by no more than they
scatter. So nothing is extrapolated. What is left is between nothing and what an error of first order would
leave; as a uniform distribution that is one sigma of the latter over the root of 3."""

from dataclasses import dataclass

import numpy as np

KINDS = "cells", "width", "speed", "loading speed", "unloading speed"  # speed: of both at once
UNKNOWN = {  # without pairs; the width of the body is with the cells
    "cells": np.array([0.015, 0.03, 0.04, 0.02, 0.04]),
    "speed": np.array([0.01, 0.03, 0.05, 0.02, 0.04]),
}


ALIKE = 1.8  # ratio of the widths of bodies that differ in cells
FAR = 5.0  # sigmas (of the median deviation): pairs beyond are left out


def width(numerics):
    """Of the body, over the depth of a cone of 70.3 degrees."""
    return numerics.fine * 2**numerics.levels / numerics.cells


def effect_between(one, other):
    """The kind of effect if two Numerics differ in nothing else, else None."""
    cells, load, back = (getattr(one, name) != getattr(other, name) for name in ("cells", "speed", "back"))
    ratio = max(width(one), width(other)) / min(width(one), width(other))
    wide = ratio > (ALIKE if cells else 1.0)
    if (one.flip, one.fastest) != (other.flip, other.fastest):
        return None
    kinds = {
        (1, 0, 0, 0): "cells",
        (0, 1, 0, 0): "width",
        (0, 0, 1, 1): "speed",
        (0, 0, 1, 0): "loading speed",
        (0, 0, 0, 1): "unloading speed",
    }
    return kinds.get((cells, wide, load, back))


def reaches(main, one, other, count):
    """By what the change of the features from `one` to `other` is multiplied to give what an error of first
    order leaves in the runs with the Numerics `main`: first order in the size of cells, in the speed, or in
    one over the width of the body. If both speeds change, the features of the loading go by that of the
    loading, recovery and exponent by that of the unloading."""
    kind = effect_between(one, other)
    if kind in ("cells", "width"):
        of = lambda n: 1 / (n.cells if kind == "cells" else width(n))
        sizes = [[of(n)] * count for n in (main, one, other)]
    else:
        names = ["speed", "back", "back", "speed", "speed"]
        if kind != "speed":
            names = 5 * ["back" if kind == "unloading speed" else "speed"]
        sizes = [[getattr(n, name) for name in names[:count]] for n in (main, one, other)]
    size, first, second = np.array(sizes)
    return size / (first - second)


def linear(where):
    """1, softness, exponent of places (..., 2)."""
    return np.concatenate([np.ones_like(where[..., :1]), where], axis=-1)


@dataclass
class Effect:
    """What an error of first order, of cell size or speed, would leave in the features, by the place of the
    material: for each feature the coefficients of a constant, of the softness and of the exponent, and their
    covariance."""

    coefficients: np.ndarray  # (3, features)
    covariance: np.ndarray  # (features, 3, 3)
    shared: float = 1.0  # 1 if pairs of several tips gave it, else 0

    @classmethod
    def unknown(cls, sigma):
        """Without pairs: features are off by these, one sigma."""
        size = len(sigma)
        covariance = np.zeros((size, 3, 3))
        covariance[:, 0, 0] = 3 * sigma**2
        return cls(np.zeros((3, size)), covariance)

    @classmethod
    def measured(cls, pairs):
        """From the pairs of Surrogate.changes. The scatter of an estimate goes by its reach and by the scatter
        of runs; pairs that are FAR off are left out. Softness and exponent count where each of the others is
        predicted better with them from the rest."""
        places, first, reach, noise = map(np.array, zip(*pairs))
        count, size = first.shape
        found = cls.unknown(np.zeros(size))
        for k in range(size):
            weight = 1 / np.abs(reach[:, k] * noise[:, k])
            off = weight * (first[:, k] - np.median(first[:, k]))
            off = np.abs(off - np.median(off))
            near = off <= FAR * 1.4826 * np.median(off) + 1e-12
            weight = np.where(near, weight, 0.0)
            best = None
            for terms in (1, 2, 3):
                rows = linear(places)[:, :terms] * weight[:, None]
                if near.sum() < 2 * terms + 1 or np.linalg.matrix_rank(rows) < terms:
                    continue
                normal = np.linalg.inv(rows.T @ rows)
                line = normal @ rows.T @ (weight * first[:, k])
                left = weight * first[:, k] - rows @ line
                leverage = np.einsum("ij,jk,ik->i", rows, normal, rows)
                if np.any(leverage > 1 - 1e-9):
                    continue  # without this pair a coefficient is not determined
                error = np.sum((left / (1 - leverage)) ** 2)
                if best is None or error < 0.9 * best[0]:
                    best = error, terms, line, normal * (left @ left) / (near.sum() - terms)
            _, terms, line, covariance = best
            found.coefficients[:terms, k] = line
            found.covariance[k, :terms, :terms] = covariance
        return found

    def first(self, where):
        """What first order leaves (..., features) at places (..., 2)."""
        return linear(where) @ self.coefficients

    def deviation(self, where):
        """One sigma, with its sign: all tips deviate together."""
        return self.first(where) / np.sqrt(3)

    def variance(self, where):
        """Of the scatter of the pairs."""
        rows = linear(where)
        return np.einsum("...i,kij,...j->...k", rows, self.covariance, rows) / 3
