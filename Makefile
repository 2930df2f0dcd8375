# Everything goes through these targets; CI runs what `make check` runs.
PYTHON ?= python3
LOWEST_PYTHON ?= python3.10
CONSTRAINTS ?= constraints.txt
BIN := .venv/bin
# Hundreds of commands start in processes of their own, so what they import is compiled but once.
export PYTHONDONTWRITEBYTECODE =

.PHONY: demo test test-lowest coverage check lint types docs container bench faults fuzz clean

# The whole chain in some two minutes on two cores: plays, tests on ten goals, and a table that ends
# with what was learned beside chance. demo/report.html shows every trial.
demo: .venv/ready
	$(BIN)/realbench scene install
	$(BIN)/realbench table evaluation/demo.yaml
	$(BIN)/realbench report evaluation/demo.yaml demo/*.h5 demo/*.json --goals demo/goals-ten-1.npy \
		--out demo/report.html --overwrite

# Tests wait for processes, so one worker more than there are cores keeps these busy.
test test-lowest coverage: export PYTEST_XDIST_AUTO_NUM_WORKERS ?= $(shell $(PYTHON) -c \
	"import os; print(os.cpu_count() + 1)")
test: .venv/ready
	$(BIN)/pytest

# All tests with the lowest versions that pyproject.toml declares; torch takes some gigabytes here.
# The versions: uv pip compile --resolution lowest-direct --python-version 3.10 --extra dev \
#     pyproject.toml -o constraints-lowest.txt
test-lowest:
	$(LOWEST_PYTHON) -m venv .venv-lowest
	.venv-lowest/bin/pip install --quiet --constraint constraints-lowest.txt --editable ".[dev]"
	.venv-lowest/bin/pytest

# Which lines the tests run, processes of commands and controllers among them.
coverage: .venv/ready
	$(BIN)/pytest --cov --cov-report=term:skip-covered

check: lint types docs container test

lint: .venv/ready
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: .venv/ready
	$(BIN)/mypy

# The documentation as a site, in site/; any warning is an error.
docs: .venv/ready
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

# The image of the Dockerfile, built and tried; its steps alone where docker does not run.
container:
	.ci/container.sh

# Compare with the official package: make bench OFFICIAL=folder (a venv in which it still runs).
bench: .venv/ready
	$(BIN)/realbench scene install
	$(BIN)/python evaluation/bench.py $(if $(OFFICIAL),--official $(OFFICIAL))
	$(BIN)/python evaluation/bench_isolation.py
	$(BIN)/python evaluation/bench_planner.py $(if $(RUN),--run $(RUN))
	$(BIN)/python evaluation/bench_reading.py

# Kill plays, tests and tables a hundred times and count what is lost: some fifteen minutes.
faults: .venv/ready
	$(BIN)/python evaluation/faults.py

# Feed the readers broken files for ten minutes.
fuzz: .venv/ready
	$(BIN)/python evaluation/fuzz.py

clean:
	rm -rf .venv .venv-lowest demo build site *.egg-info

.venv/ready: pyproject.toml $(CONSTRAINTS)
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check \
		$(if $(CONSTRAINTS),--constraint $(CONSTRAINTS)) --editable ".[dev]"
	touch $@
