#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Limit pressure under a rigid flat punch on an elastic-perfectly-plastic block.

Small-strain von Mises plasticity (E/sigma_y = 577, nu = 0.3, no hardening), flat
frictionless or fully rough punch of radius (half width) 1.  The script computes
the mean pressure p at the plateau of the load-settlement curve over the shear
yield stress k = sigma_y/sqrt(3), for
  * a thick tube b/a = 2 under internal pressure  (exact: p/k = 2 ln 2 = 1.3863),
  * the plane-strain punch                        (exact: p/k = 2 + pi = 5.1416),
  * the circular punch on blocks 4 x 3 and 8 x 6 (radius x depth), smooth, and rough.
Block: u_r = 0 on the axis and on the side, u_z = 0 on the bottom, sliding both;
top free outside the punch; the contact under the punch is bilateral.

Method: 8-node quadrilaterals, 2 x 2 Gauss points (3 x 3 on request), radial return
with the consistent tangent, Newton with a line search, prescribed settlement.  Meshes
are graded to the punch edge by a fixed map, so that n, 2n, ... are nested (nearly,
counts are rounded) and all sizes scale as 1/n; the limit h -> 0 is extrapolated.

Usage: limit_punch.py [--quick] [--full]     (--full adds the 3 x 3 integration)
"""
import sys
import time

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

SY, E, NU = 1.0, 577.0, 0.3
K_SHEAR = SY / np.sqrt(3.0)
G, KB = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))
ONE = np.array([1.0, 1.0, 1.0, 0.0])                 # rr, zz, tt, rz (gamma)
IDEV = np.diag([1.0, 1.0, 1.0, 0.5]) - np.outer(ONE, ONE) / 3.0


def graded(length, n, a):
    """n + 1 points on [0, length], element sizes growing by exp(a) in all."""
    s = np.linspace(0.0, 1.0, n + 1)
    return length * s if a == 0 else length * np.expm1(a * s) / np.expm1(a)


def shape(x, y):
    """Q8 shape functions' values and derivatives; corners, then midsides, ccw."""
    xc, yc = np.array([-1, 1, 1, -1.0]), np.array([-1, -1, 1, 1.0])
    n = np.r_[(1 + x * xc) * (1 + y * yc) * (x * xc + y * yc - 1) / 4,
              (1 - x * x) * (1 - y) / 2, (1 + x) * (1 - y * y) / 2,
              (1 - x * x) * (1 + y) / 2, (1 - x) * (1 - y * y) / 2]
    dx = np.r_[xc * (1 + y * yc) * (2 * x * xc + y * yc) / 4,
               -x * (1 - y), (1 - y * y) / 2, -x * (1 + y), -(1 - y * y) / 2]
    dy = np.r_[yc * (1 + x * xc) * (2 * y * yc + x * xc) / 4,
               -(1 - x * x) / 2, -y * (1 + x), (1 - x * x) / 2, -y * (1 - x)]
    return n, dx, dy


