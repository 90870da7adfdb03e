"""Environments of robots: Gymnasium's own checker, the plant that they step, copies beside each other, mistakes."""

import re
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from tests.small_robots import SLIDE

import nectosome.gym
from nectosome.description import parse_robot
from nectosome.gym import RobotEnv, RobotVectorEnv
from nectosome.solve import PlantBatch, SampledPlant
from nectosome.units import InputError

SIZED = "shape: spheroid\n  length: 100 mm\n  radius: 50 mm"  # so that it can be drawn
SLIDER = parse_robot(re.sub(r"shape: point|  volume.*\n|  inertia.*\n", lambda m: SIZED * (m[0][0] == "s"), SLIDE))
OPTIONS = {
    "robot": SLIDER,
    "commands": {"push": "-2..4 N"},
    "observations": ["body.position", "mean.body.position", "goal.body.position", "command.push"],
    "reward": "-(body.position - goal.body.position) ** 2 - 0.01 * abs(command.push)",
    "goals": {"body.position": "-0.3..0.5 m"},
    "draw": {"m": "1..3 kg", "body.joint.position": "-0.1..0.1 m"},
    "step": "0.2 s",
    "episode": "1 s",
}
NAMES = ("mass", "place", "goal")


def drawn(seed: int) -> dict[str, float]:
    """What a copy with that seed draws first, in the order that is promised: quantities, then goals."""
    u = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed))).uniform(size=3)
    return {"mass": 1 + 2 * u[0], "place": -0.1 + 0.2 * u[1], "goal": -0.3 + 0.8 * u[2]}


def slid(mass: float, place: float, pushes: list[float], dt: float = 0.2) -> np.ndarray:
    """Position of a mass on a spring of 5 N/m and a damper of 4 N s/m after each push held, in closed form."""
    A = np.array([[0.0, 1.0], [-5.0 / mass, -4.0 / mass]])
    values, vectors = np.linalg.eig(A)
    over = (vectors @ np.diag(np.exp(values * dt)) @ np.linalg.inv(vectors)).real
    x, found = np.array([place, 0.0]), []
    for push in pushes:
        rest = np.array([push / 5.0, 0.0])
        x = rest + over @ (x - rest)
        found.append(x[0])
    return np.array(found)


def test_gymnasiums_own_checker_finds_nothing():
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        check_env(gymnasium.make("nectosome/Robot-v0", **OPTIONS, render_mode="rgb_array").unwrapped)
    assert [str(one.message) for one in told if "WARN" in str(one.message)] == []


def test_an_episode_is_the_motion_of_the_robot_in_closed_form():
    env = RobotEnv(**OPTIONS)
    assert (env.action_space.dtype, env.observation_space.dtype) == (np.float64, np.float64)
    first, info = env.reset(seed=7)
    expected = drawn(7)
    assert first == pytest.approx([expected["place"], expected["place"], expected["goal"], 0.0], abs=1e-15)
    assert info == {"time": 0.0, "speed": 0.0}
    actions = [1.0, -1.0, 0.0, 5.0, -0.5]  # 5 counts as 1
    pushes = [4.0, -2.0, 1.0, 4.0, -0.5]
    places = slid(expected["mass"], expected["place"], pushes)
    for k, (action, push, place) in enumerate(zip(actions, pushes, places, strict=True)):
        observed, reward, terminated, truncated, info = env.step(np.array([action]))
        assert observed[0] == pytest.approx(place, abs=2e-5)  # of steps with a relative tolerance of 1e-4
        assert observed[3] == pytest.approx(push, abs=1e-15)
        assert reward == pytest.approx(-((observed[0] - expected["goal"]) ** 2) - 0.01 * abs(push), rel=1e-14)
        assert (terminated, truncated, info["time"]) == (False, k == 4, pytest.approx(0.2 * (k + 1)))
        assert ({*info} - {"time", "speed"}, info.get("reason")) == (
            ({"status", "reason"}, "its time is over") if k == 4 else (set(), None)
        )
    with pytest.raises(InputError, match=r"Call reset\(\) first"):
        env.step(np.array([0.0]))


