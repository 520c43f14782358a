//! `uw`: render underwater scenes, look at water as numbers, measure pictures, calibrate, predict.

use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_driver();
    uw_survey::cli::main()
}

/// Without a desktop, Mesa's layer that chooses among graphics devices writes to standard error, where errors are to be
/// read by programs. What it would choose is chosen by `--adapter`.
#[expect(
    unsafe_code,
    reason = "variables can be set safely while there is one thread"
)]
fn quiet_driver() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called first in `main`, before any other thread exists.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
