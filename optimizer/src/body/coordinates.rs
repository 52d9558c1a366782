//! Transformations between relative joint angles and absolute link angles: the constant matrix A and its transpose.

/// Number of generalised coordinates: two of the hip point and seven angles.
pub const COORDINATES: usize = 9;
/// Number of links and of absolute link angles.
pub const LINKS: usize = 7;
/// Number of actuated joints.
pub const JOINTS: usize = 6;

/// Link indices.
pub const TORSO: usize = 0;
/// First link (thigh) of the left leg; shank and foot follow.
pub const THIGH_L: usize = 1;
/// First link (thigh) of the right leg; shank and foot follow.
pub const THIGH_R: usize = 4;

/// Absolute link angles, rates or accelerations from relative ones: `A a`.
///
/// The input has the order (torso, hip_L, knee_L, ankle_L, hip_R, knee_R, ankle_R).
#[inline]
pub fn link_angles(a: &[f64; LINKS]) -> [f64; LINKS] {
    let torso = -a[0];
    let thigh_l = torso + a[1];
    let shank_l = thigh_l - a[2];
    let foot_l = shank_l + a[3];
    let thigh_r = torso + a[4];
    let shank_r = thigh_r - a[5];
    let foot_r = shank_r + a[6];
    [torso, thigh_l, shank_l, foot_l, thigh_r, shank_r, foot_r]
}

/// Generalised forces of the seven angles from those of the links: `A^T p`.
#[inline]
pub fn to_generalised(p: &[f64; LINKS]) -> [f64; LINKS] {
    let left_shank = p[2] + p[3];
    let left = p[1] + left_shank;
    let right_shank = p[5] + p[6];
    let right = p[4] + right_shank;
    [-(p[0] + left + right), left, -left_shank, p[3], right, -right_shank, p[6]]
}

/// `A^T H A` for a 7 x 7 matrix H in link space, symmetric or not.
#[inline]
pub fn congruence(h: &[[f64; LINKS]; LINKS]) -> [[f64; LINKS]; LINKS] {
    // First the rows of H from the right, (A^T H_row^T)^T, then the columns from the left.
    let mut right = [[0.0; LINKS]; LINKS];
    for i in 0..LINKS {
        right[i] = to_generalised(&h[i]);
    }
    transform_rows(&right)
}

/// `A^T X` for a matrix X with one row for each link.
#[inline]
pub fn transform_rows<const N: usize>(x: &[[f64; N]; LINKS]) -> [[f64; N]; LINKS] {
    let mut result = [[0.0; N]; LINKS];
    for c in 0..N {
        let column = to_generalised(&[x[0][c], x[1][c], x[2][c], x[3][c], x[4][c], x[5][c], x[6][c]]);
        for r in 0..LINKS {
            result[r][c] = column[r];
        }
    }
    result
}
