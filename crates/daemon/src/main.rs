//! `uwguide`: guidance as a service.

use std::error::Error;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use tokio::sync::watch;
use tokio::task::JoinSet;
use uw_daemon::config::{DEFAULT_CONFIG, PredictorKind};
use uw_daemon::links::{Feeder, dvl, mavlink, ros2, rosbridge};
use uw_daemon::tls::acceptor;
use uw_daemon::{Config, log};
use uw_guidance::daemon::{Address, Encryption, Limits, ListenError};
use uw_guidance::operations::http::{Answers, HealthPort};
use uw_guidance::record::Recorder;
use uw_guidance::replay::replay;
use uw_guidance::service::{LoadError, Loaded};
use uw_guidance::{Daemon, Service};

#[cfg(unix)]
use uw_guidance::operations::{reload::Reloader, supervisor};

/// Suggests distance and lamp level to a vehicle, over newline-delimited JSON.
#[derive(Debug, Parser)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Subcommands>,
    #[command(flatten)]
    serve: Serve,
    /// Folder of the shipped files, from which alone they are then taken.
    #[arg(long, global = true, value_name = "DIR")]
    assets: Option<PathBuf>,
    /// Print a configuration file with all defaults and end.
    #[arg(long)]
    print_default_config: bool,
}

#[derive(Debug, Subcommand)]
enum Subcommands {
    /// Answer a recorded session again and compare bit for bit.
    Replay(Replay),
    /// Write the completions of a shell to standard output.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Write the manual page to standard output.
    Man,
}

#[derive(Debug, Args)]
struct Serve {
    /// Model file (uw-mlp, version 1) or the name of a shipped one: contrast by a network. Default: `default`, where no water file
    /// is given and the configuration says nothing else.
    #[arg(long, value_name = "NAME|FILE")]
    model: Option<PathBuf>,
    /// Water file (uw-water/1): contrast by physics, from pictures. Beside a model, the configuration's `predictor` says which.
    #[arg(long)]
    water: Option<PathBuf>,
    /// The vehicle (uw-vehicle/1), or the name of a shipped one: its camera's noise and encoding, and what model, water file and profile
    /// have to be made for.
    #[arg(long, value_name = "NAME|FILE")]
    vehicle: Option<String>,
    /// Calibration profile (uw-profile/1): a file, or the name of a shipped one, as in 1C, to try the daemon with.
    #[arg(long, value_name = "NAME|FILE", required_unless_present_any = ["no_profile", "print_default_config"])]
    profile: Option<PathBuf>,
    /// Start without a profile: clients bring their own.
    #[arg(long, conflicts_with = "profile")]
    no_profile: bool,
    /// Address to listen on, HOST:PORT or unix:PATH; port 0 takes a free one. May be given several times.
    /// By default 127.0.0.1:7475, or what the service manager hands over.
    #[arg(long)]
    listen: Vec<Address>,
    /// Serve one client on standard input and output instead of sockets.
    #[arg(long, conflicts_with = "listen")]
    stdio: bool,
    /// Configuration file (TOML).
    #[arg(long)]
    config: Option<PathBuf>,
    /// Record requests and replies in this file, for `uwguide replay`: MCAP where its name ends in .mcap, else JSON. Instead of
    /// `operations.record` of the configuration.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Speak ROS 2: range, depth and pictures come as messages, suggestions go out as ones. Topics: `[ros2]` of the configuration.
    #[arg(long)]
    ros2: bool,
    /// Check arguments, configuration, model, profile, token and certificates, and end.
    #[arg(long)]
    check_config: bool,
}

#[derive(Debug, Args)]
struct Replay {
    /// The recording (--record or operations.record), JSON or MCAP.
    log: PathBuf,
    /// The model that was used, NAME|FILE; as `uwguide` itself, the shipped one where neither this nor a water file is given.
    #[arg(long, conflicts_with = "water", value_name = "NAME|FILE")]
    model: Option<PathBuf>,
    /// The water file that was used.
    #[arg(long)]
    water: Option<PathBuf>,
    /// The vehicle that was used.
    #[arg(long, value_name = "NAME|FILE")]
    vehicle: Option<String>,
    /// The configuration file that was used.
    #[arg(long)]
    config: Option<PathBuf>,
}

