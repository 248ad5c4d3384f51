#include "fused/noise.hpp"

#include <bit>
#include <cstddef>

#include "fused/kernel.hpp"

namespace touchdown::fused {

Key derived(Key key, std::uint64_t number) {
  constexpr int rotations[2][4] = {{13, 15, 26, 6}, {17, 29, 16, 24}};
  const std::uint32_t keys[3] = {key.first, key.second, key.first ^ key.second ^ kThreefryParity};
  std::uint32_t first = static_cast<std::uint32_t>(number >> 32) + keys[0];
  std::uint32_t second = static_cast<std::uint32_t>(number) + keys[1];
  for (std::uint32_t group = 0; group < 5; ++group) {
    for (const int bits : rotations[group % 2]) {
      first += second;
      second = std::rotl(second, bits) ^ first;
    }
    first += keys[(group + 1) % 3];
    second += keys[(group + 2) % 3] + group + 1;
  }
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
