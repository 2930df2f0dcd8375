"""What the package `real_robots` shows, calls and accepts, written down as plain facts.

It runs in two places. In a venv of the official package it makes the fixture of the tests:

    cd "$(mktemp -d)"; VENV/bin/python .../official_calls.py .../tests/data/official_calls.json

Under realbench (`real_bench.compat.install()` first) it tells the same of ours, and the tests
compare the two line by line. So it uses nothing but numpy and `real_robots`.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import inspect
import io
import json
import multiprocessing
import sys
from pathlib import Path
from typing import Any

import numpy as np
import real_robots
from real_robots.envs import Goal, REALRobotEnv
from real_robots.policy import BasePolicy

GOALS_FILE = "goals.npy.npz"
LETTERS = {"joints": "J", "cartesian": "C", "macro_action": "M"}
CASES = [(level, control) for level in ("R1", "R2") for control in LETTERS][:-1]  # R2 has no macros
PLAY_STEPS, TRIAL_STEPS = 5, 4
UPRIGHT = [0.0, 0.0, 0.0, 1.0]
STARTS_AND_ENDS = [
    ("2D", {"cube": [-0.2, 0.4, 0.3213], "tomato": [-0.2, 0.1, 0.3344]}, [-0.1, -0.3, 0.3213]),
    ("3D", {"cube": [-0.1, -0.2, 0.3213], "tomato": [0.0, 0.2, 0.3344]}, [-0.1, 0.25, 0.3213]),
]
MACRO = np.array([[-0.1, 0.2], [-0.1, -0.4]])
JOINTS = np.full(9, 0.3)
POSE, GRIP = np.array([0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0]), np.zeros(2)


def save_goals():
    """Two goals of two objects, with pictures that are easy to tell apart."""
    goals = np.empty(len(STARTS_AND_ENDS), object)
    for k, (challenge, starts, cube_end) in enumerate(STARTS_AND_ENDS):
        goals[k] = Goal(
            initial_state={name: np.array(at + UPRIGHT) for name, at in starts.items()},
            final_state={
                name: np.array((cube_end if name == "cube" else at) + UPRIGHT)
                for name, at in starts.items()
            },
            retina=np.full((240, 320, 3), 10 + k, np.uint8),
            retina_before=np.full((240, 320, 3), 20 + k, np.uint8),
            challenge=challenge,
            mask=np.full((240, 320), 2 + k, np.int32),
        )
    np.savez_compressed(GOALS_FILE, goals)


def kind(value):
    """What a value is: its type, its shape, and whether an array is all zeros."""
    if isinstance(value, dict):
        return {key: kind(inner) for key, inner in value.items()}
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {'seen' if value.any() else 'zeros'}"
    if isinstance(value, list):
        return f"list of {len(value)} {type(value[0]).__name__}"
    if value is None or type(value) in (bool, int, str):
        return repr(value)
    return type(value).__name__


class Probe(BasePolicy):
    """Writes down every call with its arguments."""

    calls: list[Any] = []  # noqa: RUF012
    moments: list[Any] = []  # noqa: RUF012
    action: dict[str, Any] = {}  # noqa: RUF012

    def __init__(self, action_space, observation_space):
        super().__init__(action_space, observation_space)
        self.n_steps = 0
        self.write("__init__")

    def write(self, hook, *arguments):
        """One call; an observation as its number among different ones, and which goal it shows."""
        record = [kind(argument) for argument in arguments]
        for place, argument in enumerate(arguments):
            if isinstance(argument, dict):
                moment = [type(argument).__name__, list(record[place].items())]
                if moment not in self.moments:
                    self.moments.append(moment)
                record[place] = [self.moments.index(moment), int(argument["goal"].max())]
        self.calls.append([hook, *record])

    def step(self, *arguments):
        """The same command always; every third action asks for images."""
        self.write("step", *arguments)
        self.n_steps += 1
        return {**self.action, "render": self.n_steps % 3 == 1}


def recording_hook(name):
    """A hook that writes down that it was called."""
    return lambda self, *arguments: self.write(name, *arguments)


for hook in dir(BasePolicy):
    if hook.startswith(("start_", "end_")):
        setattr(Probe, hook, recording_hook(hook))


class Toy(BasePolicy):
    """Draws commands from all that it sees, so that one other bit gives other commands."""

    hold = 100

    def __init__(self, action_space, observation_space):
        super().__init__(action_space, observation_space)
        self.n_steps = 0
        self.drawn = hashlib.sha256()

    def step(self, observation, reward, done):
        """A command is held for some steps; images are asked for just before a new one."""
        if self.n_steps % self.hold == 0:
            self.action = self.draw(observation)
        self.n_steps += 1
        return {**self.action, "render": self.n_steps % self.hold == 0}

    def draw(self, observation):
        """A random command whose seed is the hash of the observation."""
        digest = hashlib.sha256(repr(kind(observation)).encode())
        for _, value in sorted(observation.items()):
            for part in value.values() if isinstance(value, dict) else [value]:
                if part is not None:
                    digest.update(np.asarray(part).tobytes())
        random = np.random.default_rng(int.from_bytes(digest.digest()[:8], "little"))
        action = {}
        for name, space in sorted(self.action_space.spaces.items()):
            if name != "render":
                action[name] = random.uniform(space.low, space.high)
                self.drawn.update(action[name].tobytes())
        return action

    def end_extrinsic_phase(self):
        """Say what was commanded."""
        type(self).told = self.drawn.hexdigest()


def evaluated(controller, environment, action_type, **lengths):
    """The official evaluation, without what it prints."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return real_robots.evaluate(
            controller,
            environment=environment,
            action_type=action_type,
            n_objects=2,
            visualize=False,
            goals_dataset_path=GOALS_FILE,
            **{"extrinsic_trials": 2, **lengths},
        )