def test_an_episode_is_the_sampled_plant_and_means_are_those_of_its_instants():
    env = RobotEnv(**OPTIONS, method="implicit", instants=8)
    env.reset(options={"m": "2 kg", "body.joint.position": 0.0})
    plant = SampledPlant(SLIDER, "push", "body.position", 0.2, 8)
    state, _ = plant.start()
    for push in (4.0, -1.0, 2.0):
        state, interval, _ = plant.hold(state, push)
        observed = env.step(np.array([(push - 1.0) / 3.0]))[0]
        assert observed[0] == pytest.approx(state.reading, abs=1e-13)
        assert observed[1] == pytest.approx(np.mean(interval.reading), abs=1e-13)


@pytest.mark.parametrize("together", [False, True])
def test_a_commanded_frequency_keeps_its_phase_in_a_batch(together):
    wagging = parse_robot(
        SLIDE.replace("kind: constant, value: 0 N", "kind: sine, amplitude: 1 N, frequency: 2 Hz").replace(
            "push: body.joint.force.value", "f: body.joint.force.frequency"
        )
    )
    plant = SampledPlant(wagging, "f", "body.position", 0.15, 2)
    batch = PlantBatch(plant, together)
    alone, many = plant.start()[0], batch.start(np.zeros((2, 0)))
    for f in (2.0, 3.5, 1.2, 0.4):
        alone, _, _ = plant.hold(alone, f)
        many, _ = batch.hold(many, np.array([[f], [2.0]]))
        assert np.asarray(many.moving.readings)[0, 0] == pytest.approx(alone.reading, abs=1e-13)
    assert abs(np.asarray(many.moving.readings)[1, 0] - alone.reading) > 1e-3


def test_copies_are_single_environments_and_begin_anew_at_the_next_step():
    n = 3
    many = gymnasium.make_vec("nectosome/Robot-v0", num_envs=n, **OPTIONS)
    singles = [RobotEnv(**OPTIONS) for _ in range(n)]
    assert many.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert many.observation_space.shape == (n, 4)
    seen, _ = many.reset(seed=11)
    alone = np.stack([env.reset(seed=11 + k)[0] for k, env in enumerate(singles)])
    np.testing.assert_allclose(seen, alone, atol=1e-14)
    rng, ended = np.random.default_rng(1), False
    for k in range(1, 13):
        actions = rng.uniform(-1, 1, (n, 1))
        seen, rewards, terminated, truncated, infos = many.step(actions)
        assert (seen in many.observation_space) and not terminated.any()
        assert infos["_speed"].all() and (infos["time"] == pytest.approx(0.2 * (k % 6)))
        if ended:
            alone, own = np.stack([env.reset()[0] for env in singles]), np.zeros(n)
            assert not truncated.any()
        else:
            steps = [env.step(action) for env, action in zip(singles, actions, strict=True)]
            alone, own = np.stack([step[0] for step in steps]), np.array([step[1] for step in steps])
            assert truncated.all() == (k in (5, 11)) and truncated.any() == truncated.all()
        np.testing.assert_allclose(seen, alone, atol=1e-13)
        np.testing.assert_allclose(rewards, own, atol=1e-13)
        ended = bool(truncated.all())


@pytest.mark.parametrize("method", ["implicit", "explicit"])
def test_copies_that_go_together_move_as_those_one_after_another(method):
    plant = SampledPlant(SLIDER, "push", "body.position", 0.2, 2, method=method)
    found = []
    for together in (True, False):
        batch = PlantBatch(plant, together)
        state = batch.start(np.zeros((3, 0)))
        for _ in range(3):
            state, status = batch.hold(state, np.array([[1.0], [-2.0], [0.3]]))
        assert np.asarray(status).tolist() == [0, 0, 0]
        found.append(np.asarray(state.moving.readings))
    np.testing.assert_allclose(*found, atol=1e-13)
    assert np.ptp(found[0]) > 0.1


def test_seeds_and_options_repeat_an_episode():
    env = RobotEnv(**OPTIONS)
    first, again, other = env.reset(seed=3)[0], env.reset(seed=3)[0], env.reset()[0]
    assert (first == again).all() and (first != other).any()
    told, _ = env.reset(options={"goal.body.position": "20 cm", "body.joint.position": 0.05})
    assert told[[0, 2]] == pytest.approx([0.05, 0.2], abs=1e-15)
    many = RobotVectorEnv(num_envs=2, **OPTIONS)
    assert (many.reset(seed=[3, 3])[0] == first).all()
    assert (many.reset(seed=np.int64(3))[0] == many.reset(seed=3)[0]).all()
    assert (many.reset(seed=np.array([3, 3]))[0] == first).all()


