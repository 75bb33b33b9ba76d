#!/usr/bin/env bash
# Packs a built program into dist/belvedere-{version}-{target}.tar.gz, with a .sha256 beside it: `make dist`.
# The same files give the same bytes: names are sorted, and times, owners and modes are set.
#
#   deploy/dist.sh BINARY VERSION TARGET
set -euo pipefail
cd "$(dirname "$0")/.."
binary=$1 name="belvedere-$2-$3"

staged=$(mktemp -d)
trap 'rm -rf "$staged"' EXIT
mkdir "$staged/$name"
cp "$binary" "$staged/$name/belvedere"
cp LICENSE-APACHE LICENSE-MIT README.md CHANGELOG.md "$staged/$name/"
cp -r content deploy docs "$staged/$name/"
cp -r --parents client/examples viewer/README.md viewer/bench/README.md viewer/examples "$staged/$name/"
rm "$staged/$name/deploy/dist.sh"
# Whoever's umask it is.
chmod -R u=rwX,go=rX "$staged/$name"
chmod 755 "$staged/$name/belvedere"

mkdir -p dist
# The time of what is packed: that of the last commit, or what SOURCE_DATE_EPOCH says (reproducible-builds.org).
time=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || echo 0)}
tar --create --format=ustar --directory "$staged" --sort=name --mtime="@$time" --owner=0 --group=0 --numeric-owner "$name" |
  gzip --no-name --best >"dist/$name.tar.gz"
(cd dist && sha256sum "$name.tar.gz" >"$name.tar.gz.sha256")
echo "dist/$name.tar.gz"
