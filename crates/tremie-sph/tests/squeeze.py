"""Finite-element reference for planar squeeze flow of a Bingham block between rough plates.

A block of height H and half-width a0 (plane strain, symmetric about x = 0, no gravity) lies on a
fixed no-slip plate z = 0; the upper no-slip plate z = h(t) comes down (A) without mass under the
constant force F = n mu U per depth on the whole sample, or (B) at the constant speed U.  The side
is free of traction, bulges, and sticks to a plate where it touches it.

Units: H, U, H/U, mu U/H (length, velocity, time, stress).  Equations, with Re = rho U H/mu and
Bn = tau0 H/(mu U):

    Re (du/dt + (u - w).grad u) = -grad p + div((1 + Bn/sqrt(g^2 + eps^2)) 2 D(u)),   div u = 0,

g = sqrt(2 D:D), w the mesh velocity.  Fluid at rest at t = 0.

Space: Taylor-Hood P2/P1 on straight triangles of a structured mesh of the half, mapped to the
polyline of surface vertices.  The vertices follow the fluid (velocity projected so that the flux of
the P2 field is kept), stick where they reach a plate, and are spread again along the side; what
area this loses is given back by an even x-shift of the side and is reported.
Time: ALE BDF2 for the momentum, Adams-Bashforth 2 for plate and side.
Yield stress: Bercovier-Engelman regularisation, solved by a primal-dual Newton iteration.

Sources: Bercovier & Engelman, J. Comput. Phys. 36 (1980) 313 (regularisation); Chan, Golub & Mulet,
SIAM J. Sci. Comput. 20 (1999) 1964, and De los Reyes & Gonzalez Andrade, J. Comput. Appl. Math. 235
(2010) 11 (primal-dual Newton).

Commands (OMP_NUM_THREADS=1; CSV files go to the current directory):
    python squeeze.py check       closed-form checks, convergence in eps, printed only
    python squeeze.py load        load.csv
    python squeeze.py velocity    velocity.csv
    python squeeze.py run RE BN LOAD WIDTH T_END ROWS [EPS]   one load case, printed only
Every CSV value is the one of the finest of three meshes (time steps refined with them);
estimated_error is the larger of twice its distance from the middle one (exact for first order,
refinement 1.5) and its distance from the coarsest one.
"""

import csv
import sys
import time

import numpy as np
from scipy.interpolate import Akima1DInterpolator, PchipInterpolator
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

# Degree-4 triangle rule (Dunavant), barycentric points and weights.
_A, _B, _WA, _WB = 0.445948490915965, 0.091576213509771, 0.223381589678011, 0.109951743655322
POINTS = np.array([[1 - 2 * a if i == k else a for i in range(3)] for a in (_A, _B) for k in range(3)])
WEIGHTS = np.array([_WA] * 3 + [_WB] * 3)
EDGES = ((0, 1), (1, 2), (2, 0))
SHAPE = np.hstack([POINTS * (2 * POINTS - 1),
                   np.array([[4 * p[i] * p[k] for i, k in EDGES] for p in POINTS])])
# d(shape)/d(barycentric): (quadrature point, shape, barycentric).
DSHAPE = np.zeros((6, 6, 3))
for _q, _p in enumerate(POINTS):
    for _i in range(3):
        DSHAPE[_q, _i, _i] = 4 * _p[_i] - 1
    for _e, (_i, _k) in enumerate(EDGES):
        DSHAPE[_q, 3 + _e, _i], DSHAPE[_q, 3 + _e, _k] = 4 * _p[_k], 4 * _p[_i]


