#!/usr/bin/env bash
# Is what `make dist` packs whole, and the same twice? Packs whatever program is named, else one made up.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work" dist/belvedere-0.0.0-test.tar.gz*' EXIT
program=$(realpath -m "${1:-$work/program}")
[ $# -gt 0 ] || printf '#!/bin/sh\necho belvedere 0.0.0\n' >"$program"

deploy/dist.sh "$program" 0.0.0 test
(cd dist && sha256sum --check --quiet belvedere-0.0.0-test.tar.gz.sha256)
cp dist/belvedere-0.0.0-test.tar.gz "$work/first"
# Another day, another place, another umask.
sleep 1
(umask 077 && cp -r --parents content deploy docs client/examples viewer/README.md viewer/bench/README.md viewer/examples README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT "$work/" && cd "$work" &&
  SOURCE_DATE_EPOCH=$(git -C "$OLDPWD" log -1 --format=%ct) deploy/dist.sh "$program" 0.0.0 test)
cmp "$work/first" "$work/dist/belvedere-0.0.0-test.tar.gz"

tar -xzf "$work/first" -C "$work"
for file in belvedere LICENSE-APACHE LICENSE-MIT README.md CHANGELOG.md deploy/nginx-cache.conf deploy/belvedere.service docs/OPERATIONS.md; do
  [ -s "$work/belvedere-0.0.0-test/$file" ] || { echo "$file is missing" >&2; exit 1; }
done
# Links of its pages lead to what is packed.
(cd "$work/belvedere-0.0.0-test" && find . -name '*.md' | while read -r page; do
  { grep -oE '\]\([^)#: ]+[)#]' "$page" || true; } | tr -d '](#)' | while read -r link; do
    [ -e "$(dirname "$page")/$link" ] || echo "$page leads to $link, which is missing"
  done
done >"$work/dead")
[ ! -s "$work/dead" ] || { cat "$work/dead" >&2; exit 1; }
"$work/belvedere-0.0.0-test/belvedere" --version
echo "whole, and the same twice"
