#include "fused/noise.hpp"

#include <cstddef>

#include "fused/kernel.hpp"

namespace touchdown::fused {

Key derived(Key key, std::uint64_t number) {
  const auto [first, second] =
      threefry(key, static_cast<std::uint32_t>(number >> 32), static_cast<std::uint32_t>(number));
  return {first, second};
}

void draw_noise(const Network& network, Key key, std::span<float> noise) {
  std::size_t used = 0;
  const auto draw = [&](const Linear& linear, Key of_layer) {
    const auto count = static_cast<std::size_t>(linear.out + linear.in);
    kernel().scaled_normals(of_layer, count, &noise[used]);
    used += count;
  };
  // The layers of touchdown.agents.networks have a key each: linear, normalisation, activation.
  const int per_hidden = network.layer_norm ? 3 : 2;
  const auto number_of = [&](int hidden) {
    return static_cast<std::uint64_t>(hidden * per_hidden);
  };
  for (int i = 0; i < network.num_hidden; ++i) {
    draw(network.hidden[i].linear, derived(key, number_of(i)));
  }
  const Key head = derived(key, number_of(network.num_hidden));
  if (network.dueling) draw(network.value, derived(head, 0));
  draw(network.advantage, network.dueling ? derived(head, 1) : head);
}

}  // namespace touchdown::fused
