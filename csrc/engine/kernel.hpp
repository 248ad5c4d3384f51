// The velocity iterations of many environments at once, and the motion that follows from them, by
// the kernel of the instruction set in use.
//
// Box2D: most of b2Island::Solve, with its hottest loop. Box2D runs it for one world at a time.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "engine/body.hpp"
#include "engine/joint_position_solver.hpp"
#include "engine/motion.hpp"
#include "engine/settings.hpp"
#include "engine/shape.hpp"
#include "engine/velocity_constraints.hpp"
#include "simd/instruction_set.hpp"

namespace touchdown::engine {

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

// The parts of a lander that move after the velocity iterations.
struct Moving {
  VelocityConstraints* constraints;
  std::array<Body, kNumBodies>* bodies;
  int iterations;  // position iterations done by `integrate`: one in flight, none otherwise
  bool corrected;  // whether they were enough
};

// What all landers are made of. The kernels are told, as they would otherwise make their own.
struct Model {
  const std::array<Shape, kNumBodies>& shapes;
  const std::array<JointDefinition, kNumLegs>& joints;
};
const Model& model();

// The order of the joints' constraints, unless a leg sleeps.
inline constexpr std::array<int, kNumLegs> kUsualLegs{kLeg1, kLeg0};

// The functions take at least one. They are fastest where neighbours have the same contacts and the
// same joints at a limit, and `lanes` of them share one pass.
struct SolverKernel {
  std::size_t lanes;
  // Warm starts the joints, and runs all velocity iterations.
  void (*solve)(std::span<VelocityConstraints* const> items, const Model& model);
  // Warm starts the joints, and runs the first two windows. Sets `done` for those that turn out to
  // cycle: all of their iterations are then complete.
  void (*start)(std::span<VelocityConstraints* const> items, std::span<bool> done,
                const Model& model);
  // Runs the iterations that follow `start`.
  void (*resume)(std::span<VelocityConstraints* const> items, const Model& model);
  // Integrates the velocities, and runs the first position iteration of those in flight.
  void (*integrate)(std::span<Moving> items, const Model& model);
  // Moves the bodies to their poses, and counts how long they have been at rest.
  void (*place)(std::span<Moving> items, const Model& model);
};

const SolverKernel& kernel(simd::InstructionSet set);  // `set` must be available
const SolverKernel& kernel();                          // of the instruction set that is chosen

}  // namespace touchdown::engine
