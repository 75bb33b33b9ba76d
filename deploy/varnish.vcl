# Varnish as a cache in front of `belvedere serve`. Start it with room for what is asked for most:
#   varnishd -a :8081 -f /etc/varnish/belvedere.vcl -s malloc,4G -p http_gzip_support=off
#
# The origin has encoded everything already; with its own gzip, Varnish would hand out no zstd.
#
# All of the origin's connections are from here: let it have `max_connections_per_address = 10000`, `max_sessions_per_address = 5000` and
# `max_movers_per_address_percent = 100`.
#
# The origin's Cache-Control decides what is kept and how long, `stale-while-revalidate` included.
vcl 4.1;

import std;

backend default {
    .host = "127.0.0.1";
    .port = "8080";
    .probe = {
        # Not /readyz: while the catalogue is away, what is known is served.
        .url = "/healthz";
        .interval = 5s;
        .timeout = 2s;
    }
}

sub vcl_recv {
    # While the origin answers, nothing is staler than half a minute.
    if (std.healthy(req.backend_hint)) {
        set req.grace = 30s;
    }
    # Metrics are not for the public.
    if (req.url ~ "^/metrics(\?|$)") {
        return (synth(404));
    }
    # Streams without end go straight through.
    if (req.method == "GET" && req.url ~ "^(/s/[^/]+/[^/]+/[^/]+)?/v1/(sessions|jobs)/[^/?]+/events(\?|$)") {
        return (pipe);
    }
    # All else of sessions and jobs, and everything that changes something, is asked of the origin on connections that stay open; and
    # so is what is asked with an API key, whose answer is not for everybody.
    if (req.url ~ "^(/s/[^/]+/[^/]+/[^/]+)?/v1/(sessions|jobs)/" || req.http.Authorization || (req.method != "GET" && req.method != "HEAD")) {
        return (pass);
    }
    # Objects have no query: with one, anybody would have the origin asked for each anew, and fill the memory.
    if (req.url ~ "^/o/") {
        set req.url = regsub(req.url, "\?.*$", "");
    }
    # Probes are about the origin.
    if (req.url ~ "^/(healthz|readyz)(\?|$)") {
        return (pass);
    }
    # Browsers spell Accept-Encoding in many ways, and the origin has three forms at most. Whoever weighs or excludes an
    # encoding gets the identity.
    if (req.http.Accept-Encoding ~ "q\s*=") {
        set req.http.Accept-Encoding = "identity";
    } elsif (req.http.Accept-Encoding ~ "(^|,)\s*zstd\s*(,|$)") {
        set req.http.Accept-Encoding = "zstd";
    } elsif (req.http.Accept-Encoding ~ "(^|,)\s*gzip\s*(,|$)") {
        set req.http.Accept-Encoding = "gzip";
    } else {
        unset req.http.Accept-Encoding;
    }
    # Slices are cut from the whole identity.
    if (req.http.Range) {
        set req.http.Accept-Encoding = "identity";
    }
    unset req.http.Cookie;
    return (hash);
}

sub vcl_backend_response {
    # What has just gone stale is sent once more while it is asked for anew, and for an hour when the origin is away.
    set beresp.grace = 1h;
    set beresp.keep = 1d;
    # Links into private scenes: nothing is sent once they have expired.
    if (bereq.url ~ "^/s/") {
        set beresp.grace = 0s;
        set beresp.keep = 0s;
    }
    if (beresp.status >= 400) {
        set beresp.ttl = 0s;
        set beresp.uncacheable = true;
    }
}

sub vcl_deliver {
    if (obj.hits > 0) {
        set resp.http.X-Cache = "HIT";
    } else {
        set resp.http.X-Cache = "MISS";
    }
    unset resp.http.Via;
    unset resp.http.X-Varnish;
}
