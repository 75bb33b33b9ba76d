//! `belvedere serve`: hand out what is published until told to stop.

use std::{
    io::IsTerminal,
    net::SocketAddr,
    path::{Path, PathBuf},
};

use anyhow::Context;
use tokio::net::{TcpListener, TcpSocket};
use tokio_util::sync::CancellationToken;
use tracing_subscriber::{
    Layer,
    filter::{LevelFilter, Targets},
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

use crate::{
    config::{Config, LogFormat, Settings},
    dashboard::{self, Screen},
    http::{
        AppState, Metrics, MissingObjects, OnLine, Pace, PagePolicy, Readiness, RequestLimits,
        accept::{ConnectionLimits, serve_connections},
        front::Front,
        metrics_text,
        tls::Tls,
    },
    jobs::Jobs,
    keys::Keys,
    live::{Live, Recorder, Sources, nodes::Nodes},
    open_files,
    published::Publications,
    traces::Traces,
};

/// Serves published scenes over HTTP.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ServeArgs {
    /// TOML file with the same settings; flags and environment go before it
    #[arg(long, value_name = "FILE", env = "BELVEDERE_CONFIG")]
    pub config: Option<PathBuf>,
    /// Say what the settings come to, and whether they can work, and serve nothing
    #[arg(long)]
    pub check_config: bool,
    /// Show no figures below the log; they are only shown in a terminal anyway
    #[arg(long)]
    pub no_dashboard: bool,
    /// Everything that can be set.
    #[command(flatten)]
    pub settings: Settings,
}

impl ServeArgs {
    /// Reads the file, if there is one, and checks the whole.
    ///
    /// # Errors
    /// When the file or a setting cannot be used.
    pub fn into_config(self) -> anyhow::Result<Config> {
        let settings = match &self.config {
            Some(file) => self.settings.or(Settings::from_file(file)?),
            None => self.settings,
        };
        Ok(Config::try_from(settings)?)
    }
}

/// Runs the command until SIGINT or SIGTERM.
///
/// # Errors
/// When a setting cannot be used, or the server cannot start.
pub async fn run(args: ServeArgs) -> anyhow::Result<()> {
    run_at(args, "").await
}

/// The same; the address that is printed leads to this page.
pub(super) async fn run_at(args: ServeArgs, page: &str) -> anyhow::Result<()> {
    let check = args.check_config;
    // Below the log where that is in the terminal too; a log that is sent elsewhere leaves it alone.
    let screen =
        (!args.no_dashboard && std::io::stdout().is_terminal()).then(|| Screen::new(std::io::stderr().is_terminal()));
    let file = args.config.clone();
    let config = args.into_config()?;
    if check {
        super::tell_strange_variables();
        return super::check::check(&config, file.as_deref()).await;
    }
    start_log(&config, screen.clone().unwrap_or_default())?;
    for stranger in super::strange_variables() {
        tracing::warn!("{stranger}");
    }
    let stopping = CancellationToken::new();
    stop_on_signals(stopping.clone())?;
    let page = page.to_owned();
    let scheme = if config.tls.is_some() { "https" } else { "http" };
    serve_and_show(config, stopping, screen, move |address| {
        // Whoever started it may read the address from here; the log goes to standard error.
        let _closed = super::output::print(&format!("open {scheme}://{address}/{page}"));
    })
    .await
}

/// Serves until `shutdown`; `on_listen` hears the address once connections are taken.
///
/// # Errors
/// When catalogue, store or certificate cannot be opened, or the address cannot be listened on.
pub async fn serve(
    config: Config,
    shutdown: CancellationToken,
    on_listen: impl FnOnce(SocketAddr),
) -> anyhow::Result<()> {
    serve_and_show(config, shutdown, None, on_listen).await
}

