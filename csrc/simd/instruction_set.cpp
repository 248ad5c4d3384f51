#include "simd/instruction_set.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace touchdown::simd {

std::string_view name(InstructionSet set) {
  switch (set) {
    case InstructionSet::kAvx512:
      return "avx512";
    case InstructionSet::kAvx2:
      return "avx2";
    case InstructionSet::kBaseline:
      break;
  }
  return "baseline";
}

bool is_available(InstructionSet set) {
#if defined(TOUCHDOWN_X86_KERNELS)
  // What the compiler may use of x86-64-v3 and x86-64-v4.
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                        __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  if (set == InstructionSet::kAvx2) return has_avx2;
  if (set == InstructionSet::kAvx512) {
    return has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
  }
#endif
  return set == InstructionSet::kBaseline;
}

namespace {

InstructionSet choose() {
  const char* const wanted = std::getenv("TOUCHDOWN_SIMD");
  const std::string_view wanted_name = wanted == nullptr ? "" : wanted;
  for (auto set = kInstructionSets.rbegin(); set != kInstructionSets.rend(); ++set) {
    if (is_available(*set) && (wanted_name.empty() || wanted_name == name(*set))) return *set;
  }
  throw std::invalid_argument("TOUCHDOWN_SIMD = '" + std::string(wanted_name) +
                              "': must be avx512, avx2 or baseline, and run on this processor");
}

}  // namespace

InstructionSet chosen() {
  static const InstructionSet set = choose();
  return set;
}

}  // namespace touchdown::simd
