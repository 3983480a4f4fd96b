//! Roots of functions of one variable.

/// The number in [0, `most`] at which `below` turns from true to false, up to neighbouring floating-point numbers.
///
/// Positive floating-point numbers are ordered as their bits are, so that halving the bits finds a root of any magnitude in
/// at most 63 turns, whatever the function.
pub fn turning_point(most: f64, below: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0, most.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if below(f64::from_bits(middle)) { low = middle } else { high = middle }
    }
    f64::from_bits(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_any_size_are_found_to_the_last_digits() {
        for root in [1e-30, 2e-7, 0.5, 3.0, 4e9] {
            let found = turning_point(1e12, |x| x * x * x < root * root * root);
            assert!((found - root).abs() <= 2.0 * f64::EPSILON * root, "{found:e} {root:e}");
        }
    }
}
