//! How fast memory can be read, changed and written in place: no method in place can be faster.

use std::time::Instant;

use rayon::prelude::*;

/// Numbers in the array: 512 MiB, many times any cache.
const NUMBERS: usize = 128 << 20;
/// Passes; the fastest counts, since this is to be a limit.
const PASSES: usize = 12;

/// Bytes read and written per second by all threads together.
pub(super) fn measure() -> f64 {
    let mut array = vec![0.0f32; NUMBERS];
    let share = NUMBERS.div_ceil(rayon::current_num_threads());
    let fastest = (0..PASSES).map(|_| pass(&mut array, share)).fold(f64::INFINITY, f64::min);
    std::hint::black_box(&array);
    2.0 * size_of_val(array.as_slice()) as f64 / fastest
}

/// Changes every number once, `share` of them in a thread, and gives the seconds it took.
fn pass(array: &mut [f32], share: usize) -> f64 {
    let start = Instant::now();
    array.par_chunks_mut(share).for_each(|part| {
        for number in part {
            *number = 0.5 * *number + 1.0;
        }
    });
    start.elapsed().as_secs_f64()
}
