// Sines and cosines in lanes have the C library's bits. With the argument `all`, every float that
// an angle can be is compared, which takes minutes.
#include "engine/lane_rotation.hpp"

#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <limits>
#include <string_view>
#include <vector>

#include "tests/check.hpp"

namespace {

using namespace touchdown::engine;

using F = Floats<8>;
constexpr std::size_t kLanes = 8;

bool compares_all = false;

// With another C library, the lanes ask it for every angle.
bool is_glibc() {
#if defined(__GLIBC__)
  return true;
#else
  std::cerr << "skipped: not glibc\n";
  return false;
#endif
}

bool same(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

struct Compared {
  std::uint64_t angles = 0;
  std::uint64_t asked = 0;      // of the C library instead
  std::uint64_t different = 0;  // of those that were known

  void compare(F angle) {
    BasicRotation<F> found;
    const auto known = rotate_lanes(angle, found);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      ++angles;
      if (known[lane] == 0) {
        ++asked;
        continue;
      }
      const Rotation right = rotation(angle[lane]);
      different += !same(found.sin[lane], right.sin) || !same(found.cos[lane], right.cos);
    }
  }
};

// Calls `compare` with every float below 120, or with one of a few thousand.
template <typename Compare>
void each_angle(const Compare& compare) {
  const std::uint32_t stride = compares_all ? 1 : 2999;
  const auto end = std::bit_cast<std::uint32_t>(kSmallAngle);
  for (std::uint32_t bits = 0; bits < end; bits += stride * (kLanes / 2)) {
    F angle;
    for (std::uint32_t lane = 0; lane < kLanes / 2; ++lane) {
      const auto x = std::bit_cast<float>(bits + lane * stride);
      angle[2 * lane] = x;
      angle[2 * lane + 1] = -x;
    }
    compare(angle);
  }
}

TEST("sines and cosines in lanes are the C library's, which is seldom asked") {
  if (!is_glibc()) return;
  CHECK(agrees_with_library<F>());
  Compared found;
  each_angle([&](F angle) { found.compare(angle); });
  std::cerr << found.angles << " angles, " << found.asked << " asked, " << found.different
            << " different\n";
  CHECK_EQUAL(found.different, 0u);
  CHECK(found.asked < found.angles / 10'000);
}

TEST("next to the eighths of a turn, where another polynomial begins, they are the same, too") {
  if (!is_glibc()) return;
  Compared found;
  for (int eighths = -152; eighths <= 152; ++eighths) {
    float x = static_cast<float>(eighths * 0.78539816339744831);
    for (int i = 0; i < 20; ++i) x = std::nextafter(x, -FLT_MAX);
    for (int i = 0; i < 6; ++i) {
      F angle;
      for (std::size_t lane = 0; lane < kLanes; ++lane, x = std::nextafter(x, FLT_MAX)) {
        angle[lane] = x;
      }
      found.compare(angle);
    }
  }
  CHECK_EQUAL(found.different, 0u);
}

TEST("the C library is asked about large angles and what is no number, and zeros keep their sign") {
  const float infinity = std::numeric_limits<float>::infinity();
  const F angle{120.0f, -120.0f, 1e6f, -FLT_MAX, infinity, NAN, 0.0f, -0.0f};
  BasicRotation<F> found;
  const auto known = rotate_lanes(angle, found);
  for (std::size_t lane = 0; lane < 6; ++lane) CHECK_EQUAL(known[lane], 0);
  for (std::size_t lane = 6; lane < 8; ++lane) {
    CHECK(known[lane] != 0);
    CHECK(same(found.sin[lane], angle[lane]));
    CHECK(same(found.cos[lane], 1.0f));
  }
}

TEST("a rotation has the bits of each of its lanes, whether the C library was asked or not") {
  const F angle{0.5f, 120.0f, -3.0f, 1e9f, -119.99f, -0.0f, 0x1p-13f, 2000.0f};
  const BasicRotation<F> found = lane_rotation(angle);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Rotation right = rotation(angle[lane]);
    CHECK(same(found.sin[lane], right.sin));
    CHECK(same(found.cos[lane], right.cos));
  }
}

}  // namespace

int main(int argc, char** argv) {
  compares_all = argc > 1 && std::string_view(argv[1]) == "all";
  return touchdown::check::run_all();
}
