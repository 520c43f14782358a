//! Why the GPU cannot be used.

/// Why the GPU cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter, not even a program that stands in for one.
    #[error(
        "no graphics adapter found; install a driver, or the package {package} for one that runs on the CPU"
    )]
    NoAdapter {
        /// A package that brings one.
        package: &'static str,
    },
    /// No adapter has this name.
    #[error("no graphics adapter is called {got:?}; there are: {known}")]
    UnknownAdapter {
        /// The name asked for.
        got: String,
        /// The names there are.
        known: String,
    },
    /// The adapter gives no device.
    #[error("adapter {adapter}: {reason}")]
    Device {
        /// Name of the adapter.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// The scene or the picture does not fit.
    #[error("{what} needs {limit} = {needed}, the adapter has {available}")]
    Limit {
        /// What is too large.
        what: String,
        /// Name of the limit.
        limit: &'static str,
        /// What would be needed.
        needed: u64,
        /// What there is.
        available: u64,
    },
    /// A shader does not compose.
    #[error("shader {name}: {reason}")]
    Shader {
        /// Its path below `shaders/`.
        name: String,
        /// What the composer says.
        reason: String,
    },
    /// The device has run out of memory.
    #[error("the graphics adapter has run out of memory")]
    OutOfMemory,
    /// The device has refused a command.
    #[error("the graphics adapter refused a command: {reason}")]
    Refused {
        /// What it says.
        reason: String,
    },
    /// A kernel has lost samples: a fault of the driver or of the kernel, which would show as a dark picture.
    #[error("{kernel} made {made} of {wanted} samples of a batch on this graphics adapter")]
    LostSamples {
        /// The kernel.
        kernel: &'static str,
        /// Samples of all pixels that it says to have made.
        made: u64,
        /// Samples that it was to make.
        wanted: u64,
    },
    /// The device was lost.
    #[error("the graphics adapter was lost: {reason}")]
    Lost {
        /// What the driver says.
        reason: String,
    },
}

/// The package that brings a software adapter on Debian and Ubuntu.
const PACKAGE: &str = "mesa-vulkan-drivers";

impl GpuError {
    /// That there is no adapter, with the package that brings one.
    pub fn no_adapter() -> Self {
        Self::NoAdapter { package: PACKAGE }
    }
}