class Block:
    """Structured Q8 mesh of grid lines r x z with its B matrices and weights."""

    def __init__(self, r, z, axisym, order=2):
        nr, nz = len(r) - 1, len(z) - 1
        rr, zz = (np.insert(g, np.arange(1, len(g)), (g[1:] + g[:-1]) / 2) for g in (r, z))
        num = -np.ones((2 * nr + 1, 2 * nz + 1), int)
        keep = ~((np.arange(2 * nr + 1)[:, None] % 2 == 1) & (np.arange(2 * nz + 1) % 2 == 1))
        num[keep] = np.arange(keep.sum())
        i, j = np.nonzero(keep)
        self.x = np.c_[rr[i], zz[j]]
        a, b = (v.ravel() for v in np.meshgrid(2 * np.arange(nr), 2 * np.arange(nz), indexing="ij"))
        con = np.stack([num[a + p, b + q] for p, q in
                        ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))], 1)
        self.dof = np.stack([2 * con, 2 * con + 1], 2).reshape(len(con), 16)
        self.ndof, bs, ws = 2 * len(self.x), [], []
        pts, wts = np.polynomial.legendre.leggauss(order)
        xe = self.x[con]
        for p, wp in zip(pts, wts):
            for q, wq in zip(pts, wts):
                n, dx, dy = shape(p, q)
                jac = np.einsum("da,eai->edi", np.stack([dx, dy]), xe)
                dn = np.linalg.solve(jac, np.broadcast_to(np.stack([dx, dy]), (len(con), 2, 8)))
                rad = xe[:, :, 0] @ n
                bm = np.zeros((len(con), 4, 16))
                bm[:, 0, 0::2], bm[:, 1, 1::2] = dn[:, 0], dn[:, 1]
                bm[:, 3, 0::2], bm[:, 3, 1::2] = dn[:, 1], dn[:, 0]
                if axisym:
                    bm[:, 2, 0::2] = n / rad[:, None]
                bs.append(bm)
                ws.append(wp * wq * np.linalg.det(jac) * (2 * np.pi * rad if axisym else 1.0))
        self.b, self.w = np.stack(bs, 1), np.stack(ws, 1)           # e,g,4,16 / e,g
        self.rows = np.repeat(self.dof, 16, axis=1).ravel()
        self.cols = np.tile(self.dof, (1, 16)).ravel()

    def on(self, axis, value, comp, upto=np.inf):
        """Degrees of freedom comp of the nodes at coordinate axis = value, r <= upto."""
        hit = (abs(self.x[:, axis] - value) < 1e-9) & (self.x[:, 0] < upto + 1e-9)
        return 2 * np.nonzero(hit)[0] + comp

    def forces(self, du, sig0):
        """Stress by radial return after the increment du; internal force; tangent."""
        de = np.einsum("egij,ej->egi", self.b, du[self.dof])
        tr = sig0 + KB * (de @ ONE)[..., None] * ONE + 2 * G * (de @ IDEV)
        mean = (tr @ ONE / 3)[..., None] * ONE
        s = tr - mean
        q = np.sqrt(1.5 * ((s[..., :3] ** 2).sum(-1) + 2 * s[..., 3] ** 2))
        f = np.minimum(1.0, SY / np.maximum(q, 1e-30))             # = sigma_y/q if plastic
        nn = s * np.sqrt(1.5) / np.maximum(q, 1e-30)[..., None]
        sig = mean + f[..., None] * s
        d = KB * np.outer(ONE, ONE) + 2 * G * f[..., None, None] * (
            IDEV - (q > SY)[..., None, None] * nn[..., :, None] * nn[..., None, :])
        fint = np.bincount(self.dof.ravel(), np.einsum(
            "egij,egi,eg->ej", self.b, sig, self.w, optimize=True).ravel(), self.ndof)
        wd = d * self.w[..., None, None]
        ke = (self.b.swapaxes(2, 3) @ (wd @ self.b)).sum(1)
        return sig, fint, sp.csc_matrix((ke.ravel(), (self.rows, self.cols)), (self.ndof,) * 2)

    def push(self, fixed, driven, unit, total, first, grow=1.12, tol=1e-7):
        """Drive the dofs by unit * settlement up to total; [(settlement, reaction)]."""
        free = np.setdiff1d(np.arange(self.ndof), np.r_[fixed, driven])
        sig = np.zeros(self.w.shape + (4,))
        t, step, curve, rate = 0.0, first, [(0.0, 0.0)], np.zeros(self.ndof)
        rate[driven] = unit
        while t < total - 1e-12:
            step = min(step, total - t)
            du = rate * step
            new, f, kt = self.forces(du, sig)
            for it in range(30):
                lu = splu(kt[free][:, free], permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.001,
                          options={"SymmetricMode": True})
                d = np.zeros(self.ndof)
                d[free] = -lu.solve(f[free])
                g0, s = d @ f, 1.0
                for _ in range(6):                       # line search on the convex potential
                    new, f, kt = self.forces(du + s * d, sig)
                    g = d[free] @ f[free]
                    if g < 0.5 * abs(g0):
                        break
                    s *= np.clip(g0 / (g0 - g), 0.1, 0.7)
                du = du + s * d
                err = np.abs(f[free]).max() / max(np.abs(f[driven]).sum(), 1e-30)
                if err < tol or not np.isfinite(err):
                    break
            if not err < tol:
                step /= 2
                if step < 1e-4 * first:
                    raise RuntimeError("no convergence at settlement %g" % t)
                continue
            sig, t, rate = new, t + step, du / step
            curve.append((t, abs(f[driven].sum())))
            step *= grow if it < 8 else 1.0
        return np.array(curve)


