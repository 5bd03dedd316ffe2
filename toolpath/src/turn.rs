//! The turn of a setup as a quaternion of integers, as [`Setup::quaternion`](crate::Setup::quaternion) has it.

/// No entry of a quaternion is larger.
pub const LARGEST_ENTRY: u64 = 1 << 30;

/// The setup's x, y and z in model coordinates, by the quaternion (a, b, c, d) of the turn from the setup's axes to the
/// model's. Every component is one division of integers. `None` where all entries are 0 or one is beyond [`LARGEST_ENTRY`].
///
/// ```
/// let [x, ..] = claymill_toolpath::axes_of_quaternion([5, 0, -1, 1]).unwrap_or_default();
/// assert_eq!(x, [23.0 / 27.0, 10.0 / 27.0, 10.0 / 27.0]);
/// assert!(claymill_toolpath::axes_of_quaternion([0; 4]).is_none());
/// ```
#[must_use]
pub fn axes_of_quaternion(quaternion: [i64; 4]) -> Option<[[f64; 3]; 3]> {
    let [a, b, c, d] = quaternion.map(i128::from);
    let norm = a * a + b * b + c * c + d * d;
    if norm == 0 || quaternion.iter().any(|q| q.unsigned_abs() > LARGEST_ENTRY) {
        return None;
    }
    // Adding 0 last makes 0 of -0.
    let entry = |whole: i128| whole as f64 / norm as f64 + 0.0;
    let axes = [
        [a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)],
        [2 * (b * c - a * d), a * a - b * b + c * c - d * d, 2 * (c * d + a * b)],
        [2 * (b * d + a * c), 2 * (c * d - a * b), a * a - b * b - c * c + d * d],
    ];
    Some(axes.map(|axis| axis.map(entry)))
}
