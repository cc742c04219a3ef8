# `make` lists the targets. Each sets up what it needs and writes only inside this directory.
# Another interpreter: make PYTHON3=python3.12 test. More arguments: make test ARGS="-k dipoles".

PYTHON3 ?= python3
ARGS ?=

.DEFAULT_GOAL := help
.NOTPARALLEL:
.SUFFIXES:

PYTHON := .venv/bin/python
CACHE := $(CURDIR)/.cache

export TMPDIR := $(CACHE)/tmp
export XDG_CACHE_HOME := $(CACHE)
export PIP_CACHE_DIR := $(CACHE)/pip
export MPLCONFIGDIR := $(CACHE)/matplotlib
export IPYTHONDIR := $(CACHE)/ipython
export JUPYTER_DATA_DIR := $(CACHE)/jupyter
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PYRIGHT_PYTHON_IGNORE_WARNINGS := 1
unexport PYTHONHOME
unexport PYTHONPATH
unexport PYTHONDONTWRITEBYTECODE

# An environment belongs to one interpreter and one directory, recorded in its file made-for. The
# file is written last, so an environment whose installation was interrupted is rebuilt, as is one
# for another interpreter or directory.
INTERPRETER := $(shell $(PYTHON3) -c 'import sys; print("%d.%d" % sys.version_info[:2], sys.base_prefix)' 2>/dev/null)
HERE := $(strip $(INTERPRETER) $(CURDIR))
ifneq ($(HERE),$(strip $(shell cat .venv/made-for 2>/dev/null)))
REDO := redo
endif
ifneq ($(HERE),$(strip $(shell cat .venv-compat/made-for 2>/dev/null)))
REDO_COMPAT := redo
endif
ifneq ($(HERE),$(strip $(shell cat .venv-bench/made-for 2>/dev/null)))
REDO_BENCH := redo
endif

# Pictures need neither tests nor linters, but an environment that has them is used as it is.
READY := $(firstword $(wildcard .venv/dev-ready) .venv/ready)

# Two more than processors, since tests wait for programs that they start.
WORKERS := $(shell $(PYTHON3) -c 'import os; print(min(4, 2 + (os.cpu_count() or 1)))' 2>/dev/null)

.PHONY: help setup library movie test test-quick format lint docs bench compat cross clean redo

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile

setup: .venv/dev-ready  ## the environment .venv, with tests and linters

library: $(READY)  ## the library of compiled functions, if it is missing or its sources have changed
	@$(PYTHON) -m library.build

movie: $(READY)  ## Hamel's top acquires spin: out/top.mp4, out/top.nc, out/top.png
	@echo "== movie: simulating and rendering into out/"
	@.venv/bin/magmotor movie top $(ARGS)

test: .venv/dev-ready library  ## all tests
	@echo "== test: running pytest (the first run also compiles what the library lacks)"
	@$(PYTHON) -m pytest -n $(WORKERS) $(ARGS)

test-quick: .venv/dev-ready library  ## tests of the library, the devices and the messages, but none of tests/slow.txt
	@echo "== test-quick: running pytest (the first run also compiles what the library lacks)"
	@$(PYTHON) -m pytest -n $(WORKERS) -m "not slow" tests/library tests/devices tests/messages $(ARGS)

format: .venv/dev-ready  ## the code, as lint demands it
	@$(PYTHON) -m ruff check --fix-only --quiet
	@$(PYTHON) -m ruff format

lint: .venv/dev-ready  ## ruff (rules and format), pyright, and the import layers
	@echo "== lint: ruff check, ruff format --check, pyright, lint-imports"
	@$(PYTHON) -m ruff check
	@$(PYTHON) -m ruff format --check
	@$(PYTHON) -m pyright
	@.venv/bin/lint-imports --no-cache --no-logo

bench: .venv/dev-ready library  ## the speed tables; only some with ARGS="ensemble sweeps"
	@$(MAKE) --no-print-directory .venv-bench/ready || \
		echo "== bench: no .venv-bench, so other libraries are left out"
	@echo "== bench: measuring (leave the machine idle meanwhile)"
	@$(PYTHON) benchmarks/run.py $(ARGS)

# Not --quiet, which would also hide warnings from --strict.
docs: .venv/dev-ready library  ## the documentation site, which opens from disk: out/site/
	@echo "== docs: building out/site/ with warnings as errors (running the notebook takes about a minute)"
	@NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict $(ARGS)

compat: .venv-compat/ready  ## tests of what depends on MuJoCo's version, on 3.17: by the library, then by Numba
	@.venv-compat/bin/python -m library.build
	@.venv-compat/bin/python -c 'import mujoco; print("== compat: running pytest on mujoco", mujoco.__version__)'
	@.venv-compat/bin/python -m pytest tests/programs/test_compat.py tests/library/test_c_host.py \
		tests/library/test_plugin.py tests/library/test_failures.py $(ARGS)
	@MAGMOTOR_LIBRARY=0 .venv-compat/bin/python -m pytest tests/programs/test_compat.py $(ARGS)

