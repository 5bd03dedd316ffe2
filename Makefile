# Two commands matter: `make demo` and `make test`. Both do all set-up themselves.

SHELL := /bin/bash
CARGO ?= cargo
BIN := target/release/claymill
# Mesa complains on stderr when this is unset.
export XDG_RUNTIME_DIR ?= $(shell mktemp -d)

.PHONY: demo test test-checked lint setup build dist bench fuzz clean

demo: build
	$(BIN) demo -o out/demo
	@echo "pictures: out/demo/preview-iso.png  out/demo/preview-top.png  out/demo/preview-side.png"
	@echo "report:   out/demo/report.html"

# Tests whose tool or data is absent say so in a file, which is counted at the end, also when tests fail.
export CLAYMILL_SKIPPED ?= $(CURDIR)/target/tests-skipped.txt
test: setup
	@mkdir -p "$$(dirname "$$CLAYMILL_SKIPPED")" && : > "$$CLAYMILL_SKIPPED"
	@status=0; $(CARGO) test --release --workspace || status=$$?; \
	    bash scripts/left-out.sh "$$CLAYMILL_SKIPPED"; exit $$status

# Unit tests of the kernel and the planner with the assertions of debug builds.
CHECKED ?= nurbs motion toolpath contact surface-merge paths
test-checked: setup
	$(CARGO) test --profile checked --lib $(addprefix -p claymill-,$(CHECKED))

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --release --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --workspace --no-deps

build: setup
	$(CARGO) build --release -p claymill-cli

# The command as it is published, as target/dist/claymill.
dist: setup
	$(CARGO) build --profile dist -p claymill-cli

bench: setup
	$(CARGO) bench --workspace
	python3 benches/evaluation.py
	$(CARGO) test --release -p claymill-surface-merge --test it -- --ignored flaws::

# Half an hour of coverage-guided fuzzing for each reader, one after the other; `make test` has a short run of the
# same. Needs a nightly compiler (rustup toolchain install nightly) and `cargo install cargo-fuzz`. What it finds is in
# fuzz/artifacts; once mended, the file joins fuzz/seeds as a test.
FUZZ_SECONDS ?= 1800
FUZZ_TARGETS ?= iges step threedm stl gltf obj program stream machine
fuzz:
	@cd fuzz && for target in $(FUZZ_TARGETS); do mkdir -p corpus/$$target && \
	    RAYON_NUM_THREADS=1 $(CARGO) +nightly fuzz run -s none $$target corpus/$$target seeds/$$target -- \
	    -max_total_time=$(FUZZ_SECONDS) -timeout=10 -rss_limit_mb=2048 -max_len=40000 || exit 1; done

setup:
	@bash scripts/setup.sh

clean:
	$(CARGO) clean
	rm -rf out
