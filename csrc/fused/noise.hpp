// The random numbers of noisy weights (Fortunato et al., 2018): those that `jax.random` draws from
// the same key, so that a run has the same noise on either backend.
#pragma once

#include <cstdint>
#include <span>

#include "fused/network.hpp"

namespace touchdown::fused {

inline constexpr std::uint32_t kThreefryParity = 0x1BD11BDA;

struct Key {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
};

// One of the keys that follow from a key: two words of Threefry-2x32 (Salmon et al., 2011). Both
// `jax.random.fold_in` and `jax.random.split` give this one.
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
