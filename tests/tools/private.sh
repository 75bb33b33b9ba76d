#!/usr/bin/env bash
# Does nginx, set up as deploy/nginx-private.conf says, keep private scenes private, and share objects among links?
# NJS_MODULE names nginx's module where it is elsewhere.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/tools/served.sh
. tests/tools/behind_nginx.sh

tests/tools/require.sh curl nginx njs
module=${NJS_MODULE:-/usr/lib/nginx/modules/ngx_http_js_module.so}
build_program
data="$work/data"
"$belvedere" bake content/tree.dcg --scene tree --private --data "$data" >/dev/null
printf '#####\n#a.b#\n#...#\n#####\n' >"$work/room.plan"
"$belvedere" bake "$work/room.plan" --scene room --data "$data" >/dev/null
serve
mkdir -p "$work/nginx"
cp deploy/signed-links.js "$work/nginx/"
key=$("$belvedere" private tree --show-key --data "$data")
echo "tree $key;" >"$work/nginx/keys.map"
behind_nginx deploy/nginx-private.conf "load_module $module;"

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
object=$(curl -s "$cdn/v1/scenes/room" | python3 -c 'import json, sys; print(json.load(sys.stdin)["manifest"])')
is "an object for everybody" "$cdn$object" 200 MISS
is "the same with a query" "$cdn$object?anew=1" 200 HIT
sleep 2
is "the object by a link that has expired" "$short$manifest" 404
is "the pointer by a link that has expired" "$short/v1/scenes/tree" 403
if grep -q "${one##*/}" "$work/logs/belvedere.log" "$work/logs/error.log" "$work/serve.err"; then
  echo "WRONG a log holds a signature" >&2
  failed=1
fi
[ -s "$work/logs/belvedere.log" ]
exit $failed
