"""Plain beams as a continuum with a cohesive crack: the reference of fracture-v7 and fracture-v8.

Half of a beam in plane stress without lateral contraction, elements of nine nodes, and in the plane of symmetry a cohesive
crack with the same softening (Hillerborg, Modeer and Petersson 1976), which is stiff until it opens. Newton's method at openings that grow.
No lattice, no facets, no secants: nothing is shared with the program but the beam. Needs numpy and scipy:

    python crates/tremie-fracture/tests/continuum.py four-point > validation/fracture-v7/reference.csv
    python crates/tremie-fracture/tests/continuum.py notched > validation/fracture-v8/reference.csv

Units: N, mm, MPa.
"""

import sys

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linear

MODULUS, WIDTH, HEIGHT, HALF = 30e3, 150.0, 150.0, 300.0
STRENGTH, KINK_STRESS, KINK, LAST = 2.0, 0.5, 0.05, 0.3
ENERGY = 0.5 * (STRENGTH * KINK + KINK_STRESS * LAST)
# Length of matrix whose give the closed crack has.
STIFF = 0.05
BEARING = 10.0
OPENINGS = np.concatenate([np.arange(0.0005, 0.06, 0.0005), np.arange(0.06, 1.2 + 1e-9, 0.004)])
TESTS = {
    # notch, distance of a load and of a support from the middle, stress for 1 N
    "four-point": (0.0, 75.0, 225.0, 450.0 / (WIDTH * HEIGHT**2)),
    "notched": (25.0, 0.0, 250.0, 3 * 500.0 / (2 * WIDTH * (HEIGHT - 25.0) ** 2)),
}

GAUSS = list(zip([-np.sqrt(0.6), 0.0, np.sqrt(0.6)], [5 / 9, 8 / 9, 5 / 9]))


def shape(t):
    return np.array([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2])


def slope(t):
    return np.array([t - 0.5, -2 * t, t + 0.5])


def element(size):
    law = MODULUS * np.diag([1.0, 1.0, 0.5])
    stiffness = np.zeros((18, 18))
    for a, weight_a in GAUSS:
        for b, weight_b in GAUSS:
            x = np.outer(slope(a), shape(b)).ravel() * 2 / size
            z = np.outer(shape(a), slope(b)).ravel() * 2 / size
            strain = np.zeros((3, 18))
            strain[0, 0::2], strain[1, 1::2], strain[2, 0::2], strain[2, 1::2] = x, z, z, x
            stiffness += strain.T @ law @ strain * weight_a * weight_b * size**2 / 4 * WIDTH
    return stiffness


def solve(test, size):
    notch, load_at, support_at, nominal = TESTS[test]
    columns, rows = round(HALF / size), round(HEIGHT / size)
    node = np.arange((2 * columns + 1) * (2 * rows + 1)).reshape(2 * columns + 1, 2 * rows + 1)
    count = 2 * node.size
    i, j = [], []
    for a in range(columns):
        for b in range(rows):
            n = node[2 * a : 2 * a + 3, 2 * b : 2 * b + 3].ravel()
            unknowns = np.stack([2 * n, 2 * n + 1], 1).ravel()
            i.append(np.repeat(unknowns, 18))
            j.append(np.tile(unknowns, 18))
    values = np.tile(element(size).ravel(), columns * rows)
    stiffness = sparse.csc_matrix((values, (np.concatenate(i), np.concatenate(j))), shape=(count, count))

    def line(away, row):
        """The mean vertical displacement over a bearing, or its half in the plane of symmetry."""
        x = HALF - np.arange(2 * columns + 1) * size / 2
        near = np.flatnonzero(np.abs(x - away) <= BEARING / 2 + 1e-9)
        weights = np.where(near % 2 == 0, 2 / 3, 4 / 3)
        if away == 0:
            weights[-1] /= 2
        found = np.zeros(count)
        found[2 * node[near, row] + 1] = weights / weights.sum()
        return found

    force = line(support_at, 0) - line(load_at, -1)
    crack = 2 * node[-1]
    held = 2 * node[columns, rows] + 1
    free = np.setdiff1d(np.arange(count), np.append(crack, held))
    factor = linear.splu(stiffness[free][:, free])
    coupling = stiffness[crack][:, free]
    rest = stiffness[crack][:, crack].toarray() - coupling @ factor.solve(coupling.T.toarray())
    loose = factor.solve(force[free])
    pull, give = force[crack] - coupling @ loose, force[free] @ loose

    places, areas = [], []
    for b in range(rows):
        for a, weight in GAUSS:
            if (b + 0.5 + a / 2) * size > notch:
                place = np.zeros(len(crack))
                place[2 * b : 2 * b + 3] = shape(a)
                places.append(place)
                areas.append(weight * size / 2 * WIDTH)
    places, areas = np.array(places), np.array(areas)

    soft = STIFF / MODULUS
    jumps = np.array([-1.0, 0.0, STRENGTH * soft, KINK + KINK_STRESS * soft, LAST, 10.0])
    stresses = np.array([-1.0 / soft, 0.0, STRENGTH, KINK_STRESS, 0.0, 0.0])
    tangents = np.diff(stresses) / np.diff(jumps)

    # Of one half: displacements along x in the plane of symmetry, and the load on the whole beam.
    moved, load = np.zeros(len(crack)), 0.0
    readings = []
    for opening in OPENINGS:
        for _ in range(200):
            jump = -2 * places @ moved
            part = np.clip(np.searchsorted(jumps, jump, side="right") - 1, 0, 4)
            stress = stresses[part] + tangents[part] * (jump - jumps[part])
            residual = rest @ moved - places.T @ (areas * stress) - load / 2 * pull
            system = np.zeros((len(crack) + 1,) * 2)
            system[:-1, :-1] = rest + 2 * places.T @ ((areas * tangents[part])[:, None] * places)
            system[:-1, -1] = -pull / 2
            system[-1, 0] = -2
            step = np.linalg.solve(system, np.append(-residual, opening + 2 * moved[0]))
            moved, load = moved + step[:-1], load + step[-1]
            if np.abs(step[:-1]).max() < 1e-10 and abs(step[-1]) < 1e-6 * abs(load):
                break
        else:
            raise SystemExit(f"no equilibrium at {opening} mm")
        readings.append([opening, load, load / 2 * give + pull @ moved])
    opening, load, deflection = np.array(readings).T
    work = np.trapezoid(np.append(0, load), np.append(0, deflection))
    stress = nominal * load
    top = stress.argmax()
    at = [np.interp(x, opening, stress) for x in (0.3, 0.5, 1.0)]
    work /= ENERGY * WIDTH * (HEIGHT - notch)
    return [size, stress[top], opening[top], work, *at]


print("# Plain beams by finite elements of nine nodes with a cohesive crack: crates/tremie-fracture/tests/continuum.py; one row a mesh.")
print("element_mm,largest_stress_MPa,opening_there_mm,work_over_GF_A,stress_0.3mm_MPa,stress_0.5mm_MPa,stress_1.0mm_MPa")
for size in (5.0, 2.5, 1.25):
    print(",".join(f"{x:.5g}" for x in solve(sys.argv[1], size)), flush=True)
