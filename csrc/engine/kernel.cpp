#include "engine/kernel.hpp"

#include "engine/revolute_joint.hpp"
#include "engine/shapes.hpp"

namespace touchdown::engine {

namespace baseline {
extern const SolverKernel kKernel;
}
#if defined(TOUCHDOWN_X86_KERNELS)
namespace avx2 {
extern const SolverKernel kKernel;
}
namespace avx512 {
extern const SolverKernel kKernel;
}
#endif

const SolverKernel& kernel(simd::InstructionSet set) {
#if defined(TOUCHDOWN_X86_KERNELS)
  constexpr simd::Kernels<SolverKernel> kernels{&baseline::kKernel, &avx2::kKernel,
                                                &avx512::kKernel};
#else
  constexpr simd::Kernels<SolverKernel> kernels{&baseline::kKernel};
#endif
  return kernels[set];
}

const Model& model() {
  static const Model made{kShapes, kJointDefinitions};
  return made;
}

const SolverKernel& kernel() { return kernel(simd::chosen()); }

}  // namespace touchdown::engine
