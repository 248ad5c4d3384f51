#include "fused/noise.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>

namespace touchdown::fused {
namespace {

// The inverse of the error function in single precision (M. Giles, "Approximating the erfinv
// function", 2011), which XLA uses too.
float inverse_erf(float x) {
  constexpr std::array central{2.81022636e-08f,  3.43273939e-07f, -3.5233877e-06f,
                               -4.39150654e-06f, 0.00021858087f,  -0.00125372503f,
                               -0.00417768164f,  0.246640727f,    1.50140941f};
  constexpr std::array tail{-0.000200214257f, 0.000100950558f, 0.00134934322f,
                            -0.00367342844f,  0.00573950773f,  -0.0076224613f,
                            0.00943887047f,   1.00167406f,     2.83297682f};
  const float w = -std::log1p(-x * x);
  const bool is_central = w < 5.0f;
  const float at = is_central ? w - 2.5f : std::sqrt(w) - 3.0f;
  float sum = 0.0f;
  for (const float coefficient : is_central ? central : tail) sum = sum * at + coefficient;
  return sum * x;
}

}  // namespace

Key derived(Key key, std::uint64_t number) {
  constexpr int rotations[2][4] = {{13, 15, 26, 6}, {17, 29, 16, 24}};
  constexpr std::uint32_t parity = 0x1BD11BDA;
  const std::uint32_t keys[3] = {key.first, key.second, key.first ^ key.second ^ parity};
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

float normal(Key key, std::uint64_t number) {
  const Key words = derived(key, number);
  // 23 random bits behind the exponent of 1 are a number from 1 to 2
  const std::uint32_t mantissa = ((words.first ^ words.second) >> 9) | 0x3f800000;
  const float share = std::bit_cast<float>(mantissa) - 1.0f;
  const float least = std::nextafter(-1.0f, 0.0f);
  return std::sqrt(2.0f) * inverse_erf(std::max(least, share * (1.0f - least) + least));
}

void draw_noise(const Network& network, Key key, std::span<float> noise) {
  std::size_t used = 0;
  const auto draw = [&](const Linear& linear, Key of_layer) {
    for (int i = 0; i < linear.out + linear.in; ++i) {
      const float drawn = normal(of_layer, static_cast<std::uint64_t>(i));
      noise[used++] = std::copysign(std::sqrt(std::fabs(drawn)), drawn);
    }
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
