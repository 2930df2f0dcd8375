# Everything goes through these targets; CI runs what `make check` runs.
PYTHON ?= python3
CONSTRAINTS ?= constraints.txt
BIN := .venv/bin

.PHONY: demo test coverage check lint types bench faults fuzz clean

# The whole chain in about two minutes: play a little, test on five goals, print the score table.
demo: .venv/ready
	$(BIN)/realbench scene install
	mkdir -p demo
	$(BIN)/realbench intrinsic --controller real_r --condition OM --steps 100000 --seed 1 \
		--out demo/run.h5 --overwrite
	$(BIN)/realbench extrinsic --run demo/run.h5 --trials 5 --jobs 2 --pictures demo/pictures \
		--video demo/videos --out demo/score.json --overwrite
	@echo "a picture of each trial is in demo/pictures, a film in demo/videos"

test: .venv/ready
	$(BIN)/pytest

# Which lines the tests run, processes of commands and controllers among them.
coverage: .venv/ready
	$(BIN)/pytest --cov --cov-report=term:skip-covered

check: lint types test

lint: .venv/ready
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: .venv/ready
	$(BIN)/mypy

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
	rm -rf .venv demo build *.egg-info

.venv/ready: pyproject.toml $(CONSTRAINTS)
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check \
		$(if $(CONSTRAINTS),--constraint $(CONSTRAINTS)) --editable ".[dev]"
	touch $@
