//! Phase functions, their samplers and the colour channels against independent numbers.

mod bands;
mod constituents;
mod contract;
mod depth_profile;
mod fournier_forand;
mod models;
mod phase_table;
mod reference;
mod samplers;
mod statistics;