class Mesh:
    """Topology of nx by nz cells, each cut so that no triangle has two edges at a contact corner."""

    def __init__(self, nx, nz):
        self.nx, self.nz = nx, nz
        self.rows = 2 * nz + 1
        tri = []
        for i in range(nx):
            for j in range(nz):
                a, b, c, d = (i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)
                tri += [(a, b, c), (a, c, d)] if 2 * j >= nz else [(a, b, d), (b, c, d)]
        tri = np.array(tri)
        grid = np.concatenate([2 * tri, np.stack([tri[:, i] + tri[:, k] for i, k in EDGES], 1)], 1)
        self.tri = grid[..., 0] * self.rows + grid[..., 1]  # P2 nodes
        self.vertex = tri[..., 0] * (nz + 1) + tri[..., 1]  # P1 nodes
        self.nodes, self.vertices = (2 * nx + 1) * self.rows, (nx + 1) * (nz + 1)
        node = np.arange(self.nodes).reshape(2 * nx + 1, self.rows)
        self.axis, self.bottom, self.top, self.side = node[0], node[:, 0], node[:, -1], node[-1]
        # Element unknowns u (6), w (6), p (3); u and w of a node are 2k and 2k + 1.
        self.unknowns = np.hstack([2 * self.tri, 2 * self.tri + 1, 2 * self.nodes + self.vertex])
        self.fixed = np.zeros(2 * self.nodes + self.vertices, bool)
        self.fixed[2 * np.concatenate([self.axis, self.bottom, self.top])] = True
        self.fixed[2 * self.bottom + 1] = True

    def place(self, side):
        """P2 node positions for the side vertices (nz + 1, 2), from the lower to the upper contact."""
        nx, nz, h = self.nx, self.nz, side[-1, 1]
        slender = np.mean(side[:, 0]) / h
        share = 1 - (1 - np.arange(nx + 1) / nx) ** (1 + 0.4 * np.log10(max(2 * slender, 1.0)))
        even = h * spread(nz, 0.3)
        near = (share ** 4)[:, None]
        x = share[:, None] * side[:, 0]
        z = (1 - near) * even + near * side[:, 1]
        corner = np.stack([x, z], -1)
        node = np.empty((2 * nx + 1, self.rows, 2))
        node[::2, ::2] = corner
        node[1::2, ::2] = (corner[1:] + corner[:-1]) / 2
        node[::2, 1::2] = (corner[:, 1:] + corner[:, :-1]) / 2
        half = (nz + 1) // 2
        node[1::2, 1::2] = (corner[1:, :-1] + corner[:-1, 1:]) / 2
        node[1::2, 1 + 2 * half::2] = (corner[1:, half + 1:] + corner[:-1, half:-1]) / 2
        return node.reshape(-1, 2)


def spread(n, ends):
    """n + 1 points of [0, 1], closer at both ends the larger `ends` (0 to 1)."""
    s = np.arange(n + 1) / n
    return (1 - ends) * s + ends * (1 - np.cos(np.pi * s)) / 2


