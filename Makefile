# Two commands: `make demo` shows the built-in worlds, `make test` checks everything. Both say what is missing.
# What they are made of stands below.

CARGO ?= cargo
NPM ?= npm
LISTEN ?= 127.0.0.1:8080
DATA ?= data
EVALUATION ?=
STREAMS ?=
MINUTES ?= 20

.PHONY: demo test check viewer tools build-tests test-rust test-viewer test-levels test-browser test-api test-services test-private test-cache test-dist deny evaluation streams soak dist bless clean

## Build, bake the built-in worlds, serve them and print the address.
demo:
	@tests/tools/require.sh cargo cc node npm
	@$(MAKE) --no-print-directory viewer
	$(CARGO) run --release --locked -- demo --listen $(LISTEN) --data $(DATA)

## Every test that needs no service: format, lints, unit, property, golden, end-to-end, levels in others' readers, a real browser, the API
## against its description, an nginx in front, what a release packs. When all is built they run two at a time, since most wait more than
## they compute, but for those in a browser, which draw without a graphics card; each is printed when it is over, and one that fails stops
## no other.
test: tools check build-tests
	@$(MAKE) --no-print-directory --jobs=2 --output-sync=target --keep-going \
		test-rust test-viewer test-levels test-api test-private test-cache test-dist; others=$$?; \
	$(MAKE) --no-print-directory test-browser && exit $$others

# Examples are documented, too, since with them dependencies have the features of tests, as Clippy has checked them.
check: viewer
	$(CARGO) fmt --all --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc --locked --workspace --lib --bin streams --examples --no-deps --document-private-items --quiet
	cd viewer && $(NPM) run check

build-tests: viewer
	$(CARGO) test --locked --workspace --no-run

# Without the flags of make, which tests of documentation take for a sign of jobs to share.
test-rust: viewer
	MAKEFLAGS= $(CARGO) test --locked --workspace --no-fail-fast

test-viewer: viewer
	cd viewer && $(NPM) test

test-levels: viewer
	tests/tools/levels.sh

test-browser: viewer
	tests/tools/browser.sh

test-api: viewer
	tests/tools/api.sh

## Against real services: PostgreSQL, an S3 server and NATS. Starts on loopback what is not named, as tests/services/run.sh says.
test-services: viewer
	tests/services/run.sh

## Links into private scenes, in front of a real nginx with njs.
test-private: viewer
	tests/tools/private.sh

## What nginx keeps, set up as deploy/nginx-cache.conf says.
test-cache: viewer
	tests/tools/cache.sh

## Whether what `make dist` packs is whole, and the same twice.
test-dist:
	tests/tools/dist.sh $(BINARY)

## Whether licences, sources and known holes of all dependencies are as deny.toml has them. Asks for the list of holes over the network.
deny:
	@$(CARGO) deny --version >/dev/null 2>&1 || \
		{ echo "cargo-deny is missing: cargo install --locked cargo-deny" >&2; exit 1; }
	$(CARGO) deny check

## A release for this machine's kind: dist/belvedere-{version}-{target}.tar.gz and its .sha256. BINARY=path packs one that is
## built already. Paths of this machine are kept out of the program, so that others can build the same bytes.
dist: viewer
ifndef BINARY
	RUSTFLAGS="$$RUSTFLAGS --remap-path-prefix=$(CURDIR)=/belvedere --remap-path-prefix=$${CARGO_HOME:-$$HOME/.cargo}=/cargo" \
		$(CARGO) build --release --locked --bin belvedere
endif
	deploy/dist.sh "$(or $(BINARY),$(or $(CARGO_TARGET_DIR),target)/release/belvedere)" \
		"$$($(CARGO) pkgid -p belvedere | sed 's/.*[@#]//')" "$$(rustc -vV | sed -n 's/^host: //p')"

## What the papers measured, measured again: writes docs/EVALUATION.md. A part: EVALUATION='--only table2,marvie';
## the page alone: EVALUATION=--render; a town that is baked already: EVALUATION='--town-data data'.
evaluation: MEASURING = --config profile.dev.package.belvedere-client.opt-level=2 --config profile.dev.package.belvedere-evaluation.opt-level=2
evaluation: viewer
	$(CARGO) build --locked -p belvedere
	$(CARGO) run --locked -p belvedere-evaluation $(MEASURING) -- $(EVALUATION)

## Event streams beside nchan under nginx, where that is here: tables of docs/LIVE.md. A part: STREAMS='--only idle'; another
## program: BINARY=path.
streams: viewer
ifndef BINARY
	$(CARGO) build --release --locked --bin belvedere
endif
	$(CARGO) run --locked -p belvedere-evaluation --bin streams --config profile.dev.package.belvedere-evaluation.opt-level=2 -- \
		--belvedere "$(or $(BINARY),$(or $(CARGO_TARGET_DIR),target)/release/belvedere)" $(STREAMS)

## A server under a long mixed load: every answer is checked, and its memory must stay flat. MINUTES=20; another program: BINARY=path.
soak: viewer
ifndef BINARY
	$(CARGO) build --release --locked --bin belvedere
endif
	node tests/soak/main.mjs "$(or $(BINARY),$(or $(CARGO_TARGET_DIR),target)/release/belvedere)" $(MINUTES)

## The page that the binary serves.
viewer: viewer/dist/index.html

viewer/dist/index.html: viewer/node_modules/.package-lock.json content/person.dcg $(shell find viewer -path viewer/node_modules -prune -o -path viewer/dist -prune -o -type f -print 2>/dev/null)
	cd viewer && $(NPM) run build
	@touch $@

viewer/node_modules/.package-lock.json: viewer/package.json viewer/package-lock.json
	@tests/tools/require.sh node npm
	cd viewer && $(NPM) ci --no-audit --no-fund
	@touch $@

## What `make test` needs besides Rust and Node: installed where we may, named where not.
tools:
	@tests/tools/require.sh cargo cc node npm chromium python3 curl nginx njs

## After a meant change of what is written: golden files anew, to be looked at and committed.
bless:
	BELVEDERE_BLESS=1 $(CARGO) test --locked -p belvedere-bake --test golden_smooth
	BELVEDERE_BLESS=1 $(CARGO) test --locked -p belvedere-scene --test golden_bundle --test golden_impostors --test golden_population --test golden_procedural --test golden_views
	BELVEDERE_BLESS=1 $(CARGO) test --locked -p belvedere-live --test golden_events
	BELVEDERE_BLESS=1 $(CARGO) test --locked -p belvedere-client --lib live::state::tests::golden
	BELVEDERE_BLESS=1 $(CARGO) test --locked -p belvedere-client --test golden_strategy

clean:
	$(CARGO) clean
	rm -rf viewer/dist viewer/node_modules artifacts .venv dist
