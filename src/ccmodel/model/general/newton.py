"""Newton's method for one step of the chain cable A, load pulley, cable B.

Newton's matrix is tridiagonal from the drive end of A over the load pulley to the drive end of B, so it is eliminated
from both drive ends at once. A compliant conduit adds the mean tension of its cable to the unknowns.
"""

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.general import layout as rows
from ccmodel.model.general.equations import imbalance, set_memory
from ccmodel.model.general.layout import Physics

# Out of balance by no more than this share of the tensions' scale: the highest one, or 1 N.
TOLERANCE = 1e-8
LOOSE_TOLERANCE = 1e-5
# A node about to reverse is stopped at the edge of sticking, where its friction is still that of sliding.
EDGE = 1.0 - 1e-9
ITERATIONS = 60
# Iterations with full steps before only steps that reduce the error are accepted.
PATIENCE = 12
SMALLEST_SHARE = 1.0 / 128


@kernel(error_model="numpy", fastmath=rows.FAST, forceinline=True)
def solve(piece: NDArray, node: NDArray, slide: NDArray, G: float, slope: float, R: float, free: bool) -> float:
    """Newton's step of the slides into `STEP`; returns that of the load pulley's rotation.

    Elimination from the drive ends: delta_i = alpha_i + beta_i delta_{i+1}. gamma = 1 - beta is carried along by
    itself, which avoids cancellation where pieces differ in stiffness by many orders.
    """
    n = node.shape[2]
    alpha_A, alpha_B, gamma_A, gamma_B = 0.0, 0.0, 1.0, 1.0
    for i in range(n):
        pA, pB = node[rows.NEAR, 0, i], node[rows.NEAR, 1, i]
        fA, fB = pA * gamma_A + node[rows.GIVES, 0, i], pB * gamma_B + node[rows.GIVES, 1, i]
        iA, iB = 1.0 / (fA + node[rows.FAR, 0, i]), 1.0 / (fB + node[rows.FAR, 1, i])
        alpha_A, alpha_B = (node[rows.EXCESS, 0, i] + pA * alpha_A) * iA, (node[rows.EXCESS, 1, i] + pB * alpha_B) * iB
        gamma_A, gamma_B = fA * iA, fB * iB
        node[rows.ALPHA, 0, i], node[rows.ALPHA, 1, i] = alpha_A, alpha_B
        node[rows.BETA, 0, i], node[rows.BETA, 1, i] = node[rows.FAR, 0, i] * iA, node[rows.FAR, 1, i] * iB
    KA, KB = piece[rows.TANGENT, 0, n], piece[rows.TANGENT, 1, n]
    rotation = 0.0
    if free:
        rotation = (G + R * (KA * alpha_A - KB * alpha_B)) / (R * R * (KA * gamma_A + KB * gamma_B) + slope)
    dA, dB = R * rotation, -R * rotation
    slide[rows.STEP, 0, n + 1], slide[rows.STEP, 1, n + 1] = dA, dB
    for i in range(n - 1, -1, -1):
        dA = node[rows.ALPHA, 0, i] + node[rows.BETA, 0, i] * dA
        dB = node[rows.ALPHA, 1, i] + node[rows.BETA, 1, i] * dB
        slide[rows.STEP, 0, i + 1], slide[rows.STEP, 1, i + 1] = dA, dB
    return rotation