def solve(mesh, pos, u, p, speed, load, re, bn, eps, mu=1.0, a0=0.0, history=0.0, wmesh=0.0):
    """Velocity (nodes, 2), pressure, plate velocity and plate forces at one time.

    The momentum has the inertia re (a0 u + history + (u - wmesh).grad u).  `speed` is the (upward)
    plate velocity: given if load is None, else a first guess.
    """
    tri, nt = mesh.tri, len(mesh.tri)
    c = pos[tri[:, :3]]
    e1, e2 = c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]
    det = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    if det.min() <= 0:
        raise RuntimeError("inverted triangle")
    g1 = np.stack([e2[:, 1], -e2[:, 0]], 1) / det[:, None]
    g2 = np.stack([-e1[:, 1], e1[:, 0]], 1) / det[:, None]
    grad = np.einsum("qsb,tbd->tqsd", DSHAPE, np.stack([-g1 - g2, g1, g2], 1))
    w = WEIGHTS * det[:, None] / 2
    # Strain vector d = (sqrt2 exx, sqrt2 ezz, gxz), |d| = g.
    b = np.zeros((nt, 6, 3, 12))
    b[:, :, 0, :6] = b[:, :, 2, 6:] = grad[..., 0]
    b[:, :, 1, 6:] = b[:, :, 2, :6] = grad[..., 1]
    b[:, :, :2] *= np.sqrt(2)
    flat = b.reshape(nt, 18, 12)
    div = -np.einsum("tq,qv,tqsd->tvds", w, POINTS, grad).reshape(nt, 3, 12)
    base = np.zeros((nt, 15, 15))
    base[:, 12:, :12], base[:, :12, 12:] = div, div.transpose(0, 2, 1)
    base[:, :12, :12] += mu * flat.transpose(0, 2, 1) @ (w[:, :, None, None] * b).reshape(nt, 18, 12)
    mass = re * a0 * np.einsum("tq,qs,qr->tsr", w, SHAPE, SHAPE)
    source = np.zeros((nt, 15))
    if re:
        acc = np.einsum("tq,qs,qr,trd->tds", w, SHAPE, SHAPE, history[tri])
        source[:, :12] = re * acc.reshape(nt, 12)

    fixed = mesh.fixed.copy()
    total = len(fixed)
    number = np.full(total, -1)
    moving = 2 * mesh.top + 1
    fixed[moving] = True
    number[~fixed] = np.arange((~fixed).sum())
    size = (~fixed).sum()
    if load is not None:
        number[moving] = size
        size += 1
    index = number[mesh.unknowns]
    row, col = np.repeat(index, 15, 1).ravel(), np.tile(index, (1, 15)).ravel()
    keep = (row >= 0) & (col >= 0)
    row, col = row[keep], col[keep]

    u = u.copy()
    u[mesh.top, 1] = speed
    x = np.concatenate([u.ravel(), p])
    dual = np.zeros((nt, 6, 3))

    def residual(x):
        v = x[:2 * mesh.nodes].reshape(-1, 2)
        mat = base.copy()
        if re:
            carry = np.einsum("qs,tsd->tqd", SHAPE, (v - wmesh)[tri])
            m = mass + re * np.einsum("tq,qs,tqrd,tqd->tsr", w, SHAPE, grad, carry)
            mat[:, :6, :6] += m
            mat[:, 6:12, 6:12] += m
        xe = x[mesh.unknowns]
        res = (mat @ xe[:, :, None])[..., 0] + source
        d = (flat @ xe[:, :12, None]).reshape(nt, 6, 3)
        return mat, res, d

    ladder = [e for e in 10.0 ** -np.arange(0, 12) if e > 3 * eps] + [eps] if bn else [1.0]
    stage, count = (0 if not np.any(u[:, 0]) else len(ladder) - 1), 0
    start = x.copy()
    while True:
        e = ladder[stage]
        mat, res, d = residual(x)
        if bn:
            m = np.sqrt((d * d).sum(-1) + e * e)
            if count == 0:
                dual = d / m[..., None]
            outer = dual[..., :, None] * d[..., None, :] / m[..., None, None]
            tangent = (np.eye(3) - (outer + outer.swapaxes(-1, -2)) / 2) * (bn * w / m)[..., None, None]
            mat[:, :12, :12] += flat.transpose(0, 2, 1) @ (tangent @ b).reshape(nt, 18, 12)
            stress = (bn * w / m)[..., None] * d
            res[:, :12] += (flat.transpose(0, 2, 1) @ stress.reshape(nt, 18, 1))[..., 0]
        full = np.bincount(mesh.unknowns.ravel(), res.ravel(), total)
        right = np.zeros(size)
        right[number[~fixed]] = -full[~fixed]
        if load is not None:
            right[-1] = -full[moving].sum() - load / 2
        k = coo_matrix((mat.ravel()[keep], (row, col)), (size, size)).tocsc()
        step = np.append(splu(k).solve(right), 0.0)[number]
        x = x + step
        count += 1
        if bn:
            de = (flat @ step[mesh.unknowns][:, :12, None]).reshape(nt, 6, 3)
            dual = (d + de) / m[..., None] - dual * ((d * de).sum(-1) / m ** 2)[..., None]
            dual /= np.maximum(1.0, np.sqrt((dual * dual).sum(-1)))[..., None]
        change = np.abs(step[:2 * mesh.nodes]).max()
        now = np.abs(x[:2 * mesh.nodes]).max()
        last = stage == len(ladder) - 1
        # At the edge of rigid zones single points may cycle: settle for less after 20 iterations.
        if not bn and not re or change < (1e-2 if not last else 1e-4 if count < 20 else 1e-3) * (now + e):
            if last:
                break
            stage, count = stage + 1, 1
        elif count > 60:
            if stage == 0 or np.array_equal(start, 0 * start):
                raise RuntimeError(f"no convergence at eps = {e}, change {change}, of {now}")
            x, stage, count = 0 * start, 0, 0
            x[moving], start = speed, 0 * start
    v = x[:2 * mesh.nodes].reshape(-1, 2)
    mat, res, d = residual(x)
    if bn:
        m = np.sqrt((d * d).sum(-1) + eps * eps)
        stress = (bn * w / m)[..., None] * d
        res[:, :12] += (flat.transpose(0, 2, 1) @ stress.reshape(nt, 18, 1))[..., 0]
    full = np.bincount(mesh.unknowns.ravel(), res.ravel(), total)
    force = -2 * full[moving].sum(), 2 * full[2 * mesh.bottom + 1].sum()
    return v, x[2 * mesh.nodes:], v[mesh.top[0], 1], force


def area(side):
    return np.sum((side[1:, 0] + side[:-1, 0]) * np.diff(side[:, 1])) / 2