/// Where it listens when nothing else is said.
const DEFAULT_LISTEN: &str = "127.0.0.1:7475";
/// What `uwguide` alone says.
const WELCOME: &str = "\
uwguide suggests distance and lamp level to a vehicle, over newline-delimited JSON. To begin:

  uwguide --profile 1C                        the shipped model and a shipped profile, on 127.0.0.1:7475, to try it
  uwguide --profile MINE.json                 the profile of one's own water, made by uw calibrate
  uwguide --print-default-config > C.toml     all settings, explained; then --config C.toml
  uwguide --profile MINE.json --check-config  whether all that is named can be used

All options: uwguide --help.";
/// Connections with numbers above this are links, in recordings.
const LINKS: u64 = 1 << 62;
/// Unusable arguments or input.
const BAD_INPUT: u8 = 2;
/// A failure while running.
const FAILED: u8 = 1;

/// A failure and the exit code it means.
struct Failure(u8, Box<dyn Error>);

impl<E: Into<Box<dyn Error>>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(FAILED, error.into())
    }
}

fn bad_input(error: impl Into<Box<dyn Error>>) -> Failure {
    Failure(BAD_INPUT, error.into())
}

fn main() -> ExitCode {
    if std::env::args_os().len() == 1 {
        tell(WELCOME);
        return ExitCode::from(BAD_INPUT);
    }
    let arguments = Arguments::parse();
    let folder = arguments.assets.as_deref();
    if let Err(error) = folder.map_or(Ok(()), uw_assets::take_from) {
        tell(&format!("uwguide: {error}"));
        return ExitCode::from(BAD_INPUT);
    }
    let done = match arguments.command {
        _ if arguments.print_default_config => print(DEFAULT_CONFIG),
        Some(Subcommands::Replay(arguments)) => answer_again(&arguments),
        Some(Subcommands::Completions { shell }) => completions(shell),
        Some(Subcommands::Man) => manual_page(),
        None => start(arguments.serve),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure(code, error)) => {
            tell(&format!("uwguide: {error}"));
            ExitCode::from(code)
        }
    }
}

/// A line on standard error; a reader that is gone is no reason to end.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

fn print(text: &str) -> Result<(), Failure> {
    Ok(std::io::stdout().write_all(text.as_bytes())?)
}

fn completions(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "uwguide", &mut script);
    Ok(std::io::stdout().write_all(&script)?)
}

fn manual_page() -> Result<(), Failure> {
    let mut page = Vec::new();
    clap_mangen::Man::new(Arguments::command()).render(&mut page)?;
    Ok(std::io::stdout().write_all(&page)?)
}

fn read_config(path: Option<&PathBuf>, vehicle: Option<&String>) -> Result<Config, Failure> {
    let mut config = match path {
        Some(path) => Config::read(path).map_err(bad_input)?,
        None => Config::default(),
    };
    config.read_token().map_err(bad_input)?;
    config.vehicle = vehicle.cloned().or(config.vehicle);
    config.read_vehicle().map_err(bad_input)?;
    config.read_photographs().map_err(bad_input)?;
    Ok(config)
}

fn answer_again(arguments: &Replay) -> Result<(), Failure> {
    let mut config = read_config(arguments.config.as_ref(), arguments.vehicle.as_ref())?;
    let files = files(
        (arguments.model.clone(), arguments.water.clone()),
        None,
        &mut config,
    )?;
    let Loaded {
        basis,
        model_digest: digest,
        ..
    } = files.load().map_err(bad_input)?;
    let name = arguments.log.display();
    let bytes = std::fs::read(&arguments.log)
        .map_err(|error| bad_input(format!("{name}: cannot be read: {error}")))?;
    let outcome = replay(&bytes, &basis, &digest, &config.settings)
        .map_err(|error| bad_input(format!("{name}: {error}")))?;
    for (place, problem) in &outcome.torn {
        tell(&format!("{name}: {place} is torn and left out: {problem}"));
    }
    for (place, recorded, new) in &outcome.different {
        print(&format!("{place}\n- {recorded}\n+ {new}\n"))?;
    }
    let different = outcome.different.len();
    let torn = match outcome.torn.len() {
        0 => String::new(),
        count => format!(", {count} torn"),
    };
    print(&format!(
        "{} replies the same, {different} different, {} not compared{torn}\n",
        outcome.same, outcome.skipped
    ))?;
    match different {
        0 => Ok(()),
        _ => Err(format!("{different} replies differ from the recording").into()),
    }
}

/// All that is read before the daemon starts.
struct Ready {
    serve: Serve,
    files: Files,
    config: Config,
    loaded: Loaded,
    tls: Option<Arc<dyn Encryption>>,
}

