// The engine's own PCG64 as one of NumPy's bit generators.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/pcg64.hpp"
#include "train/draws.hpp"

namespace touchdown::train {

inline engine::Pcg64 seeded(std::uint32_t seed) {
  return engine::Pcg64::seeded(std::vector<std::uint32_t>{seed});
}

inline BitGenerator bit_generator(engine::Pcg64& rng) {
  return {
      .state = &rng,
      .next_uint64 = [](void* at) { return static_cast<engine::Pcg64*>(at)->next64(); },
      .next_uint32 = [](void* at) { return static_cast<engine::Pcg64*>(at)->next32(); },
      .next_double = [](void* at) { return static_cast<engine::Pcg64*>(at)->uniform(0.0, 1.0); },
      .next_raw = [](void* at) { return static_cast<engine::Pcg64*>(at)->next64(); }};
}

}  // namespace touchdown::train