def plain_action(action_type):
    """One command of each way of control."""
    return {
        "joints": {"joint_command": JOINTS},
        "cartesian": {"cartesian_command": POSE, "gripper_command": GRIP},
        "macro_action": {"macro_action": MACRO},
    }[action_type]


def phases(level, action_type, **lengths):
    """Every call of a short evaluation, and what it returns."""
    Probe.action = plain_action(action_type)
    plain = {"intrinsic_timesteps": PLAY_STEPS, "extrinsic_timesteps": TRIAL_STEPS}
    result = evaluated(Probe, level, action_type, **{**plain, **lengths})
    return {"calls": Probe.calls, "moments": Probe.moments, "result": list(result)}


def parity(level, action_type):
    """Commands and scores of a controller that depends on every bit it sees."""
    Toy.hold = {"joints": 100, "cartesian": 200, "macro_action": 1000}[action_type]
    lengths = {"intrinsic_timesteps": 1000, "extrinsic_timesteps": 1000}
    scores, by_class = evaluated(Toy, level, action_type, **lengths)
    return {"commands": Toy.told, "scores": scores, "by_class": by_class}


def odd_actions(action_type):
    """Action dicts that are not quite what is asked for, by name."""
    plain = {**plain_action(action_type), "render": False}
    name, command = next(iter(plain.items()))
    return {
        "as asked": plain,
        "a list": {**plain, name: np.asarray(command).tolist()},
        "float32": {**plain, name: np.float32(command)},
        "None": {**plain, name: None},
        "all None": dict.fromkeys(plain),
        "an unknown key": {**plain, "speed": 1.0},
        "a key of another control": {**plain, "macro_action": MACRO, "joint_command": JOINTS},
        "without render": plain_action(action_type),
        "without the command": {key: value for key, value in plain.items() if key != name},
        "empty": {},
        "NaN": {**plain, name: np.asarray(command) * np.nan},
        "far beyond the limits": {**plain, name: np.asarray(command) * 100},
        "too many numbers": {**plain, name: np.concatenate([np.ravel(command)] * 2)},
        "render array": {**plain, "render": np.array([1], np.int8)},
        "no dict": command,
    }