fn start(serve: Serve) -> Result<(), Failure> {
    let mut config = read_config(serve.config.as_ref(), serve.vehicle.as_ref())?;
    config.record = serve.record.clone().or(config.record);
    config.ros2.enabled |= serve.ros2;
    let files = files(
        (serve.model.clone(), serve.water.clone()),
        serve.profile.clone(),
        &mut config,
    )?;
    let loaded = files.load().map_err(bad_input)?;
    let tls = match &config.tls {
        Some(files) => Some(acceptor(files).map_err(bad_input)?),
        None => None,
    };
    if serve.check_config {
        for warning in config
            .exposures()
            .into_iter()
            .chain(loaded.warnings(None, &config.settings.vehicle))
            .chain(loaded.objective_warning(&config.settings.objective))
        {
            tell(&format!("uwguide: warning: {warning}"));
        }
        return print("the configuration is usable\n");
    }
    let log_file = config.log.file.clone().unwrap_or_default();
    let _logs = log::begin(&config.log, config.group_may_read)
        .map_err(|error| bad_input(format!("{}: {error}", log_file.display())))?;
    for warning in config.exposures() {
        tracing::warn!("{warning}");
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    let done = runtime.block_on(run(Ready {
        serve,
        files,
        config,
        loaded,
        tls,
    }));
    // Files and streams that never answer keep nobody waiting.
    runtime.shutdown_background();
    done
}

/// Model or water file, and profile, as they are read and read again.
struct Files {
    kind: PredictorKind,
    file: PathBuf,
    profile: Option<PathBuf>,
}

impl Files {
    fn load(&self) -> Result<Loaded, LoadError> {
        let profile = self.profile.as_deref();
        match self.kind {
            PredictorKind::Network => Loaded::read(&self.file, profile),
            PredictorKind::Physics => Loaded::read_water(&self.file, profile),
        }
    }
}

/// Which files are read: of those given, what the configuration says, else the water file. Where there is a choice, replies say which.
fn files(
    (model, water): (Option<PathBuf>, Option<PathBuf>),
    profile: Option<PathBuf>,
    config: &mut Config,
) -> Result<Files, Failure> {
    let model = shipped(model, "--model", "models")?;
    let profile = shipped(profile, "--profile", "profiles")?;
    let water = water.or_else(|| config.water.clone());
    let model = match (model, &water, config.predictor) {
        (None, None, None) => Some(uw_assets::DEFAULT_MODEL.into()),
        (model, ..) => model,
    };
    config.settings.tell_predictor = config.predictor.is_some() || water.is_some();
    let kind = config.predictor.unwrap_or(match water {
        Some(_) => PredictorKind::Physics,
        None => PredictorKind::Network,
    });
    let (file, missing) = match kind {
        PredictorKind::Network => (model, "a network needs its model: --model FILE"),
        PredictorKind::Physics => (water, "physics needs a water file: --water FILE"),
    };
    Ok(Files {
        kind,
        file: file.ok_or_else(|| bad_input(missing))?,
        profile,
    })
}

/// The file that an option means: one of the system, or by its name a shipped one of `folder`.
fn shipped(given: Option<PathBuf>, option: &str, folder: &str) -> Result<Option<PathBuf>, Failure> {
    let path = given.map(|given| uw_assets::SMALL.named(&given, folder, "json"));
    path.transpose()
        .map_err(|error| bad_input(format!("{option}: {error}")))
}

async fn run(ready: Ready) -> Result<(), Failure> {
    let Ready {
        serve,
        files,
        config,
        loaded,
        tls,
    } = ready;
    let (settings, limits): (_, Limits) = (config.settings.clone(), config.limits);
    let service = Arc::new(Service::with_settings(loaded, settings));
    let mut daemon = Daemon::new(Arc::clone(&service), limits);
    if let (Some(tls), Some(files)) = (tls, &config.tls) {
        daemon = daemon.with_tls(tls, files.client_ca.is_some());
    }
    let mut recorder = None;
    let mut _recording = None;
    if let Some(path) = &config.record {
        let (begun, recording) = Recorder::begin(path, config.group_may_read, Arc::clone(&service))
            .map_err(|error| bad_input(format!("{}: {error}", path.display())))?;
        tracing::info!(file = %recording.path().display(), "recording");
        daemon = daemon.with_recorder(begun.clone());
        (recorder, _recording) = (Some(begun), Some(recording));
    }
    if !serve.stdio {
        listen(&mut daemon, &serve.listen).await?;
    }
    if config.settings.token.is_some() {
        for address in daemon.unencrypted() {
            tracing::warn!(
                "token and requests travel without TLS on {address}, where others can hear them; \
                 configure [tls]"
            );
        }
    }
    let (stop, stopping) = watch::channel(false);
    let mut tasks = JoinSet::new();
    if let Some(address) = &config.metrics {
        let port = HealthPort::bind(address).await.map_err(|error| {
            format!("cannot serve metrics (operations.metrics) on {address}: {error}")
        })?;
        tell(&format!("uwguide metrics on {}", port.local_addr()?));
        let answers = Answers::new(Arc::clone(&service), &config.metrics_hosts, stopping);
        tasks.spawn(port.run(answers));
    }
    start_links(&config, &service, recorder.as_ref(), &mut tasks)?;
    let interrupted = interruption()?;
    #[cfg(unix)]
    {
        tasks.spawn(reload_on_hangup(files, Arc::clone(&service), recorder)?);
        let alive = Arc::clone(&service);
        tasks.spawn(async move { supervisor::watchdog(|| alive.now().unix_s >= 0.0).await });
        supervisor::ready("answering");
    }
    #[cfg(not(unix))]
    drop((files, recorder));
    let shutdown = async move {
        interrupted.await;
        tracing::info!("shutting down");
        stop.send_replace(true);
        #[cfg(unix)]
        supervisor::stopping();
    };
    if serve.stdio {
        daemon
            .serve_streams(tokio::io::stdin(), tokio::io::stdout(), shutdown)
            .await;
    } else {
        tell(&format!(
            "uwguide listening on {}",
            daemon.addresses().join(", ")
        ));
        daemon.run(shutdown).await;
    }
    tasks.shutdown().await;
    Ok(())
}

/// Connects to what the configuration names.
fn start_links(
    config: &Config,
    service: &Arc<Service>,
    recorder: Option<&Recorder>,
    tasks: &mut JoinSet<()>,
) -> Result<(), Failure> {
    // Numbers that no client's connection reaches.
    let feeder = |link: u64| Feeder::new(Arc::clone(service), recorder.cloned(), LINKS + link);
    if let Some(config) = config.dvl.clone() {
        tasks.spawn(dvl::run(config, feeder(1)));
    }
    if let Some(config) = config.mavlink.clone() {
        tasks.spawn(mavlink::run(config, feeder(2)));
    }
    if let Some(config) = config.rosbridge.clone() {
        tasks.spawn(rosbridge::run(config, feeder(3)));
    }
    if config.ros2.enabled {
        let link = ros2::Link::open(&config.ros2).map_err(bad_input)?;
        tasks.spawn(link.run(feeder(4)));
    }
    Ok(())
}

async fn listen(daemon: &mut Daemon, addresses: &[Address]) -> Result<(), Failure> {
    let handed = daemon.listen_activated().map_err(listen_failure)?;
    let default: Vec<Address> = match (addresses.is_empty(), handed) {
        (true, 0) => vec![DEFAULT_LISTEN.parse::<Address>()?],
        _ => Vec::new(),
    };
    for address in addresses.iter().chain(&default) {
        daemon.listen(address).await.map_err(listen_failure)?;
    }
    Ok(())
}

/// An address that would be open to strangers is a fault of the configuration.
fn listen_failure(error: ListenError) -> Failure {
    match error {
        unguarded @ ListenError::Unguarded { .. } => bad_input(unguarded),
        other => Failure::from(other),
    }
}

/// Reads model and profile again on SIGHUP.
#[cfg(unix)]
fn reload_on_hangup(
    files: Files,
    service: Arc<Service>,
    recorder: Option<Recorder>,
) -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut hangup = signal(SignalKind::hangup())?;
    let reloader = Reloader::new(move || files.load().map_err(|error| error.to_string()));
    Ok(async move {
        while hangup.recv().await.is_some() {
            supervisor::reloading();
            reloader.reload(&service, recorder.as_ref()).await;
            supervisor::ready("answering");
        }
    })
}

/// Done when the process is asked to end: Ctrl-C, and SIGTERM where there is one.
#[cfg(unix)]
fn interruption() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
    })
}

/// Done when the process is asked to end: Ctrl-C.
#[cfg(not(unix))]
fn interruption() -> std::io::Result<impl Future<Output = ()>> {
    Ok(async {
        // Without a handler the default ends the process, which serves as well.
        let _ = tokio::signal::ctrl_c().await;
    })
}
