"""Environments of Gymnasium: its own checks, repeatability, and the vector against single ones."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twinrig

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import SyncVectorEnv  # noqa: E402
from twinrig.gym import TwinEnv, TwinVectorEnv  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
TROT = ROOT / "scenarios/trot.toml"

GAIT: dict[str, Any] = {
    "observations": ["body/velocity", "leg/*/hip/position"],
    "actions": {"frequency": (2.0, 4.0), "step_length": (0.05, 0.14)},
    "reward": lambda step: float(step["body/velocity"][0]),
    "signals": ["body/position"],
    "step": 0.1,
    "duration": 0.5,
}

# Random initial phases: the seed decides about the motion.
RANDOM: dict[str, Any] = {**GAIT, "set": {"controller.start": "random"}}

ACTION = [3.0, 0.1]


def make(**changes: Any) -> TwinEnv:
    return TwinEnv(TROT, **{**GAIT, **changes})


def rollout(env: TwinEnv, actions: list[list[float]], **reset: Any) -> list[Any]:
    """Return everything that an episode shows, as lists of bits."""
    observation, info = env.reset(**reset)
    seen: list[Any] = [(observation.tobytes(), info["time"])]
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        position = info["body/position"].tobytes()
        seen.append((observation.tobytes(), reward, terminated, truncated, info["time"], position))
    return seen


def random_actions(env: TwinEnv, count: int, seed: int) -> list[list[float]]:
    env.action_space.seed(seed)
    return [env.action_space.sample().tolist() for _ in range(count)]


@pytest.mark.parametrize("arguments", [GAIT, RANDOM], ids=["gait", "random"])
def test_the_checks_of_gymnasium_pass(arguments: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        # Recommendations: finite observations, actions from -1 to 1.
        warnings.simplefilter("ignore")
        made = gymnasium.make("Twinrig-v0", scenario=TROT, **arguments)
        check_env(made.unwrapped)


def test_an_episode_depends_on_its_seed_and_nothing_else() -> None:
    env = TwinEnv(TROT, **RANDOM)
    actions = random_actions(env, 4, 0)
    first = rollout(env, actions, seed=3)
    assert rollout(env, actions) == first  # Restored.
    assert rollout(env, actions, seed=4) != first  # Built with another seed.
    assert rollout(env, actions, seed=3) == first  # Built again.
    assert rollout(TwinEnv(TROT, **RANDOM), actions, seed=3) == first


def test_drawn_seeds_repeat() -> None:
    episodes = []
    for _ in range(2):
        env = TwinEnv(TROT, **RANDOM, reseed=True)
        episodes.append([rollout(env, [ACTION], seed=1), *(rollout(env, [ACTION]) for _ in "ab")])
    assert episodes[0] == episodes[1]
    assert all(a != b for a, b in itertools.combinations(episodes[0], 2))


def test_steps_are_those_of_the_rig() -> None:
    env = make(reward=lambda step: (step["body/position"] - step.before["body/position"])[0])
    rig = twinrig.Rig(TROT)
    env.reset()
    for k, action in enumerate(random_actions(env, 4, 1)):
        start = rig.read("body/position")[0]
        rig.set_variable("frequency", action[0])
        rig.set_variable("step_length", action[1])
        rig.step(until=(k + 1) / 10)
        observation, reward, *_, info = env.step(action)
        assert observation[:3].tolist() == rig.read("body/velocity").tolist()
        assert reward == rig.read("body/position")[0] - start
        assert info["time"] == rig.now


def test_outputs_of_the_controller_are_replaced_until_the_next_episode() -> None:
    env = make(actions={"leg/LF/*/command": (-1.0, 1.0)}, signals=["body/position", "**/command"])
    free = rollout(env, [[0.1, 0.2]])
    assert env.rig.read(["leg/LF/hip/command", "leg/LF/knee/command"]).tolist() == [0.1, 0.2]
    env.reset()
    env.rig.step(until=0.1)
    assert env.rig.read("leg/LF/hip/command") != 0.1
    assert rollout(env, [[0.1, 0.2]]) == free


def test_falls_are_those_of_the_judge() -> None:
    # The trunk of the trot is lower than these shares of its initial height now and then.
    for share in (0.9, 0.95, 0.99):
        thresholds = {"height": share, "tilt": "60 deg"}
        expect = [{"name": "stays up", "body": {"fall": thresholds}}]
        judged = twinrig.run(TROT, set={"expect": expect}).expectations[0]
        rig = twinrig.Rig(TROT, set={"fall": thresholds, "expect": []})
        while not rig.has_fallen:
            rig.step()
        assert rig.now == judged.first_violation_s


def test_a_fall_terminates_and_the_end_truncates() -> None:
    env = make()
    env.reset()
    ends = [env.step(ACTION)[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(ACTION)
    # Legs that are drawn in at once let the robot fall onto its trunk.
    drop = {"leg/*/knee/command": (0.0, 3.0)}
    env = make(actions=drop, duration=3.0, set={"fall": {"height": 0.9}})
    env.reset()
    for _ in range(30):
        *_, terminated, truncated, info = env.step([3.0] * 4)
        if terminated or truncated:
            break
    assert terminated and info["has_fallen"]
    height = info["body/position"][2]
    env.reset()
    assert height < 0.9 * env.rig.read("body/position")[2]
    env = make(terminated=lambda step: step.time > 0.15)
    env.reset()
    assert [env.step(ACTION)[2] for _ in range(2)] == [False, True]


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_a_vector_has_the_results_of_single_environments(threads: int) -> None:
    def single() -> TwinEnv:
        return TwinEnv(TROT, **RANDOM, reseed=True)

    peer = SyncVectorEnv([single] * 5)
    env = TwinVectorEnv(5, TROT, **RANDOM, reseed=True, threads=threads)
    assert env.metadata["autoreset_mode"] == peer.metadata["autoreset_mode"]
    assert env.observation_space == peer.observation_space
    assert env.action_space == peer.action_space
    peer.action_space.seed(1)

    def equal(ours: Any, theirs: Any) -> None:
        np.testing.assert_array_equal(ours[0], theirs[0])
        for a, b in zip(ours[1:-1], theirs[1:-1], strict=True):
            np.testing.assert_array_equal(a, b)
        assert ours[-1].keys() == theirs[-1].keys()
        for name, values in ours[-1].items():
            np.testing.assert_array_equal(values, theirs[-1][name])

    equal(env.reset(seed=7), peer.reset(seed=7))
    # Two episodes and their automatic resets.
    for _ in range(14):
        actions = peer.action_space.sample()
        equal(env.step(actions), peer.step(actions))


def test_a_batch_has_the_rewards_and_terminations_of_single_steps() -> None:
    def reward(step: Any) -> Any:
        moved = step["body/position"] - step.before["body/position"]
        return moved[..., 0] - step.action[..., 1] * step.time

    def terminated(step: Any) -> Any:
        return step.has_fallen | (step["body/position"][..., 0] > 0.01)

    changes: dict[str, Any] = {**RANDOM, "reward": reward, "terminated": terminated}
    each, batch = (TwinVectorEnv(4, TROT, **changes, batched=batched) for batched in (False, True))
    each.action_space.seed(1)
    for ours, theirs in zip(batch.reset(seed=7)[1].values(), each.reset(seed=7)[1].values()):
        np.testing.assert_array_equal(ours, theirs)
    ended = 0
    for _ in range(14):
        actions = each.action_space.sample()
        (*ours, info), (*theirs, other) = batch.step(actions), each.step(actions)
        ended += int(ours[2].sum())
        for a, b in zip([*ours, *info.values()], [*theirs, *other.values()], strict=True):
            np.testing.assert_array_equal(a, b)
    assert ended > 0
    for wrong, message in ((lambda step: 0.0, "shape"), (lambda step: step.time / 0.0, "finite")):
        env = TwinVectorEnv(2, TROT, **{**GAIT, "reward": wrong}, batched=True)
        env.reset()
        with pytest.raises(ValueError, match=message), np.errstate(divide="ignore"):
            env.step([ACTION] * 2)
        with pytest.raises(gymnasium.error.ResetNeeded):
            env.step([ACTION] * 2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"observations": ["body/positon"]}, "did you mean `body/position`"),
        ({"observations": []}, "at least one"),
        ({"observations": ["leg/*/tail"]}, "no signal .* matches"),
        ({"observations": {"body/rpy": (1.0, 0.0)}}, "below the greatest"),
        ({"observations": {"body/rpy": ([0.0, 0.0], 1.0)}}, "arrays of 3"),
        ({"actions": ["frequncy"]}, "neither a process variable .* nor an output"),
        ({"actions": ["frequency"]}, "no end: give limits"),
        ({"actions": ["leg/LF/hip/command"]}, "give limits"),
        ({"actions": {"duty_factor/fore": (0.3, 1.0)}}, "which .* exceeds"),
        ({"actions": {"frequency": (float("nan"), 1.0)}}, "below the greatest"),
        ({"actions": {}}, "at least one"),
        ({"step": 0.001}, "shorter than the control period"),
        ({"duration": float("nan")}, "above 0 s"),
    ],
)
def test_arguments_are_checked(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make(**changes)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([3.0, float("nan")], "nan for `step_length`"),
        ([5.0, 0.1], "5.0 for `frequency` is not from 2 to 4"),
        ([3.0], r"expected the shape \(2,\), not \(1,\)"),
        ([[3.0, 0.1]], "expected the shape"),
    ],
)
@pytest.mark.parametrize("batch", [None, 2], ids=["single", "vector"])
def test_actions_are_checked(action: list[Any], message: str, batch: int | None) -> None:
    env: Any = make() if batch is None else TwinVectorEnv(batch, TROT, **GAIT)
    env.reset()
    if batch is None:
        with pytest.raises(ValueError, match=message):
            env.step(action)
        env.step(ACTION)
    else:
        with pytest.raises(ValueError, match="action: "):
            env.step([action, action])
        env.step([ACTION, ACTION])


def test_rounding_to_32_bits_is_no_excess() -> None:
    env = make()
    env.reset()
    # The limit 0.14 is a little less than its rounding.
    action = np.array([4.0, 0.14], np.float32)
    assert float(action[1]) > 0.14
    env.step(action)


def test_ranges_of_variables_are_those_that_the_rig_accepts() -> None:
    rig = twinrig.Rig(TROT)
    for name, _, value, low, high in rig.variables():
        assert low <= value <= high
        for limit, outwards in ((low, -np.inf), (high, np.inf)):
            if np.isfinite(limit):
                rig.set_variable(name, limit)
                with pytest.raises(ValueError, match="is not in"):
                    rig.set_variable(name, np.nextafter(limit, outwards))


class Broken:
    """A controller that fails at 0.2 s."""

    ports = (twinrig.Output("leg/LF/hip/command", "rad"),)

    def __init__(self) -> None:
        self.steps = 0

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        self.steps += 1
        if self.steps > 100:
            raise ArithmeticError("broken")


def test_after_an_exception_of_a_part_a_new_episode_can_begin() -> None:
    arguments: dict[str, Any] = {
        "scenario": ROOT / "scenarios/stand.toml",
        "set": {"controller": {"kind": "broken", "period": "2 ms"}, "change": [], "expect": []},
        "controllers": {"broken": Broken},
        "observations": ["body/rpy"],
        "actions": {"leg/LF/hip/command": (-1.0, 1.0)},
        "reward": lambda step: 0.0,
        "step": 0.15,
    }
    env = TwinEnv(**arguments)
    vector = TwinVectorEnv(2, **arguments)
    for _ in range(2):
        env.reset()
        env.step([0.0])
        with pytest.raises(ArithmeticError, match="broken"):
            env.step([0.0])
        with pytest.raises(gymnasium.error.ResetNeeded):
            env.step([0.0])
        vector.reset()
        vector.step([[0.0]] * 2)
        with pytest.raises(ArithmeticError, match="broken"):
            vector.step([[0.0]] * 2)
        with pytest.raises(gymnasium.error.ResetNeeded):
            vector.step([[0.0]] * 2)


def test_threads_are_of_use_for_many_calls() -> None:
    with pytest.raises(ValueError, match="at least 1, not 0"):
        twinrig.Workers(0)
    workers = twinrig.Workers(3)
    for count in (0, 1, 7):
        rigs = [twinrig.Rig(TROT) for _ in range(count)]
        for _ in range(3):
            assert twinrig.step_all(rigs, 0.05, workers=workers) == [None] * count
        assert {rig.fingerprint for rig in rigs} <= {fingerprint_at(0.15)}


def fingerprint_at(time: float) -> str:
    rig = twinrig.Rig(TROT)
    rig.step(until=time)
    return rig.fingerprint


def test_settings_of_an_episode() -> None:
    env = make()
    usual = rollout(env, [ACTION] * 4)
    slippery = rollout(env, [ACTION] * 4, options={"set": {"plant.ground.friction": 0.05}})
    assert slippery != usual
    assert rollout(env, [ACTION] * 4) == usual
    with pytest.raises(ValueError, match="unknown key 'sets'"):
        env.reset(options={"sets": {}})


def distances(env: TwinVectorEnv, episodes: int) -> list[list[float]]:
    """Return the distance that each environment covers in each episode, after `reset`."""
    covered: list[list[float]] = [[] for _ in range(env.num_envs)]
    while len(covered[0]) < episodes:
        _, _, _, truncated, info = env.step([ACTION] * env.num_envs)
        for i in np.flatnonzero(truncated):
            covered[i].append(info["body/position"][i][0])
    return covered


def test_settings_of_a_vector_hold_in_the_episodes_after_an_automatic_reset() -> None:
    env = TwinVectorEnv(2, TROT, **{**GAIT, "duration": 0.4})
    env.reset()
    [usual, _] = distances(env, 2)
    env.reset(options={"set": {"plant.ground.friction": 0.05}})
    [slippery, other] = distances(env, 2)
    assert slippery[0] == slippery[1] != usual[0] == usual[1] and other == slippery
    env.reset(options={"set": [{}, {"plant.ground.friction": 0.05}]})
    assert distances(env, 2) == [usual, slippery]
    env.reset()
    assert distances(env, 1) == [usual[:1]] * 2
    with pytest.raises(ValueError, match="expected 2 dictionaries, not 1"):
        env.reset(options={"set": [{}]})


def test_settings_are_drawn_for_each_episode() -> None:
    drawn: list[float] = []

    def draw(generator: np.random.Generator) -> dict[str, float]:
        drawn.append(float(generator.uniform(0.02, 0.2)))
        return {"plant.ground.friction": drawn[-1]}

    env = TwinVectorEnv(2, TROT, **{**GAIT, "duration": 0.4})
    env.reset(seed=3, options={"set": draw})
    covered = distances(env, 2)
    assert len(set(drawn)) == 4 and len({end for ends in covered for end in ends}) == 4
    single = make(duration=0.4)
    single.reset(seed=3, options={"set": draw})
    assert drawn[-1] == drawn[0]


def test_a_reward_that_is_nan_is_an_error() -> None:
    env = make(reward=lambda step: float("nan"))
    env.reset()
    with pytest.raises(ValueError, match="reward: nan at 0.1 s"):
        env.step(ACTION)


def example() -> Callable[[], None]:
    """Return the first example of the documentation."""
    text = (ROOT / "docs/gymnasium.md").read_text(encoding="utf-8")
    code = text.split("```python\n")[1].split("```")[0]
    names: dict[str, Any] = {}
    exec(compile(code, "docs/gymnasium.md", "exec"), names)
    main: Callable[[], None] = names["main"]
    return main


def test_the_example_of_the_documentation_finds_a_faster_gait(
    capsys: pytest.CaptureFixture[str],
) -> None:
    example()()
    speeds = [float(line.split()[0]) for line in capsys.readouterr().out.splitlines()]
    assert speeds[-1] > speeds[0]