def actions(action_type):
    """What comes of odd actions."""
    return {name: outcome(action_type, name) for name in odd_actions(action_type)}


def outcome(action_type, name):
    """What comes of one of them: the joints after three steps and more, or the kind of error."""
    env = made(f"REALRobot2020-R2{LETTERS[action_type]}1-v0")
    try:
        env.reset()
        for _ in range(3):
            observation, reward, done, info = env.step(odd_actions(action_type)[name])
    except Exception as error:
        return f"error {type(error).__name__}"
    finally:
        env.close()
    seen = bool(observation["retina"].any())
    return [observation["joint_positions"], seen, kind(reward), kind(done), kind(info)]


def made(name):
    """An environment by its registered id."""
    with contextlib.redirect_stdout(io.StringIO()):
        return gym().make(name)


def gym():
    """The package that environments are registered with."""
    for name in ("gym", "gymnasium"):
        with contextlib.suppress(ImportError):
            return importlib.import_module(name)
    raise ImportError("neither gym nor gymnasium")


def environment():
    """What the methods of an environment give on a short script."""
    env = made("REALRobot2020-R1M2-v0")
    numbers = ("intrinsic_timesteps", "extrinsic_timesteps", "extrinsic_trials", "goal_idx")
    found: dict[str, Any] = {"attributes": {name: getattr(env.unwrapped, name) for name in numbers}}
    env.unwrapped.set_goals_dataset_path(GOALS_FILE)
    found["reset"] = list(kind(env.reset()).items())
    env = env.unwrapped
    found["goal at play"] = [kind(env.goal.retina), kind(env.goal.final_state)]
    found["poses"] = {name: env.get_obj_pose(name).tolist() for name in env.robot.used_objects}
    found["positions"] = {name: env.get_obj_pos(name).tolist() for name in env.robot.used_objects}
    found["objects"] = {k: v.tolist() for k, v in env.get_all_used_objects().items()}
    found["parts"] = {name: env.get_part_pos(name).tolist() for name in ("base", "skin_11")}
    touching = {}
    for step in range(1000):
        last = env.step({"macro_action": MACRO, "render": False})
        if env.get_contacts():
            touching[step] = env.get_contacts()
    found["step"] = [kind(value) for value in last[1:]]
    found["contacts"] = {step: touching[step] for step in list(touching)[::50]}
    found["contacts in all"] = [len(touching), sha256(touching)]
    found["parts after"] = {n: env.get_part_pos(n).tolist() for n in ("finger_00", "base")}
    found["retina"] = [kind(image) for image in env.get_retina()]
    found["dark"] = list(kind(env.get_observation(camera_on=False)).items())
    found["render"] = kind(env.render("rgb_array"))
    found["seed"] = env.seed(3)
    for k in range(2):
        found[f"set_goal {k}"] = list(kind(env.set_goal()).items())
        env.step({"macro_action": None, "render": False})
        goal, score = env.goal, env.evaluateGoal()
        found[f"goal {k}"] = [env.goal_idx, goal.challenge, kind(goal.mask), int(goal.retina.max())]
        found[f"states {k}"] = [
            {name: np.asarray(at).tolist() for name, at in state.items()}
            for state in (goal.initial_state, goal.final_state)
        ]
        found[f"evaluateGoal {k}"] = [score[0], float(score[1]), kind(score)]
    env.reset()
    found["reset keeps the goal"] = [env.goal_idx, env.get_obj_pos("cube").tolist()]
    env.close()
    return found


def touch():
    """What is felt while the hand is pushed into table, shelf and objects."""
    env = made("REALRobot2020-R2C3-v0").unwrapped
    env.reset()
    random = np.random.default_rng(0)
    touches, contacts = [], []
    for _ in range(60):
        pose = random.uniform([-0.25, -0.5, 0.4, -1, -1, -1, -1], [0.25, 0.5, 0.5, 1, 1, 1, 1])
        action = {"cartesian_command": pose, "gripper_command": random.uniform(0, 1.5, 2)}
        for _ in range(50):
            felt = env.step({**action, "render": False})[0]["touch_sensors"]
            touches.append(felt.tolist())
            contacts.append(env.get_contacts())
    env.close()
    names = {name for there in contacts for found in there.values() for name in found}
    return {
        "touches": [int(np.any(touches, axis=1).sum()), sha256(touches)],
        "contacts": [sum(map(bool, contacts)), sorted(names), sha256(contacts)],
    }


