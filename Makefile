# make demo   build; simulate, track, adjust, evaluate; render images and convert them; convert the committed sample; validate all
# make test   every test
# make lint   formatting, clippy, documentation, dependencies

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help

# Where `make conformance-corpus` writes.
CORPUS ?= out/conformance
# Seconds for each fuzz target.
FUZZ_SECONDS ?= 30
# More arguments of libFuzzer.
FUZZ_ARGS ?=
# `--dev` builds sooner and tries less in the same time.
FUZZ_BUILD ?=

# Tests, benchmarks and examples stop at what they did not expect, and need not be pretty.
TESTS_MAY := $(addprefix --allow clippy::,pedantic unwrap_used expect_used print_stdout print_stderr)

.PHONY: help setup demo test lint bench bench-baseline bench-figures bench-instructions bench-instructions-baseline bench-peers bench-scale paper-table fuzz conformance-corpus spec page book package wheel

help:
	@sed -n 's/^# \(make .*\)/\1/p' Makefile
	@echo 'make bench | bench-baseline | bench-figures | bench-instructions | bench-instructions-baseline'
	@echo 'make bench-peers | bench-scale | paper-table | fuzz | conformance-corpus | spec | page | book | package | wheel | setup'

setup: ## what the other targets need
	@.ci/setup

demo: setup
	@.ci/demo

test: setup
	@.ci/test

lint:
	cargo fmt --all --check
	cargo clippy --workspace --locked -- --deny warnings
	cargo clippy --workspace --all-targets --locked -- --deny warnings $(TESTS_MAY)
	RUSTDOCFLAGS='--deny warnings' cargo doc --workspace --no-deps --locked
	@if command -v cargo-deny > /dev/null; then cargo deny check; else .ci/dependencies.py; fi

# Times, as ratios to benches/baseline.json; never fails because something was slow.
bench:
	@benches/times

bench-baseline:
	@benches/times --store

# The figures that the project promises, each a ratio or a bound of one run; fails where a bound does not hold.
bench-figures:
	cargo bench --locked --bench figures
	cargo bench --locked --package open-structure-converters --bench converting

# Instructions of hot kernels, held against benches/instructions/counts.json; needs valgrind.
bench-instructions:
	@benches/instructions/count

bench-instructions-baseline:
	@benches/instructions/count --store

# Ours and its peers (Ceres, GTSAM, apex-solver) on the same graphs; an hour and more. ARGS: see benches/peers/run --help
bench-peers:
	@benches/peers/run $(ARGS)

# How time and memory of an adjustment grow up to ten million observations; half an hour. ARGS: see benches/scale/run --help
bench-scale:
	@benches/scale/run $(ARGS)

# The paper's table on the sequences of the first release; an hour and more, and it goes on where it was cut off.
paper-table:
	@benches/paper-table

# cargo-fuzz asks for a nightly compiler's flags; the stable one takes them when told to. No sanitizer: our
# code is safe throughout, so panics, hangs and memory are what there is to find.
fuzz:
	@command -v cargo-fuzz > /dev/null || cargo install cargo-fuzz --locked
	@export RUSTC_BOOTSTRAP=1; for target in $$(cargo fuzz list); do \
	  echo "== fuzz $$target, $(FUZZ_SECONDS) s"; \
	  mkdir -p "fuzz/corpus/$$target"; \
	  cargo fuzz run $(FUZZ_BUILD) "$$target" --sanitizer none "fuzz/corpus/$$target" "fuzz/seeds/$$target" -- \
	    -max_total_time=$(FUZZ_SECONDS) -rss_limit_mb=2048 -timeout=10 -max_len=65536 $(FUZZ_ARGS); \
	done

conformance-corpus:
	cargo run --quiet --locked --example conformance_corpus -- $(CORPUS)

# What is generated in spec/, the sample and the README, written anew.
spec:
	cargo build --workspace --bins --locked
	UPDATE_SPEC=1 UPDATE_SAMPLE=1 UPDATE_README=1 cargo test --workspace --locked \
	  --test spec_sync --test sample_sequence --test documents --test simulation --test fetch

# The code and style of the page that `os report` writes, bundled anew of src/report/page/src.
page:
	npm --prefix src/report/page ci --ignore-scripts --no-audit --no-fund
	npm --prefix src/report/page run build

# The book, into out/book.
book:
	@command -v mdbook > /dev/null || cargo install mdbook --locked --no-default-features --features search
	mdbook build docs

# The Python wheel, into out/wheel, installed into an environment of its own and tried.
wheel:
	@packaging/wheel

# Debian packages and a tarball, into out/package, and a look whether all is in them.
package:
	@packaging/package
	@packaging/check
