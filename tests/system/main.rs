//! System tests: whole renders against closed forms and independent references.

mod closed_form;
mod reference_scenes;
