import subprocess
import sys

import touchdown


def test_only_the_public_names_are_listed():
    assert dir(touchdown) == sorted(touchdown.__all__)
    assert "train" in dir(touchdown)
    assert "importlib" not in dir(touchdown)


def test_every_public_name_can_be_had():
    for name in touchdown.__all__:
        assert getattr(touchdown, name) is not None


def test_a_listing_loads_nothing():
    code = (
        "import sys, touchdown; dir(touchdown); print({'jax', 'rich', 'numpy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