/// The same, with figures in the terminal.
async fn serve_and_show(
    config: Config,
    shutdown: CancellationToken,
    screen: Option<Screen>,
    on_listen: impl FnOnce(SocketAddr),
) -> anyhow::Result<()> {
    let opening = async {
        let catalogue = config.place.open_catalogue().await?;
        let blobs = config.place.open_store(config.cache_bytes).await?;
        let followed = Publications::follow(catalogue.clone(), blobs.clone(), config.poll, shutdown.clone());
        anyhow::Ok((catalogue, blobs, followed.await?))
    };
    // Whoever says that it shall end does not wait for what does not answer.
    let Some(opened) = shutdown.run_until_cancelled(opening).await else {
        return Ok(());
    };
    let (catalogue, blobs, publications) = opened?;
    let tls = config
        .tls
        .map(|files| Tls::follow(files, shutdown.clone()))
        .transpose()?;
    let nothing_yet = publications.current().scenes.is_empty();
    let listener = listen(config.listen).with_context(|| {
        format!(
            "cannot listen on {}; choose another address with --listen",
            config.listen
        )
    })?;
    let recorder = config.record.as_deref().map(recorder).transpose()?;
    let nodes = match &config.nodes {
        Some(settings) => Some(Nodes::join(settings).await?),
        None => None,
    };
    let node = config.nodes.as_ref().and_then(|nodes| nodes.name.as_ref());
    let traces = match &config.traces {
        Some(settings) => Traces::start(settings, node.map(ToString::to_string))?,
        None => Traces::default(),
    };
    let among_nodes = nodes.is_some();
    let sources = Sources {
        nodes: nodes.clone(),
        publications: publications.clone(),
        catalogue: catalogue.clone(),
        recorder: recorder.clone(),
    };
    let live = Live::new(sources, config.live, shutdown.clone()).await?;
    live.restore().await?;
    let jobs = Jobs::new(
        catalogue.clone(),
        &config.place,
        publications.clone(),
        config.jobs,
        traces.clone(),
        shutdown.clone(),
    )?;
    let working = tokio::spawn({
        let jobs = jobs.clone();
        async move { jobs.work().await }
    });
    let leaving = tokio::spawn({
        let (live, shutdown) = (live.clone(), shutdown.clone());
        async move {
            shutdown.cancelled().await;
            live.leave().await;
            if let Some(nodes) = nodes {
                nodes.leave().await;
            }
        }
    });
    let state = AppState {
        publications,
        live,
        blobs,
        keys: Keys::new(catalogue.clone()),
        jobs,
        pace: Pace::new(config.requests_per_s),
        catalogue,
        missing: MissingObjects::default(),
        readiness: Readiness::default(),
        metrics: Metrics::new(among_nodes),
        traces: traces.clone(),
        limits: RequestLimits {
            timeout: config.request_timeout,
        },
        on_line: OnLine::default(),
        page_policy: PagePolicy::reading(&config.base_origins),
    };
    if nothing_yet {
        tracing::info!(data = %config.place.data.display(), "nothing is published yet; `belvedere bake FILE --scene NAME` does that");
    }
    on_listen(listener.local_addr().context("the listening socket has no address")?);
    if let Some(screen) = screen {
        let (state, shutdown) = (state.clone(), shutdown.clone());
        let showing = dashboard::show(screen, move || metrics_text(&state).ok());
        tokio::spawn(shutdown.run_until_cancelled_owned(showing));
    }
    let limits = with_room(config.connections);
    serve_connections(listener, Front::new(state), limits, tls, shutdown).await;
    working.await.context("the jobs broke off")?;
    leaving.await.context("other nodes were not told")?;
    if let Some(recorder) = recorder {
        recorder.flush().await;
    }
    traces.finish().await;
    Ok(())
}

/// So many connections wait in the kernel's queue while others are taken, where it allows as many: what finds no room there
/// knocks again a second later.
const WAITING: u32 = 4096;

fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = if address.is_ipv4() {
        TcpSocket::new_v4()?
    } else {
        TcpSocket::new_v6()?
    };
    // Connections of the server before may linger. Elsewhere this would let two servers listen.
    #[cfg(unix)]
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(WAITING)
}

/// As many connections as files may be open: more would leave none for anything else.
fn with_room(limits: ConnectionLimits) -> ConnectionLimits {
    let connections = open_files::room_for(limits.connections);
    if connections < limits.connections {
        let wanted = limits.connections;
        tracing::warn!(
            wanted,
            connections,
            "the limit on open files leaves room for fewer connections"
        );
    }
    ConnectionLimits { connections, ..limits }
}

fn recorder(file: &Path) -> anyhow::Result<Recorder> {
    Recorder::open(file).with_context(|| format!("cannot record into {}", file.display()))
}

/// Writes the log to standard error.
fn start_log(config: &Config, screen: Screen) -> anyhow::Result<()> {
    // What it says of its connections may hold a password.
    let filter = config
        .log
        .parse::<Targets>()?
        .with_target("async_nats", LevelFilter::WARN)
        // It tells each time that it has knocked in vain; that NATS is away is told once.
        .with_target("async_nats::connector", LevelFilter::OFF);
    let lines = tracing_subscriber::fmt::layer().with_writer(screen);
    let lines = match config.log_format {
        LogFormat::Text => lines.boxed(),
        LogFormat::Json => lines.json().boxed(),
    };
    tracing_subscriber::registry()
        .with(lines.with_filter(filter))
        .try_init()?;
    Ok(())
}

#[cfg(unix)]
fn stop_on_signals(stopping: CancellationToken) -> anyhow::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    tokio::spawn(async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        stopping.cancel();
    });
    Ok(())
}

#[cfg(not(unix))]
fn stop_on_signals(stopping: CancellationToken) -> anyhow::Result<()> {
    tokio::spawn(async move {
        if tokio::signal::ctrl_c().await.is_ok() {
            stopping.cancel();
        }
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::PlaceArgs;

    #[tokio::test]
    async fn whoever_shall_end_does_not_wait_for_who_does_not_answer() {
        let silent = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let database = format!("postgres://user@{}/catalogue", silent.local_addr().unwrap());
        let settings = Settings {
            place: PlaceArgs {
                database: Some(database.as_str().into()),
                ..PlaceArgs::default()
            },
            ..Settings::default()
        };
        let stopping = CancellationToken::new();
        stopping.cancel();
        let served = serve(Config::try_from(settings).unwrap(), stopping, |_| panic!("it listens"));
        served.await.unwrap();
    }
}
