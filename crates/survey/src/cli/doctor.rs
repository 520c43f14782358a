//! `uw doctor`: what this machine and this program are, for reports of faults.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs;
use std::io::{self, Write};

use serde_json::{Map, Value, json};
use uw_assets::{ALL, Found, Places};
use uw_render::backend::Instructions;
use uw_render::gpu::adapters;

use super::error::CliError;
use super::output;

/// Names of shipped files that a line tells before it only counts.
const NAMES_TOLD: usize = 3;

/// Tells all that is known, as text or with `json` as one object, and fails where something keeps commands from working.
pub(super) fn run(json: bool) -> Result<(), CliError> {
    let assets = Assets::look(&Places::of_process());
    let report = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "built_for": format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
        "checked": cfg!(debug_assertions),
        "program": std::env::current_exe().ok().map(|path| path.display().to_string()),
        "kernel": first_line("/proc/sys/kernel/osrelease"),
        "processor": processor(),
        "memory": memory(),
        "adapters": adapters(),
        "assets": assets.to_json(),
    });
    output::to_stdout(|out| match json {
        true => writeln!(out, "{report}"),
        false => write_text(out, &report, &assets),
    })?;
    match assets.problem {
        Some(problem) => Err(CliError::failed(problem)),
        None => Ok(()),
    }
}

/// The processor: its name where the system tells it, cores, and what the vector units render with.
fn processor() -> Value {
    let vectors = Instructions::best();
    json!({
        "name": field("/proc/cpuinfo", "model name"),
        "threads": std::thread::available_parallelism().map_or(1, usize::from),
        "vector_units": vectors.to_string(),
        "lanes": vectors.lanes(),
    })
}

/// Memory in bytes, in all and free for programs; empty where the system does not tell.
fn memory() -> Value {
    let mut memory = Map::new();
    for (name, line) in [
        ("total_bytes", "MemTotal"),
        ("available_bytes", "MemAvailable"),
    ] {
        let text = field("/proc/meminfo", line);
        let kibibytes = text
            .as_deref()
            .and_then(|t| t.split(' ').next()?.parse::<u64>().ok());
        if let Some(kibibytes) = kibibytes {
            memory.insert(name.to_owned(), (kibibytes << 10).into());
        }
    }
    memory.into()
}

/// The first value of a line `NAME : VALUE` in a file of the system.
fn field(file: &str, name: &str) -> Option<String> {
    let text = fs::read_to_string(file).ok()?;
    let values = text.lines().filter_map(|line| line.split_once(':'));
    let mut found = values.filter(|(field, _)| field.trim() == name);
    found.next().map(|(_, value)| value.trim().to_owned())
}

fn first_line(file: &str) -> Option<String> {
    let text = fs::read_to_string(file).ok()?;
    text.lines().next().map(str::to_owned)
}

/// Where the shipped files are.
struct Assets {
    places: Places,
    /// Names of files by the place that they come from.
    found: BTreeMap<String, Vec<&'static str>>,
    /// What keeps a file from being found.
    problem: Option<String>,
}

/// What the program itself is called as a place.
const PROGRAM: &str = "the program";

impl Assets {
    fn look(places: &Places) -> Self {
        let mut found: BTreeMap<String, Vec<&'static str>> = BTreeMap::new();
        let mut problem = None;
        for name in ALL.names() {
            let place = match ALL.find(name, places) {
                Ok(Found::File(_, place)) => place.to_string(),
                Ok(Found::Embedded(_)) => PROGRAM.to_owned(),
                Err(error) => {
                    problem.get_or_insert(error.to_string());
                    continue;
                }
            };
            found.entry(place).or_default().push(name);
        }
        Self {
            places: places.clone(),
            found,
            problem,
        }
    }

    fn to_json(&self) -> Value {
        let searched = |place: &uw_assets::Place| {
            json!({
                "folder": place.folder.display().to_string(),
                "because": place.origin.to_string(),
                "exists": place.folder.is_dir(),
            })
        };
        json!({
            "searched": self.places.folders.iter().map(searched).collect::<Vec<_>>(),
            "files": self.found,
            "problem": self.problem,
        })
    }
}

fn write_text(out: &mut dyn Write, report: &Value, assets: &Assets) -> io::Result<()> {
    let text = |value: &Value| value.as_str().unwrap_or("unknown").to_owned();
    let checks = match report["checked"].as_bool() {
        Some(true) => ", with overflow checks",
        _ => "",
    };
    let built_for = text(&report["built_for"]);
    line(
        out,
        "uw",
        format_args!("{} for {built_for}{checks}", text(&report["version"])),
    )?;
    line(out, "program", text(&report["program"]))?;
    line(out, "kernel", text(&report["kernel"]))?;
    let processor = &report["processor"];
    line(
        out,
        "processor",
        format_args!(
            "{}, {} threads",
            text(&processor["name"]),
            processor["threads"]
        ),
    )?;
    line(
        out,
        "vector units",
        format_args!(
            "{}, {} lanes",
            text(&processor["vector_units"]),
            processor["lanes"]
        ),
    )?;
    if let [Some(total), Some(free)] =
        ["total_bytes", "available_bytes"].map(|name| report["memory"][name].as_u64())
    {
        let [total, free] = [total, free].map(|bytes| bytes as f64 / f64::from(1 << 30));
        line(
            out,
            "memory",
            format_args!("{total:.1} GiB, {free:.1} GiB available"),
        )?;
    }
    write_adapters(out, &report["adapters"])?;
    for (place, names) in &assets.found {
        let told = names[..names.len().min(NAMES_TOLD)].join(", ");
        let more = if names.len() > NAMES_TOLD { ", .." } else { "" };
        line(
            out,
            "shipped files",
            format_args!("{} from {place}: {told}{more}", names.len()),
        )?;
    }
    for place in &assets.places.folders {
        let is = if place.folder.is_dir() {
            "there"
        } else {
            "not there"
        };
        line(out, "searched", format_args!("{place}: {is}"))?;
    }
    Ok(())
}

fn write_adapters(out: &mut dyn Write, adapters: &Value) -> io::Result<()> {
    let adapters = adapters.as_array().map_or(&[][..], Vec::as_slice);
    if adapters.is_empty() {
        return line(out, "adapter", "none; renders go to the processor");
    }
    for adapter in adapters {
        let of = |name: &str| adapter[name].as_str().unwrap_or("unknown");
        let told = format_args!(
            "{} ({}, {}, {})",
            of("name"),
            of("kind"),
            of("backend"),
            of("driver")
        );
        line(out, "adapter", told)?;
    }
    Ok(())
}

fn line(out: &mut dyn Write, name: &str, value: impl Display) -> io::Result<()> {
    writeln!(out, "{name:<14}{value}")
}
