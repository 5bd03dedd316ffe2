# Two commands matter: `make demo` and `make test`. Both do all set-up themselves.

SHELL := /bin/bash
CARGO ?= cargo
BIN := target/release/claymill
# Mesa complains on stderr when this is unset.
export XDG_RUNTIME_DIR ?= $(shell mktemp -d)

.PHONY: demo test lint setup build bench clean

demo: build
	$(BIN) demo -o out/demo
	@echo "pictures: out/demo/preview-iso.png  out/demo/preview-top.png  out/demo/preview-side.png"
	@echo "report:   out/demo/report.html"

test: setup
	$(CARGO) test --release --workspace

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --release --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --workspace --no-deps

build: setup
	$(CARGO) build --release -p claymill-cli

bench: setup
	$(CARGO) bench --workspace

setup:
	@bash scripts/setup.sh

clean:
	$(CARGO) clean
	rm -rf out
