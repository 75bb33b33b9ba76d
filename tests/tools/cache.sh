#!/usr/bin/env bash
# Does nginx, set up as deploy/nginx-cache.conf says, keep each object once, whatever is asked for beside its name?
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/tools/served.sh
. tests/tools/behind_nginx.sh

tests/tools/require.sh curl nginx
serve_museum
behind_nginx deploy/nginx-cache.conf

failed=0
# is WHAT X-CACHE CURL-ARGUMENTS…
is() {
  local what=$1 cache=$2 answer
  shift 2
  answer=$(curl -s -o /dev/null -D - "$@")
  if ! grep -qE '^HTTP/1.1 20[06] ' <<<"$answer" || ! grep -qi "^x-cache: $cache" <<<"$answer"; then
    echo "WRONG $what: wanted $cache, got: $answer" >&2
    failed=1
  else
    echo "ok    $what: $cache"
  fi
}
object=$(curl -s "$cdn/v1/scenes/museum" | python3 -c 'import json, sys; print(json.load(sys.stdin)["manifest"])')
is "an object" MISS "$cdn$object"
is "the same again" HIT "$cdn$object"
is "the same with a query" HIT "$cdn$object?anew=1"
is "a part of it" MISS -H 'Range: bytes=0-9' "$cdn$object?anew=2"
is "another part" HIT -H 'Range: bytes=10-19' "$cdn$object?anew=5"
is "its form for zstd" MISS -H 'Accept-Encoding: zstd' "$cdn$object?anew=3"
is "the same by another browser" HIT -H 'Accept-Encoding: gzip, deflate, br, zstd' "$cdn$object?anew=4"
exit $failed
