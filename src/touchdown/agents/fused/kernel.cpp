// Which instruction set computes, decided when it is first asked for.
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>

#include "network.hpp"

namespace touchdown::fused {

extern const Kernel k_baseline;
#if defined(TOUCHDOWN_X86_KERNELS)
extern const Kernel k_avx2;
extern const Kernel k_avx512;
#endif

namespace {

const Kernel& chosen() {
  const char* wanted = std::getenv("TOUCHDOWN_SIMD");
  const std::string_view name = wanted == nullptr ? "" : wanted;
  if (name == k_baseline.name) return k_baseline;
#if defined(TOUCHDOWN_X86_KERNELS)
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (has_avx512 && (name.empty() || name == k_avx512.name)) return k_avx512;
  if (has_avx2 && (name.empty() || name == k_avx2.name)) return k_avx2;
#endif
  if (name.empty()) return k_baseline;
  throw std::invalid_argument("TOUCHDOWN_SIMD = '" + std::string(name) +
                              "': must be avx512, avx2 or baseline, and run on this processor");
}

}  // namespace

const Kernel& kernel() {
  static const Kernel& kernel = chosen();
  return kernel;
}

}  // namespace touchdown::fused
