# Sourced by the other scripts: builds the program, bakes a museum and serves it on a free port.
# Afterwards `belvedere`, `data`, `base` and `work` are set; everything started is ended on exit. The baked museum is
# kept for all scripts, until the program is built anew, and each serves a copy, so that they may run at the same time.
# A script with scenes of its own calls `build_program`, fills `data` and calls `serve`.

work=$(mktemp -d)
ended=()
also_end() { ended+=("$1"); }
end_all() {
  for pid in "${ended[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap end_all EXIT

build_program() {
  # With tests, so that what `cargo test` has built is used: without them dependencies lose features and are built again.
  cargo build --locked --workspace --tests --quiet
  target="${CARGO_TARGET_DIR:-target}"
  belvedere="$target/debug/belvedere"
}

serve_museum() {
  build_program
  (
    flock 9
    if [ "$belvedere" -nt "$target/museum/built" ] || [ tests/fixtures/wing.plan -nt "$target/museum/built" ]; then
      rm -rf "$target/museum"
      "$belvedere" bake tests/fixtures/wing.plan --scene museum --data "$target/museum"
      touch "$target/museum/built"
    fi
  ) 9>"$target/museum.lock"
  data="$work/data"
  cp -r "$target/museum" "$data"
  serve
}

serve() {
  "$belvedere" serve --listen 127.0.0.1:0 --data "$data" >"$work/serve.out" 2>"$work/serve.err" &
  local server=$!
  also_end "$server"
  for _ in $(seq 300); do
    base=$(grep -o 'http://127\.0\.0\.1:[0-9]*' "$work/serve.out" | head -1 || true)
    [ -n "$base" ] && return
    kill -0 "$server" 2>/dev/null || { cat "$work/serve.err" >&2; exit 1; }
    sleep 0.1
  done
  echo "the server did not start within half a minute" >&2
  exit 1
}
