#include "simd/flush_denormals.hpp"

#include <limits>

#include "tests/check.hpp"

namespace {

constexpr float kSmallest = std::numeric_limits<float>::min();

// Volatile, so that the processor divides and not the compiler.
float half_of(float value) {
  volatile float of = value;
  of = of / 2.0f;
  return of;
}

#if defined(__SSE2__) || defined(__aarch64__)
TEST("denormal numbers are zeros as long as it lives") {
  CHECK_EQUAL(half_of(kSmallest) > 0.0f, true);
  {
    const touchdown::simd::FlushDenormals flush;
    CHECK_EQUAL(half_of(kSmallest), 0.0f);
    CHECK_EQUAL(half_of(2.0f * kSmallest), kSmallest);
    {
      const touchdown::simd::FlushDenormals again;
      CHECK_EQUAL(half_of(kSmallest), 0.0f);
    }
    CHECK_EQUAL(half_of(kSmallest), 0.0f);
  }
  CHECK_EQUAL(half_of(kSmallest) > 0.0f, true);
}
#endif

}  // namespace

int main() { return touchdown::check::run_all(); }