def done(goal):
    """At which steps `done` comes where lengths are set by hand, with and without a goal."""
    env = made("REALRobot2020-R2M2-v0").unwrapped
    env.intrinsic_timesteps, env.extrinsic_timesteps = 4, 3
    if goal:
        env.set_goals_dataset_path(GOALS_FILE)
    env.reset()
    if goal:
        env.set_goal()
    found = [env.step({"macro_action": None, "render": False})[2] for _ in range(5)]
    env.close()
    return found


def signatures():
    """Names, arguments and defaults."""
    methods = {n: f for n, f in vars(BasePolicy).items() if inspect.isfunction(f)}
    return {
        "evaluate": arguments(real_robots.evaluate),
        "REALRobotEnv": arguments(REALRobotEnv.__init__),
        "Goal": arguments(Goal.__init__),
        "BasePolicy": {name: arguments(method) for name, method in methods.items()},
    }


def arguments(function):
    """The arguments of a function, with their defaults."""
    return [
        [name, None if argument.default is argument.empty else argument.default]
        for name, argument in inspect.signature(function).parameters.items()
    ]


def ids():
    """The registered environments and what each is made with."""
    module = importlib.import_module(f"{gym().__name__}.envs.registration")
    specs = (
        module.registry.values() if hasattr(module.registry, "values") else module.registry.all()
    )
    return {
        spec.id: getattr(spec, "kwargs", None) or spec._kwargs
        for spec in specs
        if spec.id.startswith("REALRobot")
    }


def spaces(name):
    """The spaces of one environment of two objects."""
    env = made(f"REALRobot2020-{name}2-v0")
    result = {"action": space(env.action_space), "observation": space(env.observation_space)}
    env.close()
    return result


def space(value):
    """A space as plain data."""
    if hasattr(value, "spaces"):
        return {name: space(inner) for name, inner in value.spaces.items()}
    ends = [[repr(float(x)) for x in np.unique(getattr(value, end, []))] for end in ("low", "high")]
    return [type(value).__name__, str(value.dtype), list(value.shape), *ends]


def sha256(data):
    """The hash of plain data."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def text(facts):
    """The facts as JSON, a line each."""
    sections = []
    for section, lines in facts.items():
        result = ",\n".join(
            f"{json.dumps(name)}: {json.dumps(fact)}" for name, fact in lines.items()
        )
        sections.append(f"{json.dumps(section)}: {{\n{result}\n}}")
    return "{\n" + ",\n".join(sections) + "\n}\n"


def alone(function, *arguments, **options):
    """What a function returns in a fresh process: official worlds in one process meet."""
    with multiprocessing.get_context("fork").Pool(1) as pool:
        return pool.apply(function, arguments, options)


if __name__ == "__main__":
    save_goals()
    facts = {
        "signatures": alone(signatures),
        "ids": alone(ids),
        "spaces": {
            name: alone(spaces, name) for name in ("R1J", "R1C", "R1M", "R2J", "R2C", "R2M")
        },
        "phases": {
            **{" ".join(case): alone(phases, *case) for case in CASES},
            "no play": alone(phases, "R2", "joints", intrinsic_timesteps=0),
            "no trials": alone(phases, "R2", "joints", extrinsic_trials=0),
        },
        "actions": {control: alone(actions, control) for control in LETTERS},
        "environment": alone(environment),
        "touch": alone(touch),
        "done": {"play": alone(done, False), "goal": alone(done, True)},
        "parity": {" ".join(case): alone(parity, *case) for case in CASES},
    }
    Path(sys.argv[1]).write_text(text(facts))
