//! What little geometry the cluster tree needs. Plain arithmetic, so that every platform finds the same order.

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn squared(a: [f64; 3]) -> f64 {
    dot(a, a)
}

pub(super) fn unit(v: [f64; 3]) -> Option<([f64; 3], f64)> {
    let length = squared(v).sqrt();
    (length > 0.0).then(|| (v.map(|x| x / length), length))
}

/// Interleaved bits, 21 of each coordinate.
pub(super) fn morton(at: [i32; 3]) -> u64 {
    let spread = |x: i32| (0..21).fold(0u64, |key, bit| key | u64::from(x as u32 >> bit & 1) << (3 * bit));
    spread(at[0]) | spread(at[1]) << 1 | spread(at[2]) << 2
}
