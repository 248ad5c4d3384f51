// The random numbers of noisy weights (Fortunato et al., 2018): those that `jax.random` draws from
// the same key, so that a run has the same noise on either backend.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "fused/network.hpp"

namespace touchdown::fused {

struct Key {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
};

// Threefry-2x32 (Salmon et al., 2011) of two words, or of two vectors of them.
template <typename Word>
inline std::pair<Word, Word> threefry(Key key, Word first, Word second) {
  constexpr int rotations[2][4] = {{13, 15, 26, 6}, {17, 29, 16, 24}};
  constexpr std::uint32_t parity = 0x1BD11BDA;
  const std::uint32_t keys[3] = {key.first, key.second, key.first ^ key.second ^ parity};
  first += keys[0];
  second += keys[1];
  for (std::uint32_t group = 0; group < 5; ++group) {
    for (const int bits : rotations[group % 2]) {
      first += second;
      second = (second << bits | second >> (32 - bits)) ^ first;
    }
    first += keys[(group + 1) % 3];
    second += keys[(group + 2) % 3] + group + 1;
  }
  return {first, second};
}

// One of the keys that follow from a key. Both `jax.random.fold_in` and `jax.random.split` give
// this one.
Key derived(Key key, std::uint64_t number);

// Where a noisy network's samples come from; touchdown.agents.learners.noise.NoiseSource.
struct NoiseSource {
  std::uint32_t seed = 0;
  std::uint32_t purpose = 0;
  std::uint32_t number = 0;  // of previous updates or environment steps

  Key key() const { return derived(derived({0, seed}, purpose), number); }
};

// f(ε) = sgn(ε)·√|ε| for the outputs and then the inputs of each linear layer, in the order of the
// parameters; [num_noise].
void draw_noise(const Network& network, Key key, std::span<float> noise);

}  // namespace touchdown::fused
