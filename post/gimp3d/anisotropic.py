"""A rigid frictionless punch or sphere on an anisotropic elastic half-space, small strains (Vlassak and Nix,
J. Mech. Phys. Solids 42 (1994) 1223; Willis, ibid. 14 (1966) 163).

A pressure of wave number k along a direction of the surface makes a displacement along the normal n of Z / k
times it, with

    Z = n . L^-1 . n,   L = 1/pi int_0^pi (Q - R T^-1 R^T) dt,   Q = C(a, a), R = C(a, b), T = C(b, b)

where a and b are that direction and the normal, turned by t in their plane (Barnett and Lothe, Phys. Norv. 7
(1973) 13; of an isotropic body L_nn = E'/2). So a force at a point makes the displacement h/r, whose
harmonics over the direction are those of Z over 2 pi, with alternating signs. A flat circular punch has then
the stiffness 2 E' a with E' = 2 over the mean of Z. A sphere touches an ellipse.

    anisotropic.py C11 C12 C44     the moduli of a cubic crystal, in its unit: of a punch and of a sphere on
(100), (110), (111)"""

import math
import sys

import numpy as np

SURFACES = {"100": (0, 0, 1), "110": (0, 1, 1), "111": (1, 1, 1)}


def cubic(c11, c12, c44):
    """Stiffness (3, 3, 3, 3) along the cube's axes."""
    d = np.eye(3)
    c = c12 * np.einsum("ij,kl->ijkl", d, d) + c44 * (
        np.einsum("ik,jl->ijkl", d, d) + np.einsum("il,jk->ijkl", d, d)
    )
    for i in range(3):
        c[i, i, i, i] += c11 - c12 - 2 * c44
    return c


def frame(normal):
    """Two directions of a surface and its normal, as rows."""
    n = np.array(normal, dtype=float) / np.linalg.norm(normal)
    first = np.cross((0, 0, 1) if abs(n[2]) < 0.9 else (0, 1, 0), n)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(n, first), n])


def compliance(stiffness, along, normal, steps=48):
    """Z of a direction of the surface, 1 over the stiffness's unit."""
    total = np.zeros((3, 3))
    for t in (np.arange(steps) + 0.5) * math.pi / steps:
        a, b = math.cos(t) * along + math.sin(t) * normal, math.cos(t) * normal - math.sin(t) * along
        q, r, s = (np.einsum("j,ijkl,l->ik", x, stiffness, y) for x, y in ((a, a), (a, b), (b, b)))
        total += q - r @ np.linalg.solve(s, r.T)
    return float(normal @ np.linalg.solve(total / steps, normal))


def point_response(stiffness, normal, directions=24):
    """h of equally spaced directions of the surface over half a turn, from the first of `frame`."""
    first, second, n = frame(normal)
    angle = np.arange(directions) * math.pi / directions
    z = np.array([compliance(stiffness, math.cos(a) * first + math.sin(a) * second, n) for a in angle])
    harmonics = np.fft.rfft(z)  # of 2, 4, ... times the angle
    return np.fft.irfft(harmonics * (-1.0) ** np.arange(len(harmonics)), directions) / (2 * math.pi)


def punch_modulus(stiffness, normal):
    """E' of S = 2 E' a."""
    return 1 / (math.pi * float(np.mean(point_response(stiffness, normal))))


def sphere_modulus(stiffness, normal):
    """E' of F = 4/3 E' sqrt(R) d^1.5. The pressure is a half ellipsoid over an ellipse of axes 1 and b along
    whose own directions the surface curves alike."""
    h = point_response(stiffness, normal)
    angle = np.arange(len(h)) * math.pi / len(h)
    turn = 0.5 * np.angle(np.sum(h * np.exp(2j * angle)))  # the surface's own axes
    c, s = np.cos(angle - turn) ** 2, np.sin(angle - turn) ** 2

    def curves(b):  # over pi/2 p: depth, and half the curvatures along both axes
        a = c + s / b**2
        step = math.pi / len(h)
        return [step * float(np.sum(h * f)) for f in (a**-0.5, s / b**2 * a**-1.5, c / b**2 * a**-1.5)]

    low, high = 0.2, 5.0
    for _ in range(80):
        b = math.sqrt(low * high)
        _, along, across = curves(b)
        low, high = (b, high) if across > along else (low, b)
    depth, along, _ = curves(b)
    depth, curvature = math.pi / 2 * depth, math.pi * along  # of a pressure of 1: d, 1/R
    force = 2 / 3 * math.pi * b
    return force / (4 / 3 * math.sqrt(1 / curvature) * depth**1.5)


def waves(stiffness, along, normal):
    """Stroh's six waves exp(i k (x + p y)), x along a direction of the surface and y along its normal: p,
    displacements and tractions (over i k) across the surface, as columns. Those with a negative imaginary
    part of p die away below."""
    q, r, t = (
        np.einsum("j,ijkl,l->ik", x, stiffness, y)
        for x, y in ((along, along), (along, normal), (normal, normal))
    )
    inverse = np.linalg.inv(t)
    upper = -inverse @ r.T
    p, both = np.linalg.eig(np.block([[upper, inverse], [r @ inverse @ r.T - q, upper.T]]))
    return p, both[:3], both[3:]


def base_compliance(stiffness, normal, directions=12, steps=200, largest=25.0):
    """How much less (over P/(E't), E' of a punch) the surface of a layer of thickness t that is bonded to a
    rigid base goes down far away from a small contact: the sum over all waves of what the base takes off
    their displacement. Not for isotropic bodies, whose waves coincide (base_compliance of layered.py)."""
    first, second, n = frame(normal)
    place, weight = np.polynomial.legendre.leggauss(steps)
    place, weight = 0.5 * largest * (place + 1), 0.5 * largest * weight  # wave numbers times t
    total = 0.0
    for angle in np.arange(directions) * math.pi / directions:
        p, moved, drawn = waves(stiffness, math.cos(angle) * first + math.sin(angle) * second, n)
        down = p.imag < 0
        free = float(np.real(n @ moved[:, down] @ np.linalg.solve(1j * drawn[:, down], n)))
        # each wave is 1 where it is largest, at the surface or at the base
        turn = p * place[:, None]
        top, base = np.exp(1j * np.where(down, 0, turn)), np.exp(1j * np.where(down, -turn, 0))
        system = np.concatenate([1j * drawn * top[:, None], moved * base[:, None]], axis=1)
        wanted = np.broadcast_to(np.concatenate([n, np.zeros(3)])[:, None], (steps, 6, 1))
        shares = np.linalg.solve(system, wanted)[:, :, 0]
        total += float(weight @ (free - np.real(((n @ moved) * top * shares).sum(axis=1))))
    return total / (2 * math.pi * directions) * punch_modulus(stiffness, normal)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    found = cubic(*map(float, sys.argv[1:]))
    for name, normal in SURFACES.items():
        print(
            f"({name}) punch {punch_modulus(found, normal):.5g}, sphere {sphere_modulus(found, normal):.5g}"
        )
