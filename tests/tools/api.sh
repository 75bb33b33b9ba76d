#!/usr/bin/env bash
# Sends what the OpenAPI document allows, and what it does not, and checks that every answer is one it describes.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/tools/served.sh

if [ ! -x .venv/bin/schemathesis ]; then
  python3 -m venv .venv
  .venv/bin/pip install --quiet --disable-pip-version-check 'schemathesis==4.*'
fi
serve_museum
.venv/bin/schemathesis run "$base/openapi.json" \
  --checks all --max-examples "${EXAMPLES:-25}" --seed 1 --workers 1 --no-color
