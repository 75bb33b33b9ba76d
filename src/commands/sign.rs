//! `belvedere sign SCENE`: a link into a private scene, for a while.

use std::time::Duration;

use belvedere_scene::SceneName;

use super::{
    output::{print, print_json},
    private::key_of,
};
use crate::{epoch::since_1970, place::PlaceArgs, publish::data::DataFolder};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The scene
    scene: SceneName,
    /// How long the link holds, such as 90s, 15m, 1h or 7d
    #[arg(long, value_name = "TIME", value_parser = time, default_value = "1h")]
    expires: Duration,
    /// Where the server, or the CDN before it, is reached
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    at: String,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let at = args.at.trim_end_matches('/');
    anyhow::ensure!(
        (at.starts_with("http://") || at.starts_with("https://")) && !at.contains(['?', '#']),
        "`{}` is not the address of a server, such as https://worlds.example",
        args.at
    );
    let scene = &args.scene;
    let data = DataFolder::open_existing(&args.place).await?;
    let Some(key) = key_of(data.catalogue(), scene).await? else {
        // Which fails where there is none.
        data.baked(scene).await?;
        anyhow::bail!("scene `{scene}` is not private, so it needs no link; `belvedere private {scene}` makes it so");
    };
    let expires_s = (since_1970() + args.expires).as_secs();
    let base = format!("{at}{}", key.sign(scene, expires_s));
    let url = format!("{base}?scene={scene}");
    if args.json {
        return print_json(&serde_json::json!({"scene": scene, "url": url, "base": base, "expires_s": expires_s}));
    }
    print(&url)
}

/// `90s`, `15m`, `1h`, `7d`: at least a second, at most ten years.
fn time(text: &str) -> Result<Duration, String> {
    const MOST_S: u64 = 3_653 * 86_400;
    let units = [("s", 1), ("m", 60), ("h", 3_600), ("d", 86_400)];
    let seconds = units.iter().find_map(|(unit, seconds)| {
        let number: u64 = text.strip_suffix(unit)?.parse().ok()?;
        number.checked_mul(*seconds)
    });
    seconds
        .filter(|seconds| (1..=MOST_S).contains(seconds))
        .map(Duration::from_secs)
        .ok_or_else(|| "expected a time of up to ten years, such as 90s, 15m, 1h or 7d".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        assert_eq!(time("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(time("15m"), Ok(Duration::from_secs(900)));
        assert_eq!(time("7d"), Ok(Duration::from_secs(604_800)));
        for wrong in [
            "",
            "1",
            "0s",
            "-1h",
            "1.5h",
            "h",
            "99999999999999999999d",
            "4000d",
            "213503982334602d",
        ] {
            assert!(time(wrong).is_err(), "{wrong}");
        }
    }
}