def test_what_cannot_be_computed_ends_an_episode_with_its_reason():
    """A force of 1e308 N: the other copies go on, and this one begins anew."""
    wild = OPTIONS | {"commands": {"push": (-1.0, 1e308)}, "reward": "-abs(body.position)"}
    wild["observations"], wild["draw"] = ["body.position"], {}
    many = RobotVectorEnv(num_envs=2, **wild)
    start, _ = many.reset(seed=0)
    seen, rewards, terminated, truncated, infos = many.step(np.array([[1.0], [-1.0]]))
    assert terminated.tolist() == [True, False] and not truncated.any()
    assert infos["status"][0] in ("NOT_FINITE", "STEP_TOO_SMALL", "STEP_LIMIT") and infos["reason"][0]
    assert infos["_status"].tolist() == infos["_reason"].tolist() == [True, False]
    assert seen[0] == start[0] and seen[1] != start[1] and np.isfinite(rewards).all()
    seen, rewards, terminated, _, infos = many.step(np.array([[-1.0], [-1.0]]))
    assert seen[0] == start[0] and rewards[0] == 0.0 and not terminated.any() and "status" not in infos
    one = RobotEnv(**wild)
    one.reset()
    assert one.step(np.array([1.0]))[4]["reason"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"commands": {"psh": "0..1 N"}}, '"psh"'),
        ({"commands": {"push": "0..1 m"}}, "push: "),
        ({"commands": {"push": "1 N"}}, 'push: "1 N" is no range'),
        ({"commands": ["push"]}, "commands: a list is given where names with ranges are expected"),
        ({"commands": {}}, "commands: needs at least one quantity"),
        ({"commands": {"push": "0..1 N", "body.joint.position": "0..1 m"}, "draw": {}}, "says how the robot starts"),
        ({"observations": ["body.positon"]}, 'observations: "body.positon" is no reading, goal or command'),
        ({"observations": ["goal.heading"]}, 'observations: "goal.heading" is no reading'),
        ({"observations": "heading"}, "observations: is to be a list of names"),
        ({"observations": []}, "observations: is to be a list of names"),
        ({"goals": {"hding": "0..1 rad"}}, '"hding" is nothing that can be measured'),
        ({"goals": {"body.position": "0..1 N"}}, "body.position: "),
        ({"draw": {"push": "0..1 N"}}, "body.joint.force.value: is commanded: do not draw it too"),
        ({"draw": {"weight": "0..1 N"}}, '"weight"'),
        ({"episode": "0.5 s"}, "episode: 0.5 s is no whole number of steps of 0.2 s"),
        ({"step": 0.0}, "step: "),
        ({"instants": 0}, 'instants: "0" must be a whole number'),
        ({"method": "rk4"}, 'method: "rk4" is none of auto, implicit, explicit'),
        ({"observations": {"body.position": "0..1 N"}}, "body.position: "),
        ({"observations": {"goal.body.position": "0..1 m"}}, "goal.body.position: has the range of that goal"),
        ({"render_mode": "human"}, 'render_mode: "human" is none of rgb_array'),
        ({"picture": (0, 100)}, 'picture: "0" must be a whole number of at least 16'),
        ({"reward": "True"}, 'reward: "True" is no reading'),
        ({"reward": lambda q: q["hading"]}, 'reward: lambda(): "hading" is no quantity. Did you mean "heading"'),
        ({"reward": "__import__ + 1"}, 'reward: "__import__" is no reading'),
        (
            {"reward": "-speed"},
            'reward: "speed" is no reading, goal or command of this robot. Known: command.push, goal',
        ),
    ],
)
def test_a_wrong_argument_is_told_with_what_there_is(as_users_run, change, said):
    with pytest.raises(InputError) as told:
        RobotEnv(**(OPTIONS | change))
    assert said in str(told.value)


