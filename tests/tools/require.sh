#!/usr/bin/env bash
# Checks that programs are there. What is missing is installed when this runs as root on Debian or Ubuntu; otherwise
# it says exactly what to install.
set -euo pipefail

package_of() {
  case "$1" in
    cc) echo build-essential ;;
    python3) echo python3-venv ;;
    nginx) echo nginx-light ;;
    njs) echo libnginx-mod-http-js ;;
    *) echo "$1" ;;
  esac
}

missing=()
for program in "$@"; do
  case "$program" in
    cargo)
      command -v cargo >/dev/null || { echo "cargo is missing: install Rust with rustup, https://rustup.rs" >&2; exit 1; } ;;
    node | npm)
      # A distribution's own package is often too old, so none is installed.
      command -v "$program" >/dev/null ||
        { echo "$program is missing: install Node.js 20.19 or newer, https://nodejs.org" >&2; exit 1; } ;;
    chromium)
      # Ubuntu has no such package: install any Chromium or Chrome there and name it.
      [ -x "${CHROMIUM:-/usr/bin/chromium}" ] || missing+=(chromium) ;;
    postgresql)
      ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || command -v initdb >/dev/null || missing+=(postgresql) ;;
    njs)
      # A module of nginx; NJS_MODULE names it where it is elsewhere.
      [ -f "${NJS_MODULE:-/usr/lib/nginx/modules/ngx_http_js_module.so}" ] || missing+=("$(package_of njs)") ;;
    python3)
      python3 -c 'import venv, ensurepip' 2>/dev/null || missing+=("$(package_of python3)") ;;
    *)
      command -v "$program" >/dev/null || missing+=("$(package_of "$program")") ;;
  esac
done

if [ ${#missing[@]} -gt 0 ]; then
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "installing ${missing[*]}" >&2
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${missing[@]}" >/dev/null || {
      echo "cannot install ${missing[*]}; a Chromium or Chrome that is elsewhere is named by CHROMIUM=/path/to/it" >&2
      exit 1
    }
  else
    echo "missing: ${missing[*]}; install with: sudo apt-get install ${missing[*]}" >&2
    echo "(a Chromium or Chrome that is elsewhere is named by CHROMIUM=/path/to/it)" >&2
    exit 1
  fi
fi

if command -v node >/dev/null; then
  # What Vite asks for.
  node -e 'const [major, minor] = process.versions.node.split(".").map(Number);
    const old = major === 20 ? minor < 19 : major === 22 ? minor < 12 : major < 22;
    process.exit(old ? 1 : 0)' || {
    echo "node $(node --version) is too old: install Node.js 20.19 or newer, or 22.12 or newer, https://nodejs.org" >&2
    exit 1
  }
fi
