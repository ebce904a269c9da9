//! Second derivatives of hinges as matrices.

use super::frame::WingBlocks;
use crate::lanes::Lanes;
use crate::vec3::{V, add, outer, put, put_transposed, scale, set_node};

/// `√k ∇θ`
#[inline(always)]
pub(super) fn stretched<S: Lanes>(k: S, theta: &[V<S>; 4]) -> [S; 12] {
    let root = k.sqrt();
    let mut v = [k; 12];
    for i in 0..4 {
        set_node(&mut v, i, scale(root, theta[i]));
    }
    v
}

/// Writes `Σ v vᵀ`.
#[inline(always)]
pub(super) fn write_squares<S: Lanes, const K: usize>(
    vectors: &[[S; 12]; K],
    h: &mut [[S; 12]; 12],
) {
    for i in 0..12 {
        let mut row = [S::splat(0.0); 12];
        for v in vectors {
            for j in 0..12 {
                row[j] = row[j] + v[i] * v[j];
            }
        }
        h[i] = row;
    }
}

/// Writes `k ∇θ ∇θᵀ` plus the wings' blocks.
#[inline(always)]
pub(super) fn write<S: Lanes>(
    k: S,
    theta: &[V<S>; 4],
    one: &WingBlocks<S>,
    two: &WingBlocks<S>,
    h: &mut [[S; 12]; 12],
) {
    let [_, g1, g2, g3] = *theta;
    let mut h11 = outer(scale(k, g1), g1);
    let mut h12 = outer(scale(k, g1), g2);
    let mut h13 = outer(scale(k, g1), g3);
    let mut h22 = outer(scale(k, g2), g2);
    let h23 = outer(scale(k, g2), g3);
    let mut h33 = outer(scale(k, g3), g3);
    for i in 0..3 {
        h11[i] = add(h11[i], add(one.b11[i], two.b11[i]));
        h12[i] = add(h12[i], one.b1o[i]);
        h13[i] = add(h13[i], two.b1o[i]);
        h22[i] = add(h22[i], one.boo[i]);
        h33[i] = add(h33[i], two.boo[i]);
    }
    // Symmetric to the last bit.
    for b in [&mut h11, &mut h22, &mut h33] {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            b[j][i] = b[i][j];
        }
    }
    let zero = [[S::splat(0.0); 3]; 3];
    // A translation does nothing: every block row sums to zero.
    let mut h01 = zero;
    let mut h02 = zero;
    let mut h03 = zero;
    for i in 0..3 {
        for j in 0..3 {
            h01[i][j] = -(h11[i][j] + h12[j][i] + h13[j][i]);
            h02[i][j] = -(h12[i][j] + h22[i][j] + h23[j][i]);
            h03[i][j] = -(h13[i][j] + h23[i][j] + h33[i][j]);
        }
    }
    let mut h00 = zero;
    for i in 0..3 {
        for j in 0..3 {
            let (a, b) = (
                h01[i][j] + h02[i][j] + h03[i][j],
                h01[j][i] + h02[j][i] + h03[j][i],
            );
            h00[i][j] = S::splat(-0.5) * (a + b);
        }
    }
    put(h, 0, 0, &h00);
    for (i, j, b) in [
        (0, 1, &h01),
        (0, 2, &h02),
        (0, 3, &h03),
        (1, 2, &h12),
        (1, 3, &h13),
        (2, 3, &h23),
    ] {
        put(h, i, j, b);
        put_transposed(h, j, i, b);
    }
    put(h, 1, 1, &h11);
    put(h, 2, 2, &h22);
    put(h, 3, 3, &h33);
}