def punch(n, axisym, radius, depth, rough=False, order=2, total=0.3):
    """(p/k at the end, its relative growth over the last fifth of the way, curve)."""
    more = int(round(n * (1 + 0.5 * np.log2(radius / 4.0))))
    deep = int(round(n * (1 + 0.5 * np.log2(depth / 3.0))))
    r = np.r_[1 - graded(1.0, n, 2.0)[::-1], 1 + graded(radius - 1.0, more, 4.0)[1:]]
    z = -graded(depth, deep, 3.0)[::-1]
    m = Block(r, z, axisym, order)
    fixed = np.r_[m.on(0, 0.0, 0), m.on(0, radius, 0), m.on(1, -depth, 1)]
    if rough:
        fixed = np.r_[fixed, m.on(1, 0.0, 0, 1.0)]
    curve = m.push(np.unique(fixed), m.on(1, 0.0, 1, 1.0), -1.0, total, 1e-3)
    p = curve[:, 1] / (np.pi if axisym else 1.0) / K_SHEAR
    return p[-1], 1 - np.interp(0.8 * total, curve[:, 0], p) / p[-1], np.c_[curve[:, 0], p]


def tube(n):
    m = Block(1 + graded(1.0, n, 0), graded(0.2, 1, 0), True)
    c = m.push(np.r_[m.on(1, 0.0, 1), m.on(1, 0.2, 1)], m.on(0, 1.0, 0), 1.0, 0.02, 5e-4)
    return c[-1, 1] / (2 * np.pi * 0.2) / K_SHEAR


def extrapolate(v):
    """Observed order and limit from three values at h, h/2, h/4; linear limit."""
    d1, d2 = v[-3] - v[-2], v[-2] - v[-1]
    rich = v[-1] - d2 * d2 / (d1 - d2) if d1 * d2 > 0 and d1 / d2 > 1.2 else np.nan
    return np.log2(d1 / d2) if d1 * d2 > 0 else np.nan, rich, v[-1] - d2


def main():
    t0, meshes = time.time(), (6, 12) if "--quick" in sys.argv else (8, 16, 32)
    print("tube b/a = 2: p/k = %.4f (exact %.4f)" % (tube(10), 2 * np.log(2)), flush=True)
    cases = [("plane strain smooth 6x4", (False, 6.0, 4.0)),
             ("circular smooth 4x3", (True, 4.0, 3.0)),
             ("circular smooth 8x6", (True, 8.0, 6.0)),
             ("circular rough 4x3", (True, 4.0, 3.0, True))]
    if "--full" in sys.argv:
        cases += [("plane strain smooth 6x4, 3x3", (False, 6.0, 4.0, False, 3)),
                  ("circular smooth 4x3, 3x3", (True, 4.0, 3.0, False, 3))]
    for name, args in cases:
        vals = []
        for n in meshes:
            t1 = time.time()
            p, slope, _ = punch(n, *args)
            vals.append(p)
            print("%-30s n=%2d  p/k = %.4f  growth over last fifth %.1e  %.0f s"
                  % (name, n, p, slope, time.time() - t1), flush=True)
        if len(vals) > 2:
            print("%-30s order %.2f  Richardson %.4f  linear %.4f" % ((name,) + extrapolate(vals)))
    print("total %.0f s" % (time.time() - t0))


if __name__ == "__main__":
    main()
