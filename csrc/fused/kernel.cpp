#include "fused/kernel.hpp"

namespace touchdown::fused {

namespace baseline {
extern const Kernel kKernel;
}
#if defined(TOUCHDOWN_X86_KERNELS)
namespace avx2 {
extern const Kernel kKernel;
}
namespace avx512 {
extern const Kernel kKernel;
}
#endif

const Kernel& kernel(simd::InstructionSet set) {
#if defined(TOUCHDOWN_X86_KERNELS)
  constexpr simd::Kernels<Kernel> kernels{&baseline::kKernel, &avx2::kKernel, &avx512::kKernel};
#else
  constexpr simd::Kernels<Kernel> kernels{&baseline::kKernel};
#endif
  return kernels[set];
}

const Kernel& kernel() { return kernel(simd::chosen()); }

}  // namespace touchdown::fused