def side_velocity(mesh, side, u):
    """Velocity of the side vertices which carries the flux of the P2 velocity through the side."""
    v = u[mesh.side]
    edge = np.diff(side, axis=0)
    normal = np.stack([edge[:, 1], -edge[:, 0]], 1)  # outward, times the edge length
    flux = np.zeros(len(side))
    flux[:-1] += np.einsum("ed,ed->e", normal, v[:-1:2] / 6 + v[1::2] / 3)
    flux[1:] += np.einsum("ed,ed->e", normal, v[2::2] / 6 + v[1::2] / 3)
    at = np.zeros_like(side)
    at[:-1] += normal / 2
    at[1:] += normal / 2
    v = v[::2].copy()
    miss = flux - np.einsum("vd,vd->v", at, v)
    miss[1] += miss[0]
    miss[-2] += miss[-1]
    v[1:-1] += at[1:-1] * (miss[1:-1] / (at[1:-1] ** 2).sum(-1))[:, None]
    return v


def move(side, shift, h, volume):
    """Side after `shift` with the upper plate at h; also the area given back, and if a vertex stuck."""
    side = side + shift
    n = len(side) - 1
    side[0, 1], side[-1, 1] = 0.0, h
    near = 0.03 * np.hypot(*np.diff(side, axis=0).T)
    half = n // 2
    low = np.flatnonzero(np.append(0.0, side[1:half + 1, 1]) <= np.append(0.0, near[1:half + 1]))[-1]
    high = half + np.flatnonzero(np.append(side[half:-1, 1], h) >= h - np.append(near[half:], 0.0))[0]
    stuck = low > 0 or high < n
    side = side[low:high + 1]
    side[0, 1], side[-1, 1] = 0.0, h
    arc = np.append(0, np.cumsum(np.hypot(*np.diff(side, axis=0).T)))
    at = arc[-1] * spread(n, 0.9)
    side = np.stack([Akima1DInterpolator(arc, side[:, 0], method="makima")(at),
                     PchipInterpolator(arc, side[:, 1])(at)], 1)  # z must stay between the plates
    weight = np.append(np.append(0, (side[2:, 1] - side[:-2, 1]) / 2), 0)
    lost = volume - area(side)
    side[1:-1, 0] += lost / weight.sum()
    return side, lost, stuck


def run(re, bn, load, times, rows, width=0.5, eps=1e-6, pace=1.0, cap=np.inf, log=None):
    """History at `times` of (t, h, force on the upper, on the lower plate, contact half-width, top).

    load None: plate speed 1.  `pace` scales the time steps, which also follow the mesh (rows).
    """
    mesh = Mesh(rows, rows)
    side = np.stack([np.full(rows + 1, width), spread(rows, 0.9)], 1)
    volume = area(side)
    speed = 0.0 if load is not None else -1.0
    u, p, force = np.zeros((mesh.nodes, 2)), np.zeros(mesh.vertices), (0.0, 0.0)
    pos = mesh.place(side)
    args = dict(load=load, re=re, bn=bn, eps=eps)
    if not re or load is None:  # at once the creeping flow, or the flow of an impulsive start
        u, p, speed, force = solve(mesh, pos, u, p, speed, a0=1e6, history=0 * u, **args)
    t, h, given, old, dtp, out = 0.0, 1.0, 0.0, None, None, []
    for end in times:
        while t < end - 1e-12:
            dt = pace * min(cap, max(0.04, 0.5 * t)) / rows
            dt = (end - t) / np.ceil((end - t) / dt - 1e-9)
            v = side_velocity(mesh, side, u)
            if old is None:
                dv = ds = 0.0
            else:
                dv, ds = (v - old[2]) * dt / (2 * dtp), (speed - old[3]) * dt / (2 * dtp)
            h += dt * (speed + ds)
            t += dt
            new_side, lost, stuck = move(side, dt * (v + dv), h, volume)
            given += abs(lost)
            new = mesh.place(new_side)
            if old is None or stuck:
                a0, a1, a2 = 1 / dt, -1 / dt, 0.0
            else:
                r = dt / dtp
                a0, a1, a2 = (1 + 2 * r) / (1 + r) / dt, -(1 + r) / dt, r * r / (1 + r) / dt
            history = a1 * u + (a2 * old[0] if a2 else 0.0)
            wmesh = a0 * new + a1 * pos + (a2 * old[1] if a2 else 0.0)
            u2, p, speed2, force = solve(mesh, new, u, p, speed, a0=a0, history=history,
                                         wmesh=wmesh, **args)
            old = None if stuck else (u, pos, v, speed)
            u, pos, side, speed, dtp = u2, new, new_side, speed2, dt
            if log:
                log(t, h, speed, force, side)
        out.append((t, h, *force, (side[0, 0] + side[-1, 0]) / 2, side[:, 0].max(), given / volume))
    return np.array(out)


