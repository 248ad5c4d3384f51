// Random numbers from a bit generator of NumPy's, in the order and with the bits of its
// `Generator`.
//
// Sources: NumPy's documentation of `bitgen_t`, the C interface of its bit generators; D. Lemire,
// "Fast Random Integer Generation in an Interval", 2019.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace touchdown::train {

// NumPy's `bitgen_t` (numpy/random/bitgen.h). The state belongs to Python's generator, so that it
// is never copied: what is drawn here is drawn there.
struct BitGenerator {
  void* state;
  std::uint64_t (*next_uint64)(void* state);
  std::uint32_t (*next_uint32)(void* state);
  double (*next_double)(void* state);
  std::uint64_t (*next_raw)(void* state);
};

// One number of `Generator.random(size)`, in [0, 1).
inline double draw_uniform(const BitGenerator& rng) { return rng.next_double(rng.state); }

// One number of `Generator.integers(0, count, size)`, in [0, count), for a count of at least 1.
inline std::uint32_t draw_integer(const BitGenerator& rng, std::uint32_t count) {
  if (count == 1) return 0;  // NumPy draws nothing then
  const auto draw = [&rng, count] { return std::uint64_t{rng.next_uint32(rng.state)} * count; };
  std::uint64_t product = draw();
  if (static_cast<std::uint32_t>(product) < count) {
    const std::uint32_t threshold = -count % count;
    while (static_cast<std::uint32_t>(product) < threshold) product = draw();
  }
  return static_cast<std::uint32_t>(product >> 32);
}

// The numbers from 0 to below their count, in the order of `Generator.permutation(count)`; at most
// 2³² of them. NumPy shuffles with the low bits of a draw, and repeats those that are too large.
inline void draw_permutation(const BitGenerator& rng, std::span<std::int64_t> numbers) {
  std::iota(numbers.begin(), numbers.end(), std::int64_t{0});
  for (std::size_t last = numbers.size(); last-- > 1;) {
    const auto mask = static_cast<std::uint32_t>(std::bit_ceil(last + 1) - 1);
    std::uint32_t drawn = rng.next_uint32(rng.state) & mask;
    while (drawn > last) drawn = rng.next_uint32(rng.state) & mask;
    std::swap(numbers[last], numbers[drawn]);
  }
}

}  // namespace touchdown::train