def test_a_reward_may_be_a_function_of_an_episode():
    def reward(q):
        return -((q["body.position"] - q["goal.body.position"]) ** 2) - 0.01 * abs(q["command.push"])

    both = [RobotVectorEnv(num_envs=3, **(OPTIONS | {"reward": one})) for one in (OPTIONS["reward"], reward)]
    for env in both:
        env.reset(seed=5)
    actions = np.array([[0.4], [-0.7], [0.1]])
    (*_, by_text, _, _, _), (*_, by_function, _, _, _) = (env.step(actions) for env in both)
    np.testing.assert_array_equal(by_function, by_text)


def test_an_episode_ends_where_a_reading_leaves_its_range():
    """The robot stays where it was before, so that observations are within their space."""
    spans = {"body.position": "-15..20 cm", "command.push": None}
    options = OPTIONS | {"observations": spans, "goals": {}, "draw": {}, "reward": "body.position", "episode": "8 s"}
    env = RobotEnv(**options)
    assert env.observation_space.low.tolist() == [-0.15, -2.0] and env.observation_space.high.tolist() == [0.2, 4.0]
    observed, _ = env.reset()
    for place in slid(2.0, 0.0, [4.0] * 9):
        before, (observed, reward, terminated, truncated, info) = observed, env.step(np.ones(1))
        assert observed in env.observation_space and not truncated
        if terminated:
            break
        assert place < 0.2
    assert place > 0.2 and observed[0] == before[0] == reward
    assert info["status"] == "OUT_OF_RANGE"
    assert info["reason"] == f"body.position is {place:.4g}, beyond -0.15 to 0.2 (SI)"
    far = RobotEnv(**(options | {"observations": {"body.position": "1..2 m"}}))
    with pytest.raises(InputError, match=r"body.position is 0, beyond 1 to 2"):
        far.reset()


def test_pictures_show_the_robot_as_it_is():
    driven = OPTIONS | {"draw": {}}
    shown = driven | {"picture": (160, 120), "camera": "side", "render_mode": "rgb_array"}
    many = RobotVectorEnv(num_envs=2, **shown)
    many.reset()
    one, other = many.render()
    assert one.shape == (120, 160, 3) and one.dtype == np.uint8 and (one == other).all()
    many.step(np.array([[1.0], [-1.0]]))
    one, other = many.render()
    assert (one != other).any() and one.std() > 5.0
    assert RobotEnv(**driven).render() is None
    with pytest.raises(InputError, match='camera: "behind" is none of side, top'):
        env = RobotEnv(**(shown | {"camera": "behind"}))
        env.reset()
        env.render()


def test_wrong_actions_options_and_rewards_are_told():
    env = RobotEnv(**(OPTIONS | {"reward": "sqrt(body.position - 10)"}))
    with pytest.raises(InputError, match=r"Call reset\(\) first"):
        env.step(np.zeros(1))
    with pytest.raises(InputError, match=r"options.goal: is nothing that is drawn. Drawn are: m, body.joint.position"):
        env.reset(options={"goal": 1.0})
    with pytest.raises(InputError, match=r'options.m: "5 kg" is out of range: it must be in 1 kg..3 kg'):
        env.reset(options={"m": "5 kg"})
    env.reset()
    with pytest.raises(InputError, match=r"action: has the shape \(2,\); \(1,\) is expected"):
        env.step(np.zeros(2))
    with pytest.raises(InputError, match=r"action: has the shape \(\); \(1,\) is expected"):
        env.step(0.0)
    with pytest.raises(InputError, match=r"action: is NaN or infinite"):
        env.step(np.array([np.nan]))
    with pytest.raises(InputError, match=r'reward: "sqrt\(body.position - 10\)" is NaN or infinite at body.position ='):
        env.step(np.zeros(1))
    with pytest.raises(InputError, match="num_envs"):
        RobotVectorEnv(num_envs=0, **OPTIONS)
    many = RobotVectorEnv(num_envs=2, **OPTIONS)
    with pytest.raises(InputError, match="seed: has 1 numbers; 2 are expected"):
        many.reset(seed=[1])
    many.reset()
    with pytest.raises(InputError, match=r"actions: has the shape \(2,\); \(2, 1\) is expected"):
        many.step(np.zeros(2))


def test_without_gymnasium_a_sentence_says_what_to_install(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("nectosome.gym")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(InputError, match=r"the package gymnasium is missing: pip install 'nectosome\[gym\]'"):
        __import__("nectosome.gym")


def test_the_room_is_known():
    assert "nectosome/Robot-v0" in gymnasium.registry and nectosome.gym.__all__
