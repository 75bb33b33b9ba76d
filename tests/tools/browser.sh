#!/usr/bin/env bash
# Opens the viewer in a real headless Chromium, walks, looks behind the picture, embeds it and meets people: from our
# server, and what needs none from the static tree behind a plain web server. Screenshots stay in artifacts/.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/tools/served.sh

serve_museum
# While the server runs: new scenes are there without a restart.
for world in viewer/e2e/worlds/*.dcg; do "$belvedere" bake "$world" --scene "$(basename "$world" .dcg)" --data "$data"; done
story() { BELVEDERE="$belvedere" BELVEDERE_URL="$1/?scene=museum" ARTIFACTS="$PWD/artifacts/$2" node "viewer/e2e/$3.mjs"; }
echo "walking through $base"
for name in walk recording keys sizes layout inspector elsewhere smooth reach embed embeds leaving outage hosts crowd; do story "$base" served "$name"; done

for scene in museum doored; do "$belvedere" publish "$scene" --data "$data" --to "$work/tree"; done
python3 -u -m http.server --bind 127.0.0.1 --directory "$work/tree" 0 >"$work/plain.log" 2>&1 &
plain=$!
also_end "$plain"
for _ in $(seq 100); do
  port=$(sed -n 's/.*port \([0-9]*\).*/\1/p' "$work/plain.log" | head -1)
  [ -n "$port" ] && break
  sleep 0.1
done
tree="http://127.0.0.1:$port"
echo "walking through the static tree"
for name in walk smooth embed; do story "$tree" static "$name"; done
BELVEDERE_STATIC="$tree/" story "$base" served company

"$belvedere" publish dunes --data "$data" --to "$work/bare"
rm "$work"/bare/o/*.r[0-9]*.slod*
echo "walking through a tree without rungs"
BELVEDERE_TREE="$work/bare" story "$base" static ranges
