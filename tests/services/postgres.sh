#!/usr/bin/env bash
# A PostgreSQL server of one's own on loopback, in a folder that may be thrown away:
#
#   postgres.sh start DIR PORT    makes the folder if need be; the superuser is `belvedere`, without a password
#   postgres.sh kill DIR          ends it as a crash would
#
# PostgreSQL does not run as root; then it runs as `postgres`, whom Debian's package has made.
set -euo pipefail
command=$1 dir=$2

bin=$(dirname "$(command -v initdb || ls -d /usr/lib/postgresql/*/bin/initdb 2>/dev/null | tail -1)")
as_owner() {
  if [ "$(id -u)" = 0 ]; then setpriv --reuid=postgres --regid=postgres --init-groups "$@"; else "$@"; fi
}

case "$command" in
  start)
    if [ ! -d "$dir/cluster" ]; then
      mkdir -p "$dir"
      if [ "$(id -u)" = 0 ]; then chown postgres "$dir"; fi
      # C sorts as no language does; what is served must not depend on it, so a test cluster takes another collation.
      (cd / && as_owner "$bin/initdb" --pgdata "$dir/cluster" --username belvedere --auth trust --no-sync \
        --encoding UTF8 --locale-provider=icu --icu-locale=en --locale=C >/dev/null)
    fi
    (cd / && as_owner "$bin/pg_ctl" start --wait --silent --pgdata "$dir/cluster" --log "$dir/log" --options \
      "-c listen_addresses=127.0.0.1 -c port=$3 -c unix_socket_directories= -c fsync=off -c max_connections=200")
    ;;
  kill)
    (cd / && as_owner "$bin/pg_ctl" stop --silent --mode immediate --pgdata "$dir/cluster")
    ;;
esac
