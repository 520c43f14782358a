//! Phase functions. (being written)
/// Placeholder
#[derive(Clone,Debug)] pub struct Phase;