@kernel(error_model="numpy", fastmath=rows.FAST)
def solve_with_conduits(
    ph: Physics,
    piece: NDArray,
    node: NDArray,
    slide: NDArray,
    mean: NDArray,
    G: float,
    slope: float,
    R: float,
    free: bool,
) -> float:
    """The same with the cables' mean tensions unknown, for compliant conduits; their steps go into `MEAN_STEP`.

    Every slide is linear in the load end's slide and in the cable's mean tension. The conduit's equation gives the mean
    tension by the load end's slide, and the balance at the load pulley gives that slide.
    """
    n = node.shape[2]
    C = ph.conduit_compliance
    # Cables alternate, so that their divisions do not wait for each other.
    for i in range(n):
        for c in range(2):
            a, g, h = 0.0, 1.0, 0.0
            if i > 0:
                a, g, h = node[rows.ALPHA, c, i - 1], node[rows.GAMMA, c, i - 1], node[rows.ETA, c, i - 1]
            p, q = node[rows.NEAR, c, i], node[rows.FAR, c, i]
            f = p * g + node[rows.GIVES, c, i]
            inverse = 1.0 / (f + q)
            node[rows.ALPHA, c, i] = (node[rows.EXCESS, c, i] + p * a) * inverse
            node[rows.BETA, c, i] = q * inverse
            share = q * piece[rows.SHARE, c, i + 1] - p * piece[rows.SHARE, c, i]
            node[rows.ETA, c, i] = (C * share + p * h) * inverse
            node[rows.GAMMA, c, i] = f * inverse
    for c in range(2):
        a, g, h = node[rows.ALPHA, c, n - 1], node[rows.GAMMA, c, n - 1], node[rows.ETA, c, n - 1]
        # From the load end back: sums of share x K x (stretch of the piece) for the three terms.
        A, B, H = 0.0, 1.0, 0.0
        sum_A, sum_B, sum_H, stiff = 0.0, 0.0, 0.0, 0.0
        for i in range(n, -1, -1):
            if i > 0:
                A1 = node[rows.ALPHA, c, i - 1] + node[rows.BETA, c, i - 1] * A
                B1 = node[rows.BETA, c, i - 1] * B
                H1 = node[rows.ETA, c, i - 1] + node[rows.BETA, c, i - 1] * H
            else:
                A1, B1, H1 = 0.0, 0.0, 0.0
            weight = piece[rows.SHARE, c, i] * piece[rows.TANGENT, c, i]
            sum_A += weight * (A1 - A)
            sum_B += weight * (B1 - B)
            sum_H += weight * (H1 - H)
            stiff += weight * piece[rows.SHARE, c, i]
            A, B, H = A1, B1, H1
        scale = 1.0 / (1.0 + C * stiff - sum_H)
        mean[rows.FIXED, c], mean[rows.BY_END, c] = (mean[rows.MEAN_EXCESS, c] + sum_A) * scale, sum_B * scale
        K = piece[rows.TANGENT, c, n]
        own = h - C * piece[rows.SHARE, c, n]
        mean[rows.END_FIXED, c] = K * (a + own * mean[rows.FIXED, c])
        mean[rows.END_BY_END, c] = K * (-g + own * mean[rows.BY_END, c])
    rotation = 0.0
    if free:
        rotation = (G + R * (mean[rows.END_FIXED, 0] - mean[rows.END_FIXED, 1])) / (
            slope - R * R * (mean[rows.END_BY_END, 0] + mean[rows.END_BY_END, 1])
        )
    for c in range(2):
        d = R * rotation if c == 0 else -R * rotation
        mean[rows.MEAN_STEP, c] = mean[rows.FIXED, c] + mean[rows.BY_END, c] * d
        slide[rows.STEP, c, n + 1] = d
        for i in range(n - 1, -1, -1):
            d = node[rows.ALPHA, c, i] + node[rows.ETA, c, i] * mean[rows.MEAN_STEP, c] + node[rows.BETA, c, i] * d
            slide[rows.STEP, c, i + 1] = d
    return rotation


