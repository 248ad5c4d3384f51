// The browser's sine, cosine and hyperbolic tangent against this C library's.
//
// They are to be equal where that is glibc 2.28 or later on a processor with fused multiply-add
// (tanh: before 2.39); elsewhere only the arithmetic below them is tested. With the argument `all`,
// every float that can occur is compared, which takes an hour.
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <random>
#include <string_view>

#if defined(__GLIBC__)
#include <gnu/libc-version.h>

#include <cstdlib>
#endif

#include "tests/check.hpp"
#include "web/libm/double_sine.hpp"
#include "web/libm/error_free.hpp"
#include "web/libm/hyperbolic_tangent.hpp"
#include "web/libm/single_sine.hpp"

namespace {

namespace web = touchdown::web;

bool compares_all = false;

// The minor version of a glibc 2 on a processor with fused multiply-add, or 0.
int glibc_with_fma() {
#if defined(__GLIBC__) && defined(__x86_64__)
  if (!__builtin_cpu_supports("fma") || !__builtin_cpu_supports("avx2")) return 0;
  const std::string_view version = gnu_get_libc_version();
  return version.substr(0, 2) == "2." ? std::atoi(version.substr(2).data()) : 0;
#else
  return 0;
#endif
}

template <typename Bits, typename Number>
bool same(Number a, Number b) {
  return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b) || (std::isnan(a) && std::isnan(b));
}
bool same(float a, float b) { return same<std::uint32_t>(a, b); }
bool same(double a, double b) { return same<std::uint64_t>(a, b); }

// How many of the arguments give other bits than the C library, for sine and for cosine.
struct Differences {
  std::uint64_t compared = 0;
  std::uint64_t sines = 0;
  std::uint64_t cosines = 0;

  template <typename Number>
  void compare(Number x) {
    ++compared;
    sines += !same(std::sin(x), web::sine(x));
    cosines += !same(std::cos(x), web::cosine(x));
  }
};

void check_none(const Differences& found, const char* what) {
  std::cerr << what << ": " << found.compared << " compared, sine differs for " << found.sines
            << ", cosine for " << found.cosines << '\n';
  CHECK_EQUAL(found.sines, 0u);
  CHECK_EQUAL(found.cosines, 0u);
}

// Every float, or one in a few thousand.
template <typename Compare>
void each_float(const Compare& compare) {
  const std::uint64_t stride = compares_all ? 1 : 2999;
  for (std::uint64_t bits = 0; bits < std::uint64_t{1} << 32; bits += stride) {
    compare(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  }
}

// The floats next to multiples of an eighth of a turn: there the reduction loses most digits, and
// another branch begins.
template <typename Compare>
void each_hard_float(const Compare& compare) {
  for (int eighths = -5000; eighths <= 5000; ++eighths) {
    float x = static_cast<float>(eighths * 0.78539816339744831);
    for (int i = 0; i < 20; ++i) x = std::nextafter(x, -FLT_MAX);
    for (int i = 0; i < 41; ++i, x = std::nextafter(x, FLT_MAX)) compare(x);
  }
  for (const float edge : {0x1p-12f, 0.126f, 0.75f, 0.855469f, 2.426265f, 120.0f}) {
    float x = edge;
    for (int i = 0; i < 20000; ++i) x = std::nextafter(x, 0.0f);
    for (int i = 0; i < 40000; ++i, x = std::nextafter(x, FLT_MAX)) {
      compare(x);
      compare(-x);
    }
  }
}

// An angle in radians that a lander can have: a body turns by a quarter turn in a step at most.
bool is_angle(float x) { return std::fabs(x) < 4096.0f; }

TEST("a fused multiply-add is rounded once") {
  std::mt19937_64 rng(0);
  std::uniform_real_distribution<double> factor(-4.0, 4.0), exponent(-60.0, 60.0);
  for (int i = 0; i < 300'000; ++i) {
    const double a = factor(rng), b = factor(rng);
    // Some sums nearly cancel, some need all the digits of the product.
    const double c = i % 3 == 0   ? -a * b
                     : i % 3 == 1 ? factor(rng) * std::exp2(exponent(rng))
                                  : factor(rng);
    CHECK_EQUAL(web::fused(a, b, c), std::fma(a, b, c));
  }
}

TEST("sine and cosine of floats are the C library's") {
  if (glibc_with_fma() < 28) return;
  Differences found;
  const auto compare = [&](float x) { found.compare(x); };
  each_float(compare);
  each_hard_float(compare);
  check_none(found, "floats");
}

TEST("sine and cosine of a lander's angle are the C library's in double precision") {
  if (glibc_with_fma() < 28) return;
  Differences found;
  const auto compare = [&](float x) {
    if (is_angle(x)) found.compare(static_cast<double>(x));
  };
  each_float(compare);
  each_hard_float(compare);
  check_none(found, "a lander's angles");
}

TEST("sine and cosine of doubles are the C library's") {
  if (glibc_with_fma() < 28) return;
  std::mt19937_64 rng(1);
  Differences found;
  const int count = compares_all ? 20'000'000 : 200'000;
  for (const double most : {0.1, 0.9, 2.5, 30.0, 1e4, 1e8}) {
    std::uniform_real_distribution<double> angle(-most, most);
    for (int i = 0; i < count; ++i) found.compare(angle(rng));
  }
  check_none(found, "doubles");
}

TEST("a gust is the C library's, whatever its number") {
  const int version = glibc_with_fma();
  if (version < 28 || version > 38) return;
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> within(-2.0, 2.0), beyond(-25.0, 25.0);
  const int count = compares_all ? 100'000'000 : 200'000;
  for (int i = 0; i < count; ++i) {
    const double x = i % 8 == 0 ? beyond(rng) : within(rng);
    if (!same(web::hyperbolic_tangent(x), std::tanh(x))) CHECK_EQUAL(x, 0.0);
  }
  for (const double x : {0.0, -0.0, 1e-20, 0x1p-55, 0.25, 1.0, -1.0, 21.99, 22.0, 700.0}) {
    CHECK(same(web::hyperbolic_tangent(x), std::tanh(x)));
  }
  // An episode's gusts begin at a number from -9999 to 9998.
  for (int number = -9999; number < 9999 + 10'000; ++number) {
    const double slow = 0.02 * number, fast = 3.141592653589793 * 0.01 * number;
    CHECK(same(web::hyperbolic_tangent(web::sine(slow) + web::sine(fast)),
               std::tanh(std::sin(slow) + std::sin(fast))));
  }
}

TEST("what has no sine is not a number") {
  for (const double x : {HUGE_VAL, -HUGE_VAL, std::nan("")}) {
    CHECK(std::isnan(web::sine(x)) && std::isnan(web::cosine(x)));
    CHECK(std::isnan(web::sine(static_cast<float>(x))));
    CHECK(std::isnan(web::cosine(static_cast<float>(x))));
  }
  CHECK(std::isnan(web::hyperbolic_tangent(std::nan(""))));
}

}  // namespace

int main(int count, char** arguments) {
  compares_all = count > 1 && std::string_view(arguments[1]) == "all";
  return touchdown::check::run_all();
}
