"""Initial parameters of a Q-network, in NumPy, bit for bit those that `QNetwork.init` gives.

A network that the fused kernel computes needs no JAX, which takes longer to load than a short
training takes. A seed must give the same network on either backend, so this is JAX's random
generator, Threefry-2x32 (Salmon et al., 2011), with the keys and numbers of `jax.random`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.layout import Layout

Key = tuple[np.uint32, np.uint32]
_Words = NDArray[np.uint32]

_ROTATIONS = ((13, 15, 26, 6), (17, 29, 16, 24))
_PARITY = np.uint32(0x1BD11BDA)


def initial_params(layout: Layout, seed: int) -> NDArray[np.float32]:
    """Parameters of a fresh network, [P]: uniform in ±1/√(fan in), as `QNetwork.init` says.

    Args:
        layout: the network's parameters.
        seed: from 0 to 2³² − 1.
    """
    sizes = (layout.observation_size, *layout.config.hidden_sizes)
    *keys, head = _split((np.uint32(0), np.uint32(seed)), len(sizes))
    linears = {f"layers.{number}": key for number, key in enumerate(keys)}
    if layout.config.dueling:
        linears["value"], linears["advantage"] = _split(head, 2)
    else:
        linears[f"layers.{len(keys)}"] = head
    made = {name: _constant(layout, name) for name in layout.shapes}
    for name, key in linears.items():
        weight, bias = f"{name}.weight", f"{name}.bias"
        weight_key, bias_key = _split(key, 2)
        limit = 1 / math.sqrt(layout.shapes[weight][1])
        made[weight] = _uniform(weight_key, layout.shapes[weight], limit)
        made[bias] = _uniform(bias_key, layout.shapes[bias], limit)
    return layout.join(made)


def _constant(layout: Layout, name: str) -> NDArray[np.float32]:
    """The initial values of parameters that are not random."""
    shape, value = layout.shapes[name], 0.0
    group, _, kind = name.rpartition(".")
    if kind.endswith("_sigma"):
        value = layout.config.noisy_sigma / math.sqrt(layout.shapes[f"{group}.weight"][1])
    elif group.startswith("norms") and kind == "weight":
        value = 1.0
    return np.full(shape, value, np.float32)


def _split(key: Key, count: int) -> list[Key]:
    """Keys that are independent of each other, as `jax.random.split` makes them."""
    first, second = _threefry(key, count)
    return list(zip(first, second, strict=True))


def _uniform(key: Key, shape: tuple[int, ...], limit: float) -> NDArray[np.float32]:
    """Uniform numbers from -limit to limit, as `jax.random.uniform` makes them."""
    first, second = _threefry(key, math.prod(shape))
    # 23 random bits behind the exponent of 1 are a number from 1 to 2
    mantissa = ((first ^ second) >> np.uint32(9)) | np.float32(1).view(np.uint32)
    share = mantissa.view(np.float32).astype(np.double) - 1
    low, high = np.double(np.float32(-limit)), np.double(np.float32(limit))
    # exact in double precision and rounded once, as where the processor fuses product and sum
    return np.maximum(low, share * (high - low) + low).astype(np.float32).reshape(shape)


def _threefry(key: Key, count: int) -> tuple[_Words, _Words]:
    """Two random words of each of the first `count` numbers, by 20 rounds of Threefry-2x32."""
    keys = (*key, key[0] ^ key[1] ^ _PARITY)
    numbers = np.arange(count, dtype=np.uint64)
    first = (numbers >> np.uint64(32)).astype(np.uint32) + keys[0]
    second = numbers.astype(np.uint32) + keys[1]
    for group in range(5):
        for bits in _ROTATIONS[group % 2]:
            first += second
            second = (second << np.uint32(bits)) | (second >> np.uint32(32 - bits))
            second ^= first
        first += keys[(group + 1) % 3]
        second += keys[(group + 2) % 3]
        second += np.uint32(group + 1)
    return first, second