@kernel(error_model="numpy", forceinline=True)
def _move(ph: Physics, node: NDArray, slide: NDArray, share: float, bristle: float) -> None:
    """Add a share of Newton's step to the slides, but stop a node at the edge of sticking before it reverses.

    Between sliding in one direction and in the other lies the narrow range in which the node sticks. Newton's method
    would step over it for ever.
    """
    n = node.shape[2]
    inverse = 1.0 / bristle
    for c in range(2):
        for i in range(1, n + 1):
            old = slide[rows.NOW, c, i]
            new = old + share * slide[rows.STEP, c, i]
            if ph.presliding:
                if old * new < 0.0:
                    new = 0.0
            else:
                xi = node[rows.BRISTLE, c, i - 1]
                before, after = xi + old * inverse, xi + new * inverse
                if before > 1.0 and after < -1.0:
                    new = (EDGE - xi) * bristle
                elif before < -1.0 and after > 1.0:
                    new = (-EDGE - xi) * bristle
            slide[rows.NOW, c, i] = new


@small_kernel
def copy_slides(slide: NDArray, to: int, source: int) -> None:
    """Copy a row of slides to another; slicing takes several times as long for so few."""
    for c in range(2):
        for i in range(slide.shape[2]):
            slide[to, c, i] = slide[source, c, i]


@small_kernel
def copy_means(mean: NDArray, to: int, source: int) -> None:
    """Copy a row of mean tensions to another."""
    mean[to, 0], mean[to, 1] = mean[source, 0], mean[source, 1]


@kernel(error_model="numpy", forceinline=True)
def solve_step(
    ph: Physics,
    piece: NDArray,
    node: NDArray,
    slide: NDArray,
    mean: NDArray,
    load: NDArray,
    rotation: float,
    torque: float,
    dt: float,
    bristle: float,
) -> tuple[bool, float]:
    """Solve a step, starting from the slides in `NOW` and a rotation of the load; (converged, rotation of the load)."""
    free = ph.kind == rows.IMPEDANCE
    follows = set_memory(ph, piece, dt) if ph.has_relaxation else 0.0
    soft = ph.conduit_compliance > 0.0
    # With compliant conduits all nodes reverse at once, and full steps overshoot far.
    patience = 2 if soft and not ph.presliding else PATIENCE
    share, best, tolerance = 1.0, np.inf, TOLERANCE
    step_rotation, saved_rotation = 0.0, rotation
    for iteration in range(ITERATIONS + 1):
        if iteration == ITERATIONS:
            # A node or two may alternate between sliding and sticking; the two states then differ by next to nothing.
            copy_slides(slide, rows.NOW, rows.SAVED)
            copy_means(mean, rows.MEAN_NEXT, rows.MEAN_SAVED)
            rotation, tolerance = saved_rotation, LOOSE_TOLERANCE
        error, limit, G, slope, R = imbalance(
            ph, piece, node, slide, mean, load, rotation, torque, dt, bristle, follows
        )
        if error <= (tolerance * limit) ** 2:
            return True, rotation
        if iteration == ITERATIONS or not np.isfinite(error):
            break
        if iteration == patience and error > best:
            # Full steps do not converge: go back to the best point and accept only steps that reduce the error.
            copy_slides(slide, rows.NOW, rows.SAVED)
            copy_means(mean, rows.MEAN_NEXT, rows.MEAN_SAVED)
            rotation, best = saved_rotation, np.inf
            continue
        if iteration > patience and error > best and share > SMALLEST_SHARE:
            share *= 0.5
            copy_slides(slide, rows.NOW, rows.SAVED)
            copy_means(mean, rows.MEAN_NEXT, rows.MEAN_SAVED)
            rotation = saved_rotation
        else:
            if error < best or iteration > patience:
                best = error
                copy_slides(slide, rows.SAVED, rows.NOW)
                copy_means(mean, rows.MEAN_SAVED, rows.MEAN_NEXT)
                saved_rotation = rotation
            share = 1.0
            if soft:
                step_rotation = solve_with_conduits(ph, piece, node, slide, mean, G, slope, R, free)
            else:
                step_rotation = solve(piece, node, slide, G, slope, R, free)
        _move(ph, node, slide, share, bristle)
        rotation += share * step_rotation
        if soft:
            for c in range(2):
                mean[rows.MEAN_NEXT, c] += share * mean[rows.MEAN_STEP, c]
    return False, rotation
