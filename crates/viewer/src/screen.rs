//! The screen: what to do where there is none.

use std::ffi::OsString;
use std::path::Path;

/// Variables that lead to a screen on Linux and its kin.
const VARIABLES: [&str; 3] = ["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"];
/// The scene of the advice where none was asked for.
const A_SCENE: &str = "reef";

/// Whether nothing leads to a screen; `of` tells the value of a variable. Elsewhere than on Linux and its kin there are no
/// such variables.
pub fn is_missing(of: impl Fn(&str) -> Option<OsString>) -> bool {
    let named = |name: &&str| of(name).is_some_and(|value| !value.is_empty());
    cfg!(all(unix, not(target_os = "macos"))) && !VARIABLES.iter().any(named)
}

/// What to do without a screen.
pub fn advice(scene: Option<&Path>) -> String {
    let scene = scene.unwrap_or(A_SCENE.as_ref()).display();
    format!(
        "start it on a desktop (over a network: ssh -X), or on a virtual screen: xvfb-run viewer ...; \
         a picture without a window: uw render {scene} -o picture.png"
    )
}

/// There is no screen, and what to do.
pub fn missing(scene: Option<&Path>) -> String {
    format!(
        "there is no screen: neither DISPLAY nor WAYLAND_DISPLAY is set; {}",
        advice(scene)
    )
}

/// No window can be opened, why and what to do.
pub fn unusable(error: &eframe::Error, scene: Option<&Path>) -> String {
    let reason = without_place(&error.to_string());
    let screen = VARIABLES
        .iter()
        .filter_map(|name| {
            let value = std::env::var(name).ok()?;
            Some(format!("{name}={value}"))
        })
        .collect::<Vec<_>>();
    let on = if screen.is_empty() {
        String::new()
    } else {
        format!(" on {}", screen.join(", "))
    };
    format!("cannot open a window{on}: {reason}; {}", advice(scene))
}

/// A message without the place in a program's source that some errors name: `os error at FILE:LINE: reason`.
fn without_place(message: &str) -> String {
    let Some((before, rest)) = message.split_once("os error at ") else {
        return message.to_owned();
    };
    let reason = rest.split_once(".rs:").and_then(|(_, line)| {
        let reason = line.trim_start_matches(|c: char| c.is_ascii_digit());
        reason.strip_prefix(": ")
    });
    reason.map_or_else(|| message.to_owned(), |reason| format!("{before}{reason}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screen_is_missing_where_no_variable_has_a_value() {
        let with = |name: &'static str, value: &'static str| {
            is_missing(move |asked| (asked == name).then(|| value.into()))
        };
        assert!(!with("DISPLAY", ":0") && !with("WAYLAND_DISPLAY", "wayland-0"));
        if cfg!(target_os = "linux") {
            assert!(with("DISPLAY", "") && with("HOME", "/root"));
        }
    }

    #[test]
    fn messages_lose_the_place_in_the_source_and_keep_the_reason() {
        let built =
            "winit EventLoopError: os error at /home/me/winit-1/src/linux/mod.rs:765: no screen";
        assert_eq!(without_place(built), "winit EventLoopError: no screen");
        let plain = "WGPU error: no adapter";
        assert_eq!(without_place(plain), plain);
    }
}
