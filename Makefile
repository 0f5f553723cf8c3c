# Both `make fit` and `make test` set up .venv themselves. Needs Python 3.11+ with venv, and git.

PYTHON ?= python3
CONFIG ?= conf/nao.yaml
ARGS ?=
PYTEST_ARGS ?=
PIP_ARGS ?=

BIN := .venv/bin
# Modules are compiled when they are first imported; compiling all of them here takes minutes.
PIP_INSTALL = $(BIN)/python -m pip install --no-compile --disable-pip-version-check $(PIP_ARGS)
# Makes the database if there is none yet, and lets it find its artifacts where the folder is now.
OPEN := from mrhubo.config import run_command as run; from mrhubo.runtime.tracking import open_runs as runs; run(runs)
ENOUGH := import sys; sys.exit(sys.version_info < (3, 11))

# Where this is set, every start compiles everything again: half a minute.
unexport PYTHONDONTWRITEBYTECODE

.DELETE_ON_ERROR:
.PHONY: help fit demo test dashboard

help:
	@echo "make fit [CONFIG=conf/nao.yaml] [ARGS='trainer.max_steps=1000']   learn to retarget to a robot"
	@echo "make demo                                                         two robots beside a human, in a browser"
	@echo "make test [PYTEST_ARGS='-k config']                               lint, types, tests and docs"
	@echo "make dashboard                                                    the runs so far, in a browser"
	@echo "PYTHON=python3.12 chooses the interpreter of a new .venv, PIP_ARGS=... goes to pip."

fit: .venv/.core
	$(BIN)/python -m mrhubo.fit --config $(CONFIG) $(ARGS)

demo: .venv/.view
	$(BIN)/python -m mrhubo.show --motion data/motions/boxing.npz --robot nao coman --open $(ARGS)

test: .venv/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@echo "$(BIN)/pyright and $(BIN)/mkdocs build --strict --quiet, beside the tests; what they say comes after them"
	@said=$$(mktemp); trap 'rm -f "$$said"' EXIT; trap 'kill $$beside 2>/dev/null; exit 130' INT TERM; \
	{ $(BIN)/pyright && $(BIN)/mkdocs build --strict --quiet; } > "$$said" 2>&1 & beside=$$!; \
	echo "$(BIN)/python -m pytest -n auto $(PYTEST_ARGS)"; \
	$(BIN)/python -m pytest -n auto $(PYTEST_ARGS); tests=$$?; \
	wait $$beside; beside=$$?; cat "$$said"; exit $$((tests ? tests : beside))

dashboard: export MLFLOW_SERVER_ENABLE_JOB_EXECUTION = false
dashboard: export MLFLOW_DISABLE_TELEMETRY = true
dashboard: .venv/.core
	@$(BIN)/python -c "$(OPEN)"
	$(BIN)/python -m mlflow ui --backend-store-uri sqlite:///mlruns/mlflow.db --host 127.0.0.1 --workers 1

# Stamps: an empty file each, written only when its step is complete, so that an interrupted one is repeated.
.venv/.core: pyproject.toml .venv/.created
	$(PIP_INSTALL) -e .
	@touch $@

.venv/.view: pyproject.toml .venv/.created
	$(PIP_INSTALL) -e '.[view]'
	@touch .venv/.core $@

.venv/.test: pyproject.toml .venv/.created
	$(PIP_INSTALL) -e '.[dev]'
	@touch .venv/.core .venv/.view $@

# An environment that is already there and works is kept. A new one gets the newest pip, which chooses versions in half
# the time of one that is three years old.
.venv/.created:
	@if ! $(BIN)/python -c "import pip; $(ENOUGH)" 2>/dev/null; then \
	    $(PYTHON) -c "$(ENOUGH)" 2>/dev/null || { \
	        echo "mrhubo needs Python 3.11 or newer, and '$(PYTHON)' is not: make PYTHON=/path/to/python3.11" >&2; exit 2; }; \
	    echo "$(PYTHON) -m venv .venv"; \
	    $(PYTHON) -m venv --clear .venv || { \
	        echo "'$(PYTHON) -m venv' failed: install it first (Debian, Ubuntu: apt install python3-venv)" >&2; exit 2; }; \
	    $(PIP_INSTALL) --quiet --upgrade pip || echo "no newer pip; the one that came with Python does too"; \
	fi
	@touch $@
