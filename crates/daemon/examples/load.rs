//! Load on a running daemon, from a process of its own: latency, throughput, lost and reordered replies.
//!
//! ```sh
//! printf 'format = "uwguide-config/1"\n[checks]\ntraining = "warn"\nmisfit = "warn"\n' > load.toml
//! uwguide --model assets/models/default.json --profile PROFILE.json --config load.toml &
//! cargo run --release -p uw-daemon --example load -- --seconds 60 --pid $!
//! cargo run --release -p uw-daemon --example load -- --seconds 60 --rate 4000
//! ```
//!
//! The questions are of no real picture, so that a daemon with its defaults would refuse to advise.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;

/// Puts load on a running daemon and measures how it answers.
#[derive(Clone, Debug, Parser)]
struct Arguments {
    /// Address of the daemon.
    #[arg(long, default_value = "127.0.0.1:7475")]
    address: String,
    /// Connections at one time.
    #[arg(long, default_value_t = 64)]
    connections: u32,
    /// How long, s.
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Suggestions per second in all; without it each connection asks again as soon as it is answered.
    #[arg(long)]
    rate: Option<f64>,
    /// Ends after this many requests in all.
    #[arg(long)]
    requests: Option<u64>,
    /// Process of the daemon, whose memory is told before and after.
    #[arg(long)]
    pid: Option<u32>,
}

/// What one connection saw.
#[derive(Default)]
struct Seen {
    /// From when a question was due to its answer, µs.
    latency_us: Vec<u32>,
    lost: u64,
    reordered: u64,
    invalid: u64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let before_kb = memory_kb(arguments.pid);
    let started = Instant::now();
    let threads: Vec<_> = (0..arguments.connections)
        .map(|number| {
            let arguments = arguments.clone();
            thread::spawn(move || ask(&arguments, number).map_err(|error| error.to_string()))
        })
        .collect();
    let mut all = Seen::default();
    for thread in threads {
        let seen = thread.join().map_err(|_| "a connection panicked")??;
        all.latency_us.extend(seen.latency_us);
        all.lost += seen.lost;
        all.reordered += seen.reordered;
        all.invalid += seen.invalid;
    }
    let elapsed_s = started.elapsed().as_secs_f64();
    report(&arguments, all, elapsed_s)?;
    if let (Some(before), Some(after)) = (before_kb, memory_kb(arguments.pid)) {
        writeln!(
            std::io::stdout(),
            "memory: {before} kB before, {after} kB after"
        )?;
    }
    Ok(())
}

fn ask(arguments: &Arguments, number: u32) -> Result<Seen, Box<dyn Error>> {
    let mut stream = TcpStream::connect(&arguments.address)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(Duration::from_secs(10)))?;
    let mut reader = BufReader::new(stream.try_clone()?);
    let connections = f64::from(arguments.connections);
    let period = arguments
        .rate
        .map(|rate| Duration::from_secs_f64(connections / rate));
    // Connections take turns.
    let first = period
        .unwrap_or_default()
        .mul_f64(f64::from(number) / connections);
    let start = Instant::now();
    let most = arguments
        .requests
        .map_or(u64::MAX, |all| all / u64::from(arguments.connections));
    let (mut seen, mut reply) = (Seen::default(), String::new());
    let mut id = 0;
    while start.elapsed().as_secs_f64() < arguments.seconds && id < most {
        let due = match period {
            None => Instant::now(),
            Some(period) => start + first + period.mul_f64(id as f64),
        };
        thread::sleep(due.saturating_duration_since(Instant::now()));
        let phase = (id as f64 * 0.37 + f64::from(number)).sin();
        let (depth_m, distance_m) = (2.0 + phase, 1.5 - 0.8 * phase);
        let line = format!(
            "{{\"op\": \"suggest\", \"id\": {id}, \"depth_m\": {depth_m}, \"distance_m\": {distance_m}, \
             \"light_pct\": {}, \"mean\": [41.0, 88.0, 79.0], \"std\": [4.1, 7.7, 6.2]}}\n",
            50.0 + 40.0 * phase
        );
        stream.write_all(line.as_bytes())?;
        reply.clear();
        if reader.read_line(&mut reply)? == 0 {
            seen.lost += 1;
            break;
        }
        let latency_us = due.elapsed().as_micros();
        seen.latency_us
            .push(u32::try_from(latency_us).unwrap_or(u32::MAX));
        seen.reordered += u64::from(!reply.contains(&format!("\"id\":{id},")));
        seen.invalid += u64::from(!reply.contains("\"valid\":true"));
        id += 1;
    }
    Ok(seen)
}

fn report(arguments: &Arguments, mut all: Seen, elapsed_s: f64) -> std::io::Result<()> {
    all.latency_us.sort_unstable();
    let count = all.latency_us.len();
    let at = |share: f64| {
        let index = ((count as f64 * share) as usize).min(count.saturating_sub(1));
        f64::from(all.latency_us.get(index).copied().unwrap_or(0)) / 1000.0
    };
    writeln!(
        std::io::stdout(),
        "{} connections, {elapsed_s:.1} s: {count} replies, {:.0} a second; \
         p50 {:.3} ms, p99 {:.3} ms, p99.9 {:.3} ms, longest {:.3} ms; \
         {} lost, {} reordered, {} invalid",
        arguments.connections,
        count as f64 / elapsed_s,
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0),
        all.lost,
        all.reordered,
        all.invalid
    )
}

/// Resident memory of a process, kB, where the system tells.
fn memory_kb(pid: Option<u32>) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", pid?)).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}
