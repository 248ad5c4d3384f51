// The velocity iterations of many environments at once, by the kernel of the instruction set in
// use.
//
// Box2D: the velocity iterations of b2Island::Solve, its hottest loop. Box2D runs them for one
// world at a time.
#pragma once

#include <cstddef>
#include <span>

#include "engine/settings.hpp"
#include "engine/velocity_constraints.hpp"
#include "simd/instruction_set.hpp"

namespace touchdown::engine {

using VelocityConstraints = BasicVelocityConstraints<float>;

// In flight with both legs at a limit, the iterations soon run in a cycle, mostly of length one,
// two or four: what an iteration reads and changes has the same bits as that many iterations
// before. The kernel checks for it after two windows whose length is a multiple of those. Where a
// window has changed nothing, all further iterations are done but for the joints' accumulated point
// impulses, which no iteration reads: the last window's impulses are added to them again until the
// end.
inline constexpr int kWindow = 12;
inline constexpr int kRepeats = kVelocityIterations / kWindow - 2;
static_assert((kRepeats + 2) * kWindow == kVelocityIterations);

inline bool may_cycle(const VelocityConstraints& constraints) {
  return constraints.num_contacts == 0 && constraints.joints[0].at_limit &&
         constraints.joints[1].at_limit;
}

// The functions take at least one. They are fastest where neighbours have the same contacts and the
// same joints at a limit, and `lanes` of them share one pass.
struct SolverKernel {
  std::size_t lanes;
  // Runs `iterations` velocity iterations.
  void (*iterate)(std::span<VelocityConstraints* const> items, int iterations);
  // Runs the first two windows. Sets `done` for those that turn out to cycle: all of their
  // iterations are then complete.
  void (*start)(std::span<VelocityConstraints* const> items, std::span<bool> done);
};

const SolverKernel& kernel(simd::InstructionSet set);  // `set` must be available
const SolverKernel& kernel();                          // of the instruction set that is chosen

}  // namespace touchdown::engine
