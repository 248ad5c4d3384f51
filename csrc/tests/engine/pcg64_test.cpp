// The numbers are NumPy's: numpy.random.default_rng(seed).
#include "engine/pcg64.hpp"

#include <cstdint>
#include <vector>

#include "tests/check.hpp"

namespace {

using touchdown::engine::Pcg64;

Pcg64 seeded(const std::vector<std::uint32_t>& words) { return Pcg64::seeded(words); }

TEST("raw words are NumPy's") {
  Pcg64 rng = seeded({0});
  CHECK_EQUAL(rng.next64(), 11749869230777074271u);
  CHECK_EQUAL(rng.next64(), 4976686463289251617u);
}

TEST("a seed longer than the pool is mixed in as NumPy does") {
  Pcg64 rng = seeded({7, 0, 0, 0, 4});  // 2**130 + 7
  CHECK_EQUAL(rng.next64(), 15828635904473704460u);
  CHECK_EQUAL(rng.next64(), 10556389509284139321u);
}

TEST("uniform numbers are NumPy's") {
  Pcg64 rng = seeded({42});
  CHECK_EQUAL(rng.uniform(0.0, 1.0), 0.7739560485559633);
  CHECK_EQUAL(rng.uniform(-1.0, 1.0), -0.12224312049589536);
}

TEST("integers are NumPy's, and a spare half word outlives a uniform number") {
  Pcg64 rng = seeded({0});
  for (const std::int64_t expected : {8, 6, 5, 2, 3}) CHECK_EQUAL(rng.integers(0, 10), expected);
  CHECK_EQUAL(rng.has_spare_half, 1u);
  rng.uniform(0.0, 1.0);
  CHECK_EQUAL(rng.integers(0, 10), 0);
}

TEST("integers in a range that rejects half of all draws are NumPy's") {
  Pcg64 rng = seeded({42});
  for (const std::int64_t expected : {942484272, 1843824993, 184566854, 1497586439}) {
    CHECK_EQUAL(rng.integers(0, (std::int64_t{1} << 31) + 1), expected);
  }
}

}  // namespace

int main() { return touchdown::check::run_all(); }
