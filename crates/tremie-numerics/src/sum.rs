//! Parallel sums in a fixed order.
//!
//! Floating-point addition does not associate, and rayon splits work differently in every run. Here the work is
//! cut into chunks whose size does not depend on the number of threads; the partial results are then added
//! from the first to the last. The same data give the same bits on any number of threads.

use rayon::prelude::*;

/// Items in one chunk: a constant, because the result depends on it.
const CHUNK: usize = 64;

/// Sum of `term` over `items`, the same to the bit on any number of threads.
pub fn ordered_sum<I: Sync>(items: &[I], term: impl Fn(&I) -> f64 + Sync) -> f64 {
    let partial: Vec<f64> =
        items.par_chunks(CHUNK).map(|chunk| chunk.iter().map(&term).sum::<f64>()).collect();
    partial.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_bits_on_any_number_of_threads() {
        let items: Vec<f64> =
            (0..10_007).map(|i| (f64::from(i) * 0.731).sin() * 10f64.powi(i % 17)).collect();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| ordered_sum(&items, |x| *x)).to_bits()
        };
        assert_eq!(with(1), with(2));
        assert_eq!(with(1), with(5));
    }
}