# $(call elsewhere,LIBRARY,WHEEL'S PLATFORM,PROGRAMS,VARIABLE,TESTS): run tests of a library for
# another machine, which find MuJoCo for it in the folder named by a variable.
define elsewhere
	@which $(3) >/dev/null || { echo "== cross: the library for $(1) is skipped, since one of these is missing: $(3)"; exit 0; }; \
	folder='$(CACHE)/cross/$(1)'; set -e; \
	echo "== cross: testing the library for $(1)"; \
	test -d $$folder/mujoco || { \
		$(PYTHON) -m pip download -qq --no-deps --only-binary :all: --platform $(2) --python-version 3.12 -d $$folder \
			mujoco-core==`$(PYTHON) -c 'import mujoco; print(mujoco.__version__)'`; \
		$(PYTHON) -m zipfile -e $$folder/*.whl $$folder; }; \
	$(4)=$$folder/mujoco $(PYTHON) -m pytest $(5)
endef

FOR_AARCH64 := qemu-aarch64-static aarch64-linux-gnu-gcc
FOR_WINDOWS := wine x86_64-w64-mingw32-gcc

cross: .venv/dev-ready library  ## the libraries for aarch64 and Windows, with tests by QEMU and Wine
	@names=; which $(FOR_AARCH64) >/dev/null && names=aarch64; which $(FOR_WINDOWS) >/dev/null && names="$$names windows"; \
	test -z "$$names" || { echo "== cross: building the libraries for $$names"; $(PYTHON) -m library.build $$names; }
	$(call elsewhere,aarch64,manylinux_2_28_aarch64,$(FOR_AARCH64),MUJOCO_AARCH64,\
		tests/library/test_c_host.py tests/library/test_c_host_words.py)
	$(call elsewhere,windows,win_amd64,$(FOR_WINDOWS),MUJOCO_WINDOWS,tests/library/test_windows.py)

clean:  ## remove environments and caches, but not out/
	rm -rf .venv .venv-compat .venv-bench .cache .hypothesis .pytest_cache .ruff_cache build dist
	rm -rf src/magmotor/numerics/native
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# $(call install,ENVIRONMENT,CONSTRAINTS,REQUIREMENTS,SIZE AND TIME,FIRST REQUIREMENTS,PROGRAM): build an
# environment from scratch if made-for is missing or differs, otherwise update it in place. Older
# versions of pip take twice as long. Python runs PROGRAM when the first requirements are installed,
# while pip installs the others: it builds the library for tests; a movie needs little of that, which
# Numba compiles in a few seconds. dm-control is installed without labmaze, which has no wheel for
# Python 3.13 (see pyproject.toml).
COMPILE := -c 'import magmotor, mujoco; magmotor.magnetism().__enter__(); \
	model = mujoco.MjModel.from_xml_path("models/top.xml"); mujoco.mj_step(model, mujoco.MjData(model))' \
	>/dev/null 2>&1
define install
	@$(PYTHON3) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
		echo "make: $(PYTHON3) is missing or older than 3.11: install python3 and python3-venv (Debian) or python3 (Fedora), or name a newer one as in make PYTHON3=python3.12" >&2; exit 1; }
	@$(PYTHON3) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "make: $(PYTHON3) cannot create virtual environments: install python3-venv (Debian) or python3 (Fedora)" >&2; exit 1; }
	@mkdir -p '$(TMPDIR)'
	@if test "`cat $(1)/made-for 2>/dev/null`" = '$(HERE)'; then \
		echo "== bringing $(1) up to date"; \
	elif test -e $(1) && ! test -e $(1)/constraints.txt; then \
		echo "make: $(1) was not set up by make: move or remove it" >&2; exit 1; \
	else \
		echo "== setting up $(1) with $(PYTHON3) ($(4))"; \
		rm -rf $(1) && mkdir $(1) && touch $(1)/constraints.txt && $(PYTHON3) -m venv $(1); \
	fi
	@rm -f $(1)/made-for
	@sed '$(2)' constraints.txt > $(1)/constraints.txt
	@trap 'kill $$! 2>/dev/null; exit 130' INT; \
	export PIP_CONSTRAINT=$(1)/constraints.txt; \
	pip="$(1)/bin/python -m pip install --no-compile --no-warn-conflicts"; \
	$(if $(5),$$pip -qq --upgrade pip editables hatchling && pip="$$pip --no-build-isolation" && \
	$$pip -qq -e '$(5)' && $$pip -qq --no-deps dm-control \
	&& { $(1)/bin/python $(6) & };) \
	$$pip -qq $(3) || { echo "== pip failed; trying again with full output"; $$pip $(3); } && wait
	@echo '$(HERE)' > $(1)/made-for
	@touch $@
endef

.venv/ready: pyproject.toml constraints.txt $(REDO)
	$(call install,.venv,,-e '.[movies]',once: 1 GB and half a minute,.,$(COMPILE))

.venv/dev-ready: pyproject.toml constraints.txt $(REDO)
	$(call install,.venv,,-e '.[dev]',once: 2.3 GB and one or two minutes,.[scenes],-m library.build)

.venv-compat/ready: pyproject.toml constraints.txt $(REDO_COMPAT)
	$(call install,.venv-compat,s/^mujoco==.*/mujoco==3.17.*/;/^mujoco-/d,-e '.[movies]' pytest pytest-xdist,once: 1 GB and about a minute,.,$(COMPILE))

# Its requirements pin their versions; sed's d empties the constraints.
.venv-bench/ready: benchmarks/peers/requirements.txt $(REDO_BENCH)
	$(call install,.venv-bench,d,-r $<,once: 2.2 GB and two minutes; 6 GB if PyPI has no torch without CUDA)
