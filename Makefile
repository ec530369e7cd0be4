# The words a developer types; continuous integration types the same.
#
#   make test DISTRO=kilted     another ROS 2 distribution
#   make test PYTHON=python3.12 another interpreter (run `make clean` in between)

DISTRO ?= jazzy
PYTHON ?= python3
ARGS   ?=
WORKERS ?= 3
PANEL_ARGS = $(subst --stage ,--stage=,$(ARGS))
STAGE   ?= $(patsubst --stage=%,%,$(filter --stage=%,$(PANEL_ARGS)))
STAGES  := $(basename $(notdir $(wildcard config/stages/*.yaml)))

ifeq ($(filter $(DISTRO),jazzy kilted),)
$(error DISTRO is $(DISTRO); there are locks for jazzy and kilted)
endif

ifneq ($(STAGE),$(filter $(STAGES),$(STAGE)))
$(error STAGE is $(STAGE); there are $(STAGES))
endif

SUFFIX := $(if $(filter kilted,$(DISTRO)),-kilted)
VENV   := .venv$(SUFFIX)
BIN    := $(VENV)/bin
COLCON := .venv-colcon$(SUFFIX)
DOCS   := .venv-docs
RELEASE := .venv-release
CODES  := .venv-foreign
LOCK   := requirements/$(DISTRO).txt
TESTS  := requirements/$(DISTRO)-test.txt
DOORS  := requirements/doors.txt
COVERAGE := $(if $(findstring --cov,$(ARGS)),$(VENV)/coverage.stamp)

PIP := -m pip --disable-pip-version-check --quiet

# An installed or sourced ROS 2, or another environment of wheels, must not leak into ours.
unexport AMENT_PREFIX_PATH COLCON_PREFIX_PATH CMAKE_PREFIX_PATH PYTHONPATH PYTHONHOME
unexport LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE ROS_DISTRO VIRTUAL_ENV
# Tests start hundreds of processes, each of which would compile every module that it imports.
unexport PYTHONDONTWRITEBYTECODE

.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
.PHONY: help setup demo panel test test-all test-ros test-apt test-pythons fuzz mutate evidence foreign same lint hooks bench docs pictures studies wheel release colcon lock clean

help: ## show this list
	@echo 'make <target> [DISTRO=jazzy|kilted] [PYTHON=python3]'
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(VENV)/kernels.stamp $(VENV)/tests.stamp ## make the environment from the lock (the other targets do it too)

# The drive compiles what it needs; what only sweeps need can wait.
demo: $(VENV)/project.stamp ## run the instrument once: runs/demo.mcap and runs/demo.png
	$(BIN)/stickslip demo $(ARGS)
	@echo 'next: make panel, to see it move and to move it in the browser' >&2

# The page opens at once; the drive compiles what it needs, and the rest beside its blocks.
panel: $(VENV)/project.stamp ## a drive, its runner free, and its front panel in the browser, until Ctrl-C; ARGS='--stage clamp --port 0'
	@$(BIN)/drive $(addprefix --stage ,$(STAGE)) --ros-args --log-level warn -p load_cell.contact:=absent & drive=$$!; \
	trap 'kill $$drive 2> /dev/null; wait $$drive' EXIT; trap : INT TERM; \
	$(BIN)/stickslip panel $(filter-out --stage=%,$(PANEL_ARGS)) || test $$? -eq 130

OF_ROS := test/interface test/lab/cli test/recording test/ros test/runtime test/test_launch_files.py
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder --max-worker-restart=0 --second-try

test: $(VENV)/kernels.stamp $(VENV)/tests.stamp $(COVERAGE) ## run the tests; ARGS='-k name' chooses, ARGS=--cov measures
	$(PYTEST) -m 'not slow' $(ARGS)

test-all: $(VENV)/kernels.stamp $(VENV)/doors.stamp $(COVERAGE) ## the same with those that take minutes
	$(PYTEST) $(ARGS)

test-ros: $(VENV)/kernels.stamp $(VENV)/doors.stamp ## run the tests that may differ between distributions
	$(PYTEST) $(OF_ROS) $(ARGS)

# The packages of Ubuntu 24.04 in place of the lock, for the tests that start no launch file.
APT := requirements/apt.txt
WITHOUT_LAUNCH := $(addprefix test/,contact drive instrument interface kernels parameters recording runtime \
	lab/comparison lab/fitting lab/runs lab/readers ros test_public.py test_public_calls.py) \
	--ignore=test/lab/runs/test_batch.py

test-apt: $(VENV)/kernels.stamp $(VENV)/tests.stamp
	$(PYTEST) -m 'not slow' $(WITHOUT_LAUNCH) $(ARGS)

test-pythons: ## the same on every supported Python of this machine, each in .venv-<version>, and with the versions of Ubuntu 24.04
	@status=0; for version in 3.10 3.11 3.12 3.13 3.14 3.11-apt 3.12-apt; do \
	    number=$${version%-apt}; \
	    for python in python$$number $(HOME)/.pyenv/versions/$$number.*/bin/python; do \
	        $$python -c '' 2>/dev/null && break; \
	    done || { echo "Python $$number: not here"; continue; }; \
	    case $$version in *-apt) job='test-apt LOCK=$(APT) TESTS=$(APT)';; *) job=test;; esac; \
	    $(MAKE) $$job PYTHON=$$python VENV=.venv-$$version$(SUFFIX) || status=1; \
	done; exit $$status

fuzz: $(VENV)/kernels.stamp $(VENV)/tests.stamp ## random real-valued commands on every stand; ARGS='--seconds 600'
	PYTHONPATH=test $(BIN)/python test/fuzz $(ARGS)

mutate: $(VENV)/tests.stamp ## put errors into copies of the package, report who sees them, half an hour; ARGS=WORD chooses
	$(BIN)/python scripts/mutate.py $(ARGS)

evidence: $(VENV)/kernels.stamp $(VENV)/tests.stamp ## make the references of the self-test anew, fail where one moved; ARGS=--foreign asks others too
	PYTHONPATH=test $(BIN)/python -m evidence
	$(if $(filter --foreign,$(ARGS)),$(MAKE) foreign)

foreign: $(CODES)/lock.stamp ## ask codes that others wrote: stickslip_ros/lab/validation/foreign.csv
	PYTHONPATH="$(CURDIR)/test:$(CURDIR)" OMP_NUM_THREADS=1 $(CODES)/bin/python -m evidence.foreign

same: $(VENV)/kernels.stamp $(VENV)/tests.stamp ## record the same runs on a commit and here, compare the bytes; ARGS=COMMIT
	$(BIN)/python scripts/same_bytes.py $(ARGS)

# One list: `make lint` types all of these, and each is a hook of .pre-commit-config.yaml.
LINT := lint-style lint-format lint-types lint-examples lint-imports lint-manifest lint-headers
.PHONY: $(LINT)

lint: $(LINT) ## style, format, types (of the examples of docs too), import contracts and package.xml

lint-style: $(VENV)/tests.stamp
	$(BIN)/ruff check .

lint-format: $(VENV)/tests.stamp
	$(BIN)/ruff format --check .

lint-types: $(VENV)/doors.stamp
	$(BIN)/mypy
	$(BIN)/mypy --explicit-package-bases test/*/conftest.py test/lab/*/conftest.py

lint-examples: $(VENV)/doors.stamp
	$(BIN)/python scripts/check_examples.py

lint-imports: $(VENV)/tests.stamp
	$(BIN)/lint-imports

lint-manifest: $(VENV)/tests.stamp
	$(BIN)/python scripts/check_manifest.py

lint-headers: $(VENV)/tests.stamp
	$(BIN)/python scripts/headers.py

hooks: $(VENV)/tests.stamp ## run the checks of lint before every commit
	$(BIN)/pre-commit install

bench: $(VENV)/kernels.stamp $(VENV)/tests.stamp ## compare with other programs: benchmarks/results.json; ARGS=NAME for one
	$(BIN)/python -m benchmarks $(ARGS)

# -a: Sphinx keeps only the index entries of the pages that it writes.
docs: $(DOCS)/lock.stamp ## build the documentation site, notebooks included: build/docs/index.html
	PYTHONPATH="$(CURDIR)" $(DOCS)/bin/python -m sphinx -a -W --keep-going -d build/doctrees docs build/docs

pictures: $(VENV)/kernels.stamp ## draw the figures of the pages anew: docs/images
	$(BIN)/stickslip figures -o build/figures
	cp build/figures/*.png docs/images
	sed -n '/^```csv/,/^```/{/^```/!p}' docs/howto/compare.md > build/experiment.csv
	$(BIN)/stickslip compare build/experiment.csv model --figure docs/images/compare.png
	sed -n '/^```python/,/^```/{/^```/!p}' docs/start/control_engineer.md > build/loop.py
	printf 'figure.figsize: 7, 3\nfigure.constrained_layout.use: True\n' | cat stickslip_ros/lab/figures/screen.mplstyle - > build/matplotlibrc
	cd docs/images && MATPLOTLIBRC=../../build MPLBACKEND=agg $(CURDIR)/$(BIN)/python ../../build/loop.py
	$(BIN)/stickslip bode --params config/realistic.yaml --figure docs/images/bode.png
	$(BIN)/python docs/examples/step_map.py && cp runs/step_map.png docs/images

studies: $(DOCS)/lock.stamp ## the same with every study in full: build/studies/studies
	STUDIES=full PYTHONPATH="$(CURDIR)" $(DOCS)/bin/python -m sphinx -a -W --keep-going -d build/studies-doctrees docs build/studies

wheel: $(RELEASE)/lock.stamp ## build the wheel with its kernels into dist/, install it elsewhere and use it there, with the newest of all too
	$(RELEASE)/bin/python scripts/wheel_check.py $(LOCK)

release: $(RELEASE)/lock.stamp ## write the addresses that a release needs; ARGS='URL MAIL'
	$(RELEASE)/bin/python scripts/release.py $(ARGS)

colcon: $(COLCON)/lock.stamp ## build as in a ROS workspace and start the installed node once
	$(COLCON)/bin/python scripts/colcon_check.py

lock: ## pin the requirements anew; ARGS=--upgrade takes newer versions
	$(PYTHON) -m venv .venv-lock
	.venv-lock/bin/python $(PIP) install --require-hashes -r requirements/uv.txt
	scripts/lock.sh .venv-lock/bin/uv $(ARGS)

clean: ## remove environments, builds, caches and recorded runs
	rm -rf .venv .venv-*
	rm -rf .colcon build install log dist *.egg-info runs
	rm -rf .mypy_cache .ruff_cache .import_linter_cache .pytest_cache .hypothesis .coverage htmlcov
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# --- environments ------------------------------------------------------------------------------

define make-venv
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; (3, 10) <= v <= (3, 14) or sys.exit(f"Python {v[0]}.{v[1]} has no ROS 2 wheels; use PYTHON=python3.10 to 3.14")'
	@echo "1 of 3: making $(@D) for $(DISTRO), once"
	@$(PYTHON) -m venv --clear --without-pip $(@D)
	@$(PYTHON) $(PIP) --python $(@D)/bin/python install --require-hashes -r requirements/uv.txt 2> /dev/null \
		|| { $(with-pip) install --require-hashes -r requirements/uv.txt; } || true
	@$(call install-by,$(LOCKED) -r requirements/build.txt)
	@echo "2 of 3: installing the $(shell cat $(^) | grep -c ==) packages of $(^)"
	@$(install)
	@touch $@
endef

# uv takes a sixth of the processor time that pip does, which asks where uv cannot: pip's own
# settings may name another index. It trusts whom the system trusts, as pip does: behind a proxy of
# a company, its own list has nobody. The build tools come first, from the lock too: empy has no
# wheel, and neither it nor the project shall be built with anything unpinned.
define install
$(call install-by,$(LOCKED) $(LOCKS:%=-r %))
endef

define install-by
{ $(@D)/bin/uv pip install --system-certs --python $(@D)/bin/python $(1) \
	|| { echo 'by pip, which takes about a minute' >&2; $(with-pip) install $(1); }; }
endef

# A pip of its own takes an environment as long as all that uv installs, so it comes where needed.
with-pip = $(@D)/bin/python -m ensurepip > /dev/null && $(@D)/bin/python $(PIP)

LOCKS = $(filter %.txt,$^)
# Nothing is installed, or built with, that a lock does not name by its hash.
LOCKED := --require-hashes --no-build-isolation

$(VENV)/lock.stamp: $(LOCK)
	$(make-venv)

$(VENV)/tests.stamp: $(TESTS) $(VENV)/project.stamp
	@echo "installing what tests and lint need besides, of $(TESTS)"
	@$(install)
	@touch $@

$(VENV)/doors.stamp: $(DOORS) $(VENV)/tests.stamp
	@echo "installing the clients of the doors, of $(DOORS)"
	@$(install)
	@touch $@

$(VENV)/coverage.stamp: requirements/coverage.txt $(VENV)/tests.stamp
	@$(install)
	@touch $@

$(COLCON)/lock.stamp: $(LOCK) requirements/colcon.txt
	$(make-venv)

$(DOCS)/lock.stamp: requirements/docs.txt
	$(make-venv)

$(RELEASE)/lock.stamp: requirements/release.txt
	$(make-venv)

$(CODES)/lock.stamp: requirements/evidence.txt
	$(make-venv)
	@$(call install-by,$(LOCKED) --no-deps -r requirements/slippy.txt)

$(VENV)/project.stamp: $(VENV)/lock.stamp setup.py setup.cfg package.xml
	@$(call install-by,--force-reinstall --no-deps --no-build-isolation --editable .)
	@touch $@

# What the digest of kernels/cache.py is made of. Where make takes kernels for older than they are,
# the verb finds nothing to do.
$(VENV)/kernels.stamp: $(VENV)/project.stamp $(wildcard $(addprefix stickslip_ros/,kernels/*.py contact/*.py drive/*.py instrument/*.py))
	@echo "3 of 3: compiling all kernels, about a minute, once; they are kept"
	@$(BIN)/stickslip compile
	@touch $@
