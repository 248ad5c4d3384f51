#include "fused/kernel.hpp"

namespace touchdown::fused {

namespace baseline {
extern const NetworkKernel kKernel;
}
#if defined(TOUCHDOWN_X86_KERNELS)
namespace avx2 {
extern const NetworkKernel kKernel;
}
namespace avx512 {
extern const NetworkKernel kKernel;
}
#endif

const NetworkKernel& kernel(simd::InstructionSet set) {
#if defined(TOUCHDOWN_X86_KERNELS)
  constexpr simd::Kernels<NetworkKernel> kernels{&baseline::kKernel, &avx2::kKernel,
                                                 &avx512::kKernel};
#else
  constexpr simd::Kernels<NetworkKernel> kernels{&baseline::kKernel};
#endif
  return kernels[set];
}

const NetworkKernel& kernel() { return kernel(simd::chosen()); }

}  // namespace touchdown::fused