def flat(length, h, rows, cols, **kw):
    """Force on a flat block of half-width `length` for plate speed 1, without inertia."""
    mesh = Mesh(cols, rows)
    side = np.stack([np.full(rows + 1, length), h * spread(rows, 0.9)], 1)
    zero = np.zeros((mesh.nodes, 2)), np.zeros(mesh.vertices)
    return solve(mesh, mesh.place(side), *zero, -1.0, None, 0.0, **kw)[3]


def check():
    for length in (5.0, 10.0, 20.0, 40.0):
        got = [flat(length, 1.0, n, 3 * n, bn=0.0, eps=1.0)[0] / (8 * length ** 3) for n in (6, 10, 16)]
        print("thin Newtonian film, L/h", length, "force over 8 mu V L^3/h^3:", np.round(got, 5))
    for length in (0.5, 1.0, 2.0, 4.0):
        law = 2 * length ** 2 * (1 + 1.5 / length)
        got = [flat(length, 1.0, n, n * max(1, int(length)), bn=1.0, eps=1e-4, mu=1e-5)[0] / law
               for n in (8, 12, 18, 27)]
        print("perfectly plastic, L/h", length, "force over 2 tau0 L^2/h (1 + 3h/2L):", np.round(got, 4))


LOAD_TIMES = [0.1, 0.2, 0.5, 1, 2, 4, 8, 20]
LOAD_CASES = [(1, 4, 10, 0.5), (1, 5, 10, 0.5), (1, 1, 10, 0.5), (1, 1, 5, 0.5), (1, 1, 20, 0.5),
              (1, 0, 10, 0.5), (1, 0, 10, 1.0)]
SPEED_CASES = [(1, 0.5), (5, 0.5), (10, 0.5), (10, 1), (10, 5)]
ROWS = [8, 12, 18]
SPEED_ROWS = [6, 9, 14]


def load():
    with open("load.csv", "w", newline="") as file:
        out = csv.writer(file)
        out.writerow("re bn load half_width_over_H time_U_over_H height_over_H estimated_error".split())
        for re, bn, n, width in LOAD_CASES:
            times = LOAD_TIMES + ([50] if bn == 0 else [])
            h = []
            for rows in ROWS:
                tic = time.time()
                got = run(re, bn, n, times, rows, width)
                h.append(got[:, 1])
                print((re, bn, n, width), rows, np.round(h[-1], 5), "contact", np.round(got[-1, 4:6], 3),
                      "area given back", f"{got[-1, 6]:.1e}", f"{time.time() - tic:.0f} s", flush=True)
            error = np.maximum(2 * abs(h[-1] - h[-2]), abs(h[-1] - h[-3]))
            for t, a, e in zip(times, h[-1], error):
                out.writerow([re, bn, n, width, t, f"{a:.5f}", f"{e:.5f}"])
            file.flush()


def force_at(log, t):
    """Forces at t by a least-squares parabola over 0.1 H/U: sticking vertices give single peaks."""
    near = log[abs(log[:, 0] - t) < 0.05 + 1e-9]
    return np.polyfit(near[:, 0] - t, near[:, 1:], 2)[-1]


def velocity():
    with open("velocity.csv", "w", newline="") as file:
        out = csv.writer(file)
        out.writerow("re bn height_over_H force_upper_over_muU force_lower_over_muU estimated_error".split())
        heights = [0.9, 0.8, 0.6, 0.4]
        for re, bn in SPEED_CASES:
            f = []
            for rows in SPEED_ROWS:
                tic = time.time()
                log = []
                got = run(re, bn, None, [0.65], rows, cap=0.1,
                          log=lambda t, h, speed, force, side: log.append((t, *force)))
                f.append(np.array([force_at(np.array(log), 1 - h) for h in heights]))
                print((re, bn), rows, np.round(f[-1].ravel(), 4), "area given back",
                      f"{got[-1, 6]:.1e}", f"{time.time() - tic:.0f} s", flush=True)
            error = np.maximum(2 * abs(f[-1] - f[-2]), abs(f[-1] - f[-3])).max(-1)
            for h, a, e in zip(heights, f[-1], error):
                out.writerow([re, bn, h, f"{a[0]:.4f}", f"{a[1]:.4f}", f"{e:.4f}"])
            file.flush()


if __name__ == "__main__":
    if sys.argv[1] == "run":
        re, bn, n, width, end, *rest = map(float, sys.argv[2:])
        times = [t for t in LOAD_TIMES if t < end] + [end]
        for line in run(re, bn, n, times, int(rest[0]), width, *rest[1:]):
            print(*np.round(line, 6), flush=True)
    else:
        {"check": check, "load": load, "velocity": velocity}[sys.argv[1]]()
