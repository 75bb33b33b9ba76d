#!/usr/bin/env bash
# Opens the viewer in a real headless Chromium and walks through a door: once from our server, once from the static
# tree behind a plain web server. Screenshots and logs stay in artifacts/.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/tools/served.sh

serve_museum
echo "walking through $base"
BELVEDERE_URL="$base/" ARTIFACTS="$PWD/artifacts/served" node viewer/e2e/walk.mjs

"$belvedere" publish museum --data "$data" --to "$work/tree"
python3 -u -m http.server --bind 127.0.0.1 --directory "$work/tree" 0 >"$work/plain.log" 2>&1 &
plain=$!
also_end "$plain"
for _ in $(seq 100); do
  port=$(sed -n 's/.*port \([0-9]*\).*/\1/p' "$work/plain.log" | head -1)
  [ -n "$port" ] && break
  sleep 0.1
done
echo "walking through the static tree"
BELVEDERE_URL="http://127.0.0.1:$port/" ARTIFACTS="$PWD/artifacts/static" node viewer/e2e/walk.mjs
