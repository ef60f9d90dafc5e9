# Every target does its own set-up: a virtual environment in .venv with the locked dependencies.
# PYTHON=/path/to/python3 chooses the Python; UV=/path/to/uv the uv that `make lock` runs.

BIN := .venv/bin
UV ?= uv
DB ?=
ARGS ?=
COMPILE := $(UV) pip compile --universal --generate-hashes --no-header --no-annotate --quiet

WORKERS = --numprocesses $(shell scripts/test_processes.sh) --dist worksteal

# An empty DB means the default database of the user.
ifneq ($(DB),)
DB_OPTION := --db $(DB)
endif

.DEFAULT_GOAL := help
.PHONY: help demo serve page manual wheel research bench test test-all test-research test-firefox unit lint lint-code lint-page format pictures lock clean setup setup-dev setup-manual page-if-possible

help: ## Show this list.
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' Makefile

demo: setup page-if-possible ## Optimize the thesis's chapter-4 job, then controller and gait, no worse than its optimum.
	@echo "1. The controller alone, as in the thesis:"
	@$(BIN)/gaitswarm optimize --name "chapter 4, preference A" --particles 25 --iterations 25 \
	    --preference A --seed 2 $(DB_OPTION) $(ARGS)
	@echo "2. Controller and gait, no worse than the thesis's optimum in any objective of any scenario:"
	@$(BIN)/gaitswarm optimize --name "controller and gait, no worse than A" --particles 25 --iterations 25 \
	    --preference A --seed 1 --with-gait --no-worse-than published:A \
	    $(DB_OPTION) $(ARGS)

serve: setup page-if-possible ## Serve page and REST API on http://127.0.0.1:8000, with a runner.
	@$(BIN)/gaitswarm serve $(DB_OPTION) $(ARGS)

page: setup ## Build the page that is served (with node and npm, or those of a wheel).
	@scripts/page.sh

manual: setup-manual ## Build the manual that is served on /manual from docs/.
	@rm -rf api/manual
	@$(BIN)/python -m sphinx -q -W -b html -d build/manual -c docs . api/manual

wheel: setup page-if-possible manual ## Build a wheel into dist/, with the page, the manual and compiled kernels.
	@$(BIN)/python -m scripts.prebuilt
	@$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .
	@rm -rf sim/compiler/prebuilt

research: setup-dev ## Compare search methods in a small experiment (a minute or two).
	@$(BIN)/gaitswarm-research compare small $(ARGS)

bench: setup-dev ## Measure the simulator on one core of this machine.
	@$(BIN)/python -m benchmarks.simulator $(ARGS)

# Tests start hundreds of processes; compiling every module again would take a third of their time.
test test-all test-research unit: export PYTHONDONTWRITEBYTECODE =

test: EACH_ONCE = -m "not thorough"
test: FOLDERS = tests
test test-all: setup-dev
	@scripts/npm.sh --if-possible test
	@scripts/page.sh --if-possible
	@$(BIN)/python -m pytest $(WORKERS) $(EACH_ONCE) $(FOLDERS) $(ARGS)

test: ## Test all that the program does; what is of the page needs node with npm, and Chromium.
test-all: ## Test all variants and the research package too: before releases and when the kernel changes.

test-research: setup-dev ## Test the research package.
	@$(BIN)/python -m pytest $(WORKERS) -m "not thorough" research/tests $(ARGS)

test-firefox: setup-dev page ## Go the page's main path in Firefox; installs Debian's where there is none.
	@scripts/browser.sh firefox
	@GAITSWARM_REQUIRE_FIREFOX=1 $(BIN)/python -m pytest tests/web/test_firefox.py $(ARGS)

unit: setup-dev ## Run the fast tests only.
	@$(BIN)/python -m pytest $(WORKERS) -m "not slow and not thorough" tests $(ARGS)

lint: lint-code lint-page ## Check style, types, imports between packages and declared dependencies.

lint-code: setup-dev
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(BIN)/deptry .
	@git ls-files | xargs -d '\n' $(BIN)/codespell
	@$(BIN)/deptry --config research/pyproject.toml research/gaitswarm_research

lint-page: setup-dev
	@scripts/npm.sh --if-possible run check
	@scripts/npm.sh --if-possible run lint

format: setup-dev ## Format the code and fix what can be fixed.
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .
	@scripts/npm.sh --if-possible run format

pictures: setup-dev ## Redraw the pictures in docs/images: the page's, two walks, and the concepts.
	@$(BIN)/python -m scripts.concepts
	@$(BIN)/python -m scripts.walks
	@scripts/page.sh
	@GAITSWARM_REQUIRE_PAGE=1 GAITSWARM_SCREENSHOTS=docs/images $(BIN)/python -m pytest -q tests/web/test_pictures.py $(ARGS)

lock: ## Update the lock files after a change of the dependencies in pyproject.toml (needs uv).
	$(COMPILE) pyproject.toml --extra postgres --group build -o requirements/run.lock
	$(COMPILE) pyproject.toml --extra postgres --extra mujoco --extra mcap --extra xacro --group dev --group research -c requirements/run.lock -o requirements/dev.lock
	$(COMPILE) pyproject.toml --extra postgres --extra mujoco --extra xacro --extra cluster --group build -c requirements/run.lock -o requirements/image.lock
	sed -n 's/^compiler = \["\(.*\)"\]/\1/p' pyproject.toml | $(COMPILE) - -o requirements/compiler.lock
	$(COMPILE) --group manual -c requirements/dev.lock -o requirements/manual.lock
	$(COMPILE) --group node -o requirements/node.lock
	$(COMPILE) --group installer -o requirements/installer.lock
	$(COMPILE) --group robots -o requirements/robots.lock

clean: ## Remove the virtual environment and caches; jobs in the user's database stay.
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis .benchmarks build dist api/page api/manual web/node_modules web/openapi.json web/src/api/schema.d.ts
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

setup:
	@scripts/setup.sh run

setup-dev:
	@scripts/setup.sh dev

# The developers' lock has the manual's in it.
setup-manual: setup
	@test -e .venv/installed-dev || scripts/setup.sh manual

page-if-possible: setup
	@scripts/page.sh --if-possible
