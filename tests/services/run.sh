#!/usr/bin/env bash
# Tests against real services. Those that are named are used; those that are not are started on loopback, in a temporary
# folder, and ended with the tests:
#
#   BELVEDERE_TEST_POSTGRES   postgres://user:password@host/database, of a role that may make databases
#   BELVEDERE_TEST_S3         http://host:port, with AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY; takes requests that are
#                             not signed, as moto does, since the tests make buckets so
#   BELVEDERE_TEST_NATS       the program `nats-server`, which each test runs for itself
#
# Arguments are those of the tests: `tests/services/run.sh away` runs those with `away` in their name.
set -euo pipefail
cd "$(dirname "$0")/../.."

work=$(mktemp -d)
chmod 755 "$work"
ended=()
end_all() {
  for pid in "${ended[@]}"; do kill "$pid" 2>/dev/null || true; done
  # Also those that a test has left.
  for cluster in "$work"/*/cluster; do
    if [ -f "$cluster/postmaster.pid" ]; then tests/services/postgres.sh kill "$(dirname "$cluster")" || true; fi
  done
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap end_all EXIT

free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
answers() { (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null; }
wait_for() { # NAME PORT
  for _ in $(seq 300); do
    if answers "$2"; then return; fi
    sleep 0.1
  done
  echo "$1 did not start within half a minute" >&2
  exit 1
}

tests/tools/require.sh cargo cc python3 postgresql nats-server
# Tests that end a database start one of their own below this folder.
export BELVEDERE_TEST_FOLDER="$work"

if [ -z "${BELVEDERE_TEST_POSTGRES:-}" ]; then
  port=$(free_port)
  tests/services/postgres.sh start "$work/postgres" "$port"
  export BELVEDERE_TEST_POSTGRES="postgres://belvedere@127.0.0.1:$port/postgres"
fi

if [ -z "${BELVEDERE_TEST_S3:-}" ]; then
  moto=$(command -v moto_server || true)
  if [ -z "$moto" ]; then
    moto=.venv/bin/moto_server
    if [ ! -x "$moto" ]; then
      [ -x .venv/bin/pip ] || python3 -m venv .venv
      .venv/bin/pip install --quiet --disable-pip-version-check 'moto[server]==5.*'
    fi
  fi
  port=$(free_port)
  "$moto" -H 127.0.0.1 -p "$port" >"$work/moto.log" 2>&1 &
  ended+=("$!")
  wait_for moto_server "$port"
  export BELVEDERE_TEST_S3="http://127.0.0.1:$port"
  export AWS_ACCESS_KEY_ID=belvedere AWS_SECRET_ACCESS_KEY=not-a-secret AWS_REGION=us-east-1
fi

cargo test --locked --workspace --test services -- --ignored "$@"
