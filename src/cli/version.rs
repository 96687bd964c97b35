//! What `--version` tells.

use std::sync::OnceLock;

use etendue::lanes::Kernel;

/// The version, the commit and the target that it was built of and for, and the instructions that it uses here.
pub(super) fn text() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        format!(
            "{}\ncommit {}\ntarget {}\nkernel {}",
            env!("CARGO_PKG_VERSION"),
            env!("ETENDUE_BUILT_OF"),
            env!("ETENDUE_TARGET"),
            Kernel::best().name()
        )
    })
}
