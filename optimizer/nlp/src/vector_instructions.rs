//! The vector instructions of the dense kernels.

use pulp::Arch;

/// The vector instructions that the dense kernels use on this machine: `AVX-512`, `AVX2`, `NEON`, or `none` beyond those
/// of every processor of the architecture.
pub fn vector_instructions() -> &'static str {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(_) => "AVX-512",
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) => "AVX2",
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(_) => "NEON",
        _ => "none",
    }
}
