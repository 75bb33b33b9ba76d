//! Is a request made through a link into a private scene? Then its path is that below the link from here on, so that no
//! log, metric or error ever holds the signature; what the link opens goes with the request.

use std::time::Duration;

use axum::http::{HeaderMap, HeaderValue, Request, Uri, header, uri::PathAndQuery};
use belvedere_scene::SceneName;

use super::viewer;
use crate::{
    epoch::since_1970,
    links::{Claimed, ROOT},
    published::Publications,
};

/// What a link opens.
#[derive(Debug, Clone)]
pub(super) enum Link {
    /// The scene, until the link expires.
    Open {
        scene: SceneName,
        expires_s: u64,
        /// The link without its last `/`.
        base: HeaderValue,
    },
    /// It was signed, but its time is over.
    Expired,
}

/// Takes a link off the path. What no key has signed, of whatever scene, leads nowhere, as any address that nothing is at.
pub(super) fn take<B>(publications: &Publications, request: &mut Request<B>) {
    if !request.uri().path().starts_with(ROOT) {
        return;
    }
    let (below, link) = match read(publications, request.uri().path()) {
        Some((below, link)) => (below, Some(link)),
        None => (ROOT.to_owned(), None),
    };
    let query = request
        .uri()
        .query()
        .map_or_else(String::new, |query| format!("?{query}"));
    let target: Option<PathAndQuery> = format!("{below}{query}").parse().ok();
    let mut parts = request.uri().clone().into_parts();
    parts.path_and_query = Some(target.unwrap_or_else(|| PathAndQuery::from_static(ROOT)));
    *request.uri_mut() = Uri::from_parts(parts).unwrap_or_else(|_| Uri::from_static(ROOT));
    if let Some(link) = link {
        request.extensions_mut().insert(link);
    }
}

fn read(publications: &Publications, path: &str) -> Option<(String, Link)> {
    let claimed = Claimed::read(path)?;
    let privacy = publications.current().privacy.clone();
    let signed = claimed.is_signed_with(privacy.link_key(&claimed.scene)?);
    if !signed || !is_of_a_tree(claimed.below) {
        return None;
    }
    let link = if now_s() < claimed.expires_s {
        Link::Open {
            base: secret(claimed.link)?,
            scene: claimed.scene,
            expires_s: claimed.expires_s,
        }
    } else {
        Link::Expired
    };
    Some((claimed.below.to_owned(), link))
}

/// A value that no log shows.
fn secret(link: &str) -> Option<HeaderValue> {
    let mut value = HeaderValue::from_str(link).ok()?;
    value.set_sensitive(true);
    Some(value)
}

/// Links open scenes and the viewer; what a proxy may hide, such as metrics, they do not lead to.
fn is_of_a_tree(path: &str) -> bool {
    let scenes = ["/o/", "/v1/scenes", "/v1/sessions/", "/v1/movers/"];
    path == "/" || scenes.iter().any(|start| path.starts_with(start)) || viewer::has(path)
}

fn now_s() -> u64 {
    since_1970().as_secs()
}

impl Link {
    /// How long it holds still.
    pub(super) fn left(&self) -> Duration {
        match self {
            Self::Open { expires_s, .. } => Duration::from_secs(expires_s.saturating_sub(now_s())),
            Self::Expired => Duration::ZERO,
        }
    }

    /// Whether it holds still: its time is not over, and its key is that of the scene.
    pub(super) fn holds(&self, publications: &Publications) -> bool {
        let Self::Open { base, .. } = self else { return false };
        let path = base.to_str().map(|base| format!("{base}/"));
        path.is_ok_and(|path| matches!(read(publications, &path), Some((_, Self::Open { .. }))))
    }

    /// No cache keeps an answer for longer than the link holds, and what it is found at lies below the link. (A `Link` field names
    /// paths from the root of the tree, as documents do.)
    pub(super) fn mark(&self, headers: &mut HeaderMap) {
        let Self::Open { expires_s, base, .. } = self else {
            return;
        };
        let left_s = expires_s.saturating_sub(now_s());
        if let Some(kept) = text(headers, header::CACHE_CONTROL).and_then(|kept| until(kept, left_s)) {
            headers.insert(header::CACHE_CONTROL, kept);
        }
        let at = text(headers, header::CONTENT_LOCATION).filter(|at| at.starts_with('/'));
        if let (Some(at), Ok(base)) = (at, base.to_str())
            && let Ok(at) = HeaderValue::try_from(format!("{base}{at}"))
        {
            headers.insert(header::CONTENT_LOCATION, at);
        }
    }
}

fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

/// A `Cache-Control` whose times, one after the other, end with the link.
fn until(kept: &str, mut left_s: u64) -> Option<HeaderValue> {
    let directive = |directive: &str| match directive.split_once('=') {
        Some((name, seconds)) => {
            // Nothing is known to be left of a time that cannot be read.
            let seconds = seconds.parse().unwrap_or(0).min(left_s);
            left_s -= seconds;
            format!("{name}={seconds}")
        }
        None => directive.to_owned(),
    };
    let directives: Vec<_> = kept.split(',').map(str::trim).map(directive).collect();
    HeaderValue::try_from(directives.join(", ")).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::media;

    #[test]
    fn nothing_is_kept_for_longer_than_the_link_holds() {
        assert_eq!(until(media::FOR_EVER, 60).unwrap(), "public, max-age=60, immutable");
        assert_eq!(until(media::CURRENT, 60).unwrap(), media::CURRENT);
        assert_eq!(
            until(media::CURRENT, 1).unwrap(),
            "public, max-age=1, stale-while-revalidate=0"
        );
        assert_eq!(until("no-store, no-transform", 1).unwrap(), "no-store, no-transform");
    }

    #[test]
    fn a_link_leads_to_a_tree_and_nowhere_else() {
        for path in [
            "/",
            "/o/x.glb",
            "/o/bundle/x",
            "/v1/scenes",
            "/v1/scenes/town/cells",
            "/v1/sessions/s1/pose",
        ] {
            assert!(is_of_a_tree(path), "{path}");
        }
        for path in [
            "/metrics",
            "/healthz",
            "/v1/jobs/j0",
            "//",
            "/s/",
            "/openapi.json",
            "/%2e/metrics",
            "",
        ] {
            assert!(!is_of_a_tree(path), "{path}");
        }
    }
}
