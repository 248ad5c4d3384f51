#include "simd/instruction_set.hpp"

#include <cstdlib>
#include <stdexcept>

#include "tests/check.hpp"

namespace {

using namespace touchdown::simd;

TEST("the baseline is always available") { CHECK(is_available(InstructionSet::kBaseline)); }

TEST("an instruction set has all of the narrower ones") {
  CHECK(!is_available(InstructionSet::kAvx512) || is_available(InstructionSet::kAvx2));
}

TEST("a name that is unknown is refused, and may be corrected") {
  setenv("TOUCHDOWN_SIMD", "avx1024", 1);
  CHECK_THROWS(std::invalid_argument, chosen());
  setenv("TOUCHDOWN_SIMD", "baseline", 1);
  CHECK_EQUAL(name(chosen()), "baseline");
}

TEST("the choice holds for the whole process") {
  setenv("TOUCHDOWN_SIMD", "avx2", 1);
  CHECK_EQUAL(name(chosen()), "baseline");
}

TEST("a kernel is found by its instruction set") {
  static constexpr int baseline = 4, avx2 = 8, avx512 = 16;
  constexpr Kernels<int> widths{&baseline, &avx2, &avx512};
  CHECK_EQUAL(widths[InstructionSet::kBaseline], 4);
  CHECK_EQUAL(widths[InstructionSet::kAvx2], 8);
  CHECK_EQUAL(widths[InstructionSet::kAvx512], 16);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
