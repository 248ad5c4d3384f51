// The numbers are NumPy's: numpy.random.default_rng(seed).
#include "train/draws.hpp"

#include <array>
#include <cstdint>

#include "tests/check.hpp"
#include "tests/train/drawn.hpp"

namespace touchdown::train {
namespace {

TEST("uniform numbers are NumPy's") {
  engine::Pcg64 rng = seeded(42);
  CHECK_EQUAL(draw_uniform(bit_generator(rng)), 0.7739560485559633);
}

TEST("integers are NumPy's") {
  engine::Pcg64 rng = seeded(0);
  for (const std::uint32_t expected : {8u, 6u, 5u, 2u, 3u}) {
    CHECK_EQUAL(draw_integer(bit_generator(rng), 10), expected);
  }
}

TEST("a range of one number draws nothing") {
  engine::Pcg64 rng = seeded(0);
  CHECK_EQUAL(draw_integer(bit_generator(rng), 1), 0u);
  CHECK_EQUAL(rng.next64(), seeded(0).next64());
}

TEST("permutations are NumPy's") {
  engine::Pcg64 rng = seeded(0);
  std::array<std::int64_t, 5> numbers{};
  draw_permutation(bit_generator(rng), numbers);
  CHECK(numbers == (std::array<std::int64_t, 5>{2, 4, 3, 0, 1}));
}

}  // namespace
}  // namespace touchdown::train

int main() { return touchdown::check::run_all(); }
