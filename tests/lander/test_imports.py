"""The lander stands alone: it needs numpy and gymnasium only."""

import subprocess
import sys

import pytest

HEAVY = {"equinox", "jax", "matplotlib", "optax", "rich", "safetensors", "scipy"}


@pytest.mark.parametrize("engine", ["exact", "gymnasium"])
def test_a_lander_flies_without_the_libraries_for_learning_and_drawing(engine: str):
    code = (
        "import sys\n"
        "from touchdown import lander\n"
        f"for env in (lander.make(engine={engine!r}), lander.make_vec(2, engine={engine!r})):\n"
        "    env.reset(seed=0)\n"
        "    env.step(env.action_space.sample())\n"
        "    env.close()\n"
        "print(*sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert HEAVY & set(done.stdout.split()) == set()
