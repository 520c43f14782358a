//! System tests: whole renders against closed forms and independent references.

mod reference_scenes;
