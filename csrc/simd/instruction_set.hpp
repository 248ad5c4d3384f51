// The instruction sets that kernels are compiled for, and the choice of one of them at run time.
//
// A module compiles its kernel's source once per instruction set (see kernel_target.hpp) and picks
// among the results with `Kernels`. Both modules choose in the same way: the widest instruction set
// that the processor has, or the one named by the environment variable TOUCHDOWN_SIMD.
#pragma once

#include <array>
#include <string_view>

namespace touchdown::simd {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

inline constexpr std::array kInstructionSets = {InstructionSet::kBaseline, InstructionSet::kAvx2,
                                                InstructionSet::kAvx512};

// As TOUCHDOWN_SIMD spells it: baseline, avx2 or avx512.
std::string_view name(InstructionSet set);

// Whether this build has the kernels and this processor has the instructions.
bool is_available(InstructionSet set);

// The instruction set that this process uses, chosen at the first call. Throws
// std::invalid_argument if TOUCHDOWN_SIMD names one that is unknown or not available.
InstructionSet chosen();

// A module's kernels, by instruction set.
template <typename Kernel>
struct Kernels {
  const Kernel* baseline;
  const Kernel* avx2 = nullptr;
  const Kernel* avx512 = nullptr;

  // `set` must be available.
  const Kernel& operator[](InstructionSet set) const {
    return set == InstructionSet::kAvx512 ? *avx512
           : set == InstructionSet::kAvx2 ? *avx2
                                          : *baseline;
  }
};

}  // namespace touchdown::simd
