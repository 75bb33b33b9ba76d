#!/usr/bin/env bash
# Does nginx, set up as deploy/nginx-private.conf says, keep private scenes private, and share objects among links?
# Needs nginx with njs (Debian: nginx-light libnginx-mod-http-js); NJS_MODULE names the module where it is elsewhere.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/tools/served.sh

module=${NJS_MODULE:-/usr/lib/nginx/modules/ngx_http_js_module.so}
if ! command -v nginx curl >/dev/null || [ ! -f "$module" ]; then
  echo "nginx with njs and curl are needed: apt-get install nginx-light libnginx-mod-http-js curl" >&2
  exit 1
fi

build_program
data="$work/data"
"$belvedere" bake content/tree.dcg --scene tree --private --data "$data" >/dev/null
serve
# The workers of an nginx that root starts are somebody else.
chmod 755 "$work"
mkdir -p "$work/nginx" "$work/logs"
cp deploy/signed-links.js "$work/nginx/"
key=$("$belvedere" private tree --show-key --data "$data")
echo "tree $key;" >"$work/nginx/keys.map"
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
sed -e "s|/etc/nginx/belvedere|$work/nginx|; s|/var/cache/nginx|$work|; s|/var/log/nginx|$work/logs|" \
  -e "s|listen 8081|listen 127.0.0.1:$port|; s|server 127.0.0.1:8080|server ${base#http://}|" \
  deploy/nginx-private.conf >"$work/nginx/private.conf"
cat >"$work/nginx.conf" <<END
load_module $module;
worker_processes 1;
daemon off;
pid $work/nginx.pid;
error_log $work/logs/error.log;
events { worker_connections 256; }
http {
  client_body_temp_path $work/body; proxy_temp_path $work/proxy; fastcgi_temp_path $work/f; uwsgi_temp_path $work/u; scgi_temp_path $work/s;
  include $work/nginx/private.conf;
}
END
nginx -c "$work/nginx.conf" -p "$work" &
also_end $!
cdn="http://127.0.0.1:$port"
for _ in $(seq 100); do curl -s -o /dev/null "$cdn/healthz" && break; sleep 0.1; done

failed=0
# is WHAT URL STATUS [X-CACHE]
is() {
  local answer status
  answer=$(curl -s -o /dev/null -D - "$2")
  status=$(awk 'NR == 1 {print $2}' <<<"$answer")
  if [ "$status" != "$3" ] || { [ -n "${4:-}" ] && ! grep -qi "^x-cache: $4" <<<"$answer"; }; then
    echo "WRONG $1: wanted $3 ${4:-}, got: $answer" >&2
    failed=1
  else
    echo "ok    $1: $3 ${4:-}"
  fi
}
link() { "$belvedere" sign tree --data "$data" --at "$cdn" --expires "$1" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["base"].rstrip("/"))'; }

one=$(link 1h) other=$(link 2h) short=$(link 1s)
manifest=$(curl -s "$one/v1/scenes/tree" | python3 -c 'import json, sys; print(json.load(sys.stdin)["manifest"])')
is "the viewer below a link" "$one/" 200
is "the pointer" "$one/v1/scenes/tree/index.json" 200
is "an object by one link" "$one$manifest" 200 MISS
is "the same by another link" "$other$manifest" 200 HIT
left=$(curl -s -o /dev/null -D - "$one$manifest" | sed -n 's/^[Cc]ache-[Cc]ontrol: public, max-age=\([0-9]*\), immutable\r*$/\1/p')
if [ -z "$left" ] || [ "$left" -gt 3600 ]; then
  echo "WRONG how long the first may keep it: ${left:-nothing said}" >&2
  failed=1
fi
beyond=$(curl -s -o /dev/null -D - -H 'Range: bytes=99999999-' "$one$manifest")
if ! grep -q ' 416 ' <<<"$beyond" || ! grep -qi '^cache-control: no-store' <<<"$beyond"; then
  echo "WRONG a range behind the end may be kept: $beyond" >&2
  failed=1
fi
is "the same by a link that nobody signed" "${one%????}0000$manifest" 404
is "the pointer by such a link" "${one%????}0000/v1/scenes/tree" 404
is "the same to a stranger" "$cdn$manifest" 404
is "the scene to a stranger" "$cdn/v1/scenes/tree" 404
is "metrics below a link" "$one/metrics" 404
sleep 2
is "the object by a link that has expired" "$short$manifest" 404
is "the pointer by a link that has expired" "$short/v1/scenes/tree" 403
if grep -q "${one##*/}" "$work/logs/belvedere.log" "$work/logs/error.log" "$work/serve.err"; then
  echo "WRONG a log holds a signature" >&2
  failed=1
fi
[ -s "$work/logs/belvedere.log" ]
exit $failed
