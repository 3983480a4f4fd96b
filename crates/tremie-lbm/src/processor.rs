//! Functions compiled for several processors.

/// Whether this processor has the parts of AVX-512 that all have which are not the first.
#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
#[inline(always)]
pub(crate) fn has_avx512() -> bool {
    use std::arch::is_x86_feature_detected as has;
    has!("avx512f") && has!("avx512vl") && has!("avx512dq") && has!("avx512bw")
}

/// Compiles a function again for processors with AVX2 and with AVX-512, and takes the form for the processor at hand. All give the same
/// bits: the same operations, only wider. Debug builds do without AVX-512, to be built sooner.
macro_rules! for_this_processor {
    ($(#[$doc:meta])* $seen:vis $name:ident = $plain:ident<$($g:ident: $bound:path),*>($($arg:ident: $type:ty),*)) => {
        $(#[$doc])*
        #[allow(unsafe_code)]
        $seen fn $name<$($g: $bound),*>($($arg: $type),*) {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                #[inline(never)]
                fn avx2<$($g: $bound),*>($($arg: $type),*) {
                    $plain($($arg),*);
                }
                #[cfg(not(debug_assertions))]
                #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
                #[inline(never)]
                fn avx512<$($g: $bound),*>($($arg: $type),*) {
                    $plain($($arg),*);
                }
                #[cfg(not(debug_assertions))]
                if $crate::processor::has_avx512() {
                    // SAFETY: the processor was just asked whether it has them.
                    return unsafe { avx512($($arg),*) };
                }
                if std::arch::is_x86_feature_detected!("avx2") {
                    // SAFETY: the processor was just asked whether it has AVX2.
                    return unsafe { avx2($($arg),*) };
                }
            }
            $plain($($arg),*);
        }
    };
}
pub(crate) use for_this_processor;
