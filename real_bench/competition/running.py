"""A round from its file to its standings: runs what is missing; no failure stops the others."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from real_bench.competition.entries import Entry, read_entries
from real_bench.competition.round_file import PLAY, TEST, RoundFacts, job_name, result_name
from real_bench.competition.spec import Competition, Round
from real_bench.competition.standing import (
    BROKEN_RULE,
    REFUSED,
    SCORED,
    STATUS_OF,
    WAITING,
    FailureRecord,
    Standing,
)
from real_bench.conditions import Condition
from real_bench.errors import GoalSetError, ResultError
from real_bench.experiments.job_state import JobState, mismatch_error, mismatch_message, state_of
from real_bench.experiments.jobs import Job, PlayJob, ScoringJob
from real_bench.experiments.plan import PendingJobs
from real_bench.experiments.scheduler import Failure, OnProgress, job_scheduler
from real_bench.files.hashing import file_sha256
from real_bench.files.locks import write_lock
from real_bench.files.outputs import check_folder
from real_bench.goal_sets import GoalSet, load_goal_set
from real_bench.goal_sets.secret import opening_of, read_opening
from real_bench.recording import Recording
from real_bench.scoring.one_test import check_one_test
from real_bench.simulation import Scene, load_scene

Broken = dict[str, Failure]
RunJobs = Callable[[PendingJobs, Callable[[OnProgress], Broken]], Broken]


def _run_silently(_: PendingJobs, make: Callable[[OnProgress], Broken]) -> Broken:
    return make(lambda progress: None)


@dataclass(frozen=True)
class RoundRun:
    """A round to be held.

    Attributes:
        competition: what it is part of.
        name: of the round.
        submissions: the folder with all submissions.
        n_at_once: how many jobs at once; None: one per core.
        scheduler: the address of a Dask scheduler; None: processes of this machine.
    """

    competition: Competition
    name: str
    submissions: Path
    n_at_once: int | None = None
    scheduler: str | None = None

    @property
    def round(self) -> Round:
        """The round's description."""
        return self.competition.rounds[self.name]

    @property
    def folder(self) -> Path:
        """The folder of its results, with a folder for each version of a submission."""
        return self.competition.results_folder / self.name

    def hold(
        self, run: RunJobs = _run_silently, *, retry: bool = False, overwrite: bool = False
    ) -> tuple[list[Standing], dict[str, Failure]]:
        """Hold the round, as far as it is not done yet.

        Args:
            run: what runs jobs, where there are any, and shows their progress.
            retry: retry what failed.
            overwrite: replace files that do not fit the round as it is described now.

        Returns:
            The standing of each submission, as others may see it, and what failed through no
            fault of a submission, by name of the job.

        Raises:
            RealBenchError: it cannot be held, or files are not of this round.
            Interrupted: the user stopped it.
        """
        with self.lock_folder():
            entries = self.prepare()
            work = self.missing(entries, retry=retry, overwrite=overwrite)
            broken = run(work, partial(self.make, entries, work)) if len(work) else {}
            return list(map(self._facts.shown, self.settle(entries))), broken

    @contextlib.contextmanager
    def lock_folder(self) -> Iterator[None]:
        """The round's folder, in which no other process holds the same."""
        check_folder(self.folder, make=True)
        with write_lock(self.folder / "round"):
            yield

    def prepare(self) -> list[Entry]:
        """Check scene, goals and recordings, and take in the submissions.

        Raises:
            RealBenchError: one of them cannot be used, or there is no submission.
        """
        self._goals.check_fits(self._scene, self.round.objects)
        self._check_commitment()
        _ = self._given  # can they be used?
        entries = read_entries(
            self.submissions, self.competition.results_folder, self.round.condition
        )
        for entry in entries:
            self._register(entry)
        return entries

    def _check_commitment(self) -> None:
        """Compare the commitment with the goals' opening, where that lies beside them."""
        goals = self.competition.goals(self.name)
        opening = opening_of(goals)
        if not self.round.commitment or not opening.is_file():
            return
        try:
            read_opening(opening).check(self._goals, self.round.commitment)
        except GoalSetError as error:
            raise GoalSetError(
                f"the commitment of round {self.name} is not that of {goals.name}: {error}"
            ) from error

    def missing(
        self, entries: Sequence[Entry], *, retry: bool = False, overwrite: bool = False
    ) -> PendingJobs:
        """The plays and tests that are not done, of submissions that have not failed.

        From now on the round's folder says what the round is. If files are not of this round,
        nothing in it changes.

        Args:
            entries: the submissions.
            retry: retry what failed.
            overwrite: replace files that do not fit the round as it is described now.

        Raises:
            ExperimentError: files are not of this round, and must not be overwritten.
        """
        plays: list[PlayJob] = []
        scorings: list[ScoringJob] = []
        wrong: list[str] = []
        retried: list[Entry] = []
        for entry in entries:
            if entry.folder is None:
                continue
            standing = self._standing(entry)
            if retry and standing.failures:
                standing = entry.standing
                retried.append(entry)
            for play, scoring in self.jobs(entry):
                if {scoring.name, *([play.name] if play else [])} & set(standing.failures):
                    continue
                state = self._state_of_test(play, scoring)
                wrong += self._misfits(entry, scoring, state)
                if state.is_done:
                    continue
                scorings.append(scoring)
                if play is not None:
                    played = state_of(play)
                    wrong += self._misfits(entry, play, played)
                    if not played.is_done:
                        plays.append(play)
        if wrong and not overwrite:
            raise mismatch_error(wrong)
        self._save_facts(entries)
        for entry in retried:
            entry.standing.save(self.home(entry))
        return PendingJobs(tuple(plays), tuple(scorings))

    def make(
        self, entries: Sequence[Entry], work: PendingJobs, update: OnProgress
    ) -> dict[str, Failure]:
        """Run the jobs; returns what failed through no fault of a submission, by name of the job.

        Raises:
            Interrupted: the user stopped it.
        """
        entry_of = {
            job.name: entry
            for entry in entries
            if entry.folder is not None
            for pair in self.jobs(entry)
            for job in pair
            if job is not None
        }

        def keep(job: Job, failure: Failure) -> None:
            if failure.kind in STATUS_OF:
                self._keep(entry_of[job.name], job, failure)

        scheduler = job_scheduler(self.folder, self.n_at_once, self.scheduler)
        failures = scheduler.do(work, update, keep)
        blamed = {name for name, failure in failures.items() if failure.kind in STATUS_OF}
        waited = {job.name for job in work.scorings if job.play in blamed}
        return {name: each for name, each in failures.items() if name not in blamed | waited}

    def settle(self, entries: Sequence[Entry]) -> list[Standing]:
        """The standing of each submission as it is now, kept."""
        standings = []
        for entry in entries:
            standing = self._standing(entry)
            if entry.folder is not None and not standing.failures:
                standing = standing.model_copy(update=self._outcome(entry))
            standing.save(self.home(entry))
            standings.append(standing)
        return standings

    def _outcome(self, entry: Entry) -> dict[str, Any]:
        """What the tests of a submission change of its standing, if none of its jobs failed."""
        states = [self._state_of_test(*pair) for pair in self.jobs(entry)]
        done = all(state.is_done for state in states)
        tests = [state.result for state in states if state.result and not state.mismatches]
        seconds = sum(sum(test.seconds.values()) for test in tests)
        if not done:
            return {"status": WAITING, "detail": "", "seconds": seconds}
        try:
            check_one_test(tests)
        except ResultError as error:
            return {"status": BROKEN_RULE, "detail": str(error), "seconds": seconds}
        return {"status": SCORED, "detail": "", "seconds": seconds}

    def _state_of_test(self, play: PlayJob | None, test: ScoringJob) -> JobState:
        """The state of a test: of the round only with the play that it learned from."""
        state = state_of(test)
        if state.result is None:
            return state
        condition = Condition.parse(self.round.condition)
        reasons = [condition.control_mismatch(state.result.setting.control_version)]
        if play is not None and not play.out.exists():
            reasons.append(f"{play.out.name}, which it learned from, is gone")
        return replace(state, mismatches=(*state.mismatches, *filter(None, reasons)))

    def home(self, entry: Entry) -> Path:
        """The folder of a version of a submission in this round."""
        return self.folder / entry.version

    def jobs(self, entry: Entry) -> list[tuple[PlayJob | None, ScoringJob]]:
        """The jobs of a submission: for each repeat a play, if it plays, and a test."""
        this_round = self.round
        given = self._given
        pairs: list[tuple[PlayJob | None, ScoringJob]] = []
        for number, seed in enumerate(this_round.seeds):
            play = None
            if this_round.play == "own":
                play = PlayJob(
                    **self._shared_fields(
                        entry, seed, job_name(entry.standing.key, PLAY, seed), f"seed{seed}.h5"
                    ),
                    steps=this_round.steps,
                    images=None,
                )
            run, length = (play.out, play.steps) if play else given[number] if given else (None, 0)
            scoring = ScoringJob(
                **self._shared_fields(
                    entry, seed, job_name(entry.standing.key, TEST, seed), result_name(seed)
                ),
                trial_steps=this_round.trial_steps,
                goals=self.competition.goals(self.name),
                n_goals=len(self._goals),
                goals_sha256=self._goals.sha256,
                run=run,
                run_steps=length,
                play=play.name if play else None,
            )
            pairs.append((play, scoring))
        return pairs

    def _shared_fields(self, entry: Entry, seed: int, name: str, file: str) -> dict[str, Any]:
        """What a play and a test have in common."""
        return {
            "name": name,
            "controller": str(entry.folder),
            "condition": self.round.condition,
            "objects": self.round.objects,
            "scene": self.competition.scene_source,
            "scene_name": self._scene.name,
            "seed": seed,
            "settings": {},
            "out": self.home(entry) / file,
            "isolate": True,
            "limits": self.round.limits,
        }

    def _register(self, entry: Entry) -> None:
        """Make its folder and store what it says of itself; a score that is there already stays."""
        home = self.home(entry)
        check_folder(home, make=True)
        known = Standing.load(home)
        if known is not None and known.failures:
            return
        if known is None or known.status != SCORED or entry.standing.status == REFUSED:
            entry.standing.save(home)

    def _standing(self, entry: Entry) -> Standing:
        """Its standing as it was kept, if that is of the round as it is now."""
        known = Standing.load(self.home(entry))
        if known is None:
            return entry.standing
        standing = self._facts.without_old_failures(known)
        return entry.standing if known.failures and not standing.failures else standing

    def _keep(self, entry: Entry, job: Job, failure: Failure) -> None:
        """Keep what ended a submission's job."""
        detail = failure.detail.removeprefix(f"{job.name}: ")
        for place in (f"controller {entry.folder}: ", f"controller {entry.folder} "):
            detail = detail.replace(place, "")
        for folder in (entry.folder, self.home(entry)):
            detail = detail.replace(f"{folder}/", "")
        failed = FailureRecord(
            status=STATUS_OF[failure.kind],
            detail=f"{PLAY if isinstance(job, PlayJob) else TEST}, {detail}",
            seconds=round(failure.seconds, 1),
            task_sha256=self._facts.task_sha256,
        )
        standing = self._standing(entry)
        failures = {**standing.failures, job.name: failed}
        standing.with_failures(failures).save(self.home(entry))

    def _misfits(self, entry: Entry, job: Job, state: JobState) -> list[str]:
        """What in a job's file is not of this round, in a line, if anything."""
        if not state.mismatches:
            return []
        return [f"{entry.version}/{mismatch_message(job.out, state.mismatches)}"]

    def _save_facts(self, entries: Sequence[Entry]) -> None:
        known = RoundFacts.load(self.folder)
        current = {} if known is None else known.current
        current |= {entry.standing.key: entry.version for entry in entries}
        self._facts.model_copy(update={"current": current}).save(self.folder)

    @cached_property
    def _facts(self) -> RoundFacts:
        """The round as it is now, without its submissions."""
        recordings = [file_sha256(path) for path, _ in self._given]
        return RoundFacts.of(self.competition, self.name, self._goals, self._scene, recordings)

    @cached_property
    def _given(self) -> list[tuple[Path, int]]:
        """The recordings to learn from, if given, and how many steps each has.

        Raises RecordingError for one that cannot be read, or does not fit.
        """
        return [(path, self._length(path)) for path in self.competition.recordings(self.name)]

    def _length(self, run: Path) -> int:
        condition = Condition.parse(self.round.condition)
        with Recording(run) as recording:
            recording.header.check_fits(run, condition, self.round.objects, self._scene.sha256)
            return recording.n_steps

    @cached_property
    def _goals(self) -> GoalSet:
        return load_goal_set(self.competition.goals(self.name))

    @cached_property
    def _scene(self) -> Scene:
        return load_scene(self.competition.scene_source)
