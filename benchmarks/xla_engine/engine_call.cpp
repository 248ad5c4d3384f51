// The exact engine as a custom call of XLA, for benchmarks/xla_engine.py alone.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/batch.hpp"
#include "engine/lander.hpp"
#include "xla/ffi/api/ffi.h"

namespace {

namespace ffi = xla::ffi;
using namespace touchdown::engine;

// Landers that fly on for ever: after an episode's last step the next one begins.
struct Flock {
  Flock(std::size_t count, std::size_t threads)
      : landers(count, make_lander({})),
        throttles(count),
        tasks(count, Task::kBegin),
        rewards(count),
        workspaces(threads),
        workers(threads) {}

  std::vector<Lander> landers;
  std::vector<Throttle> throttles;
  std::vector<Task> tasks;
  std::vector<double> rewards;
  std::vector<Workspace> workspaces;
  Workers workers;
};

ffi::Error advance(std::int64_t address, ffi::Buffer<ffi::S32> actions,
                   ffi::ResultBuffer<ffi::F32> observations, ffi::ResultBuffer<ffi::F32> rewards,
                   ffi::ResultBuffer<ffi::PRED> terminated) {
  Flock& flock = *reinterpret_cast<Flock*>(address);
  for (std::size_t i = 0; i < flock.landers.size(); ++i) {
    flock.throttles[i] = discrete_throttle(actions.typed_data()[i]);
  }
  const Results results{observations->typed_data(), flock.rewards.data(), terminated->typed_data()};
  step(flock.landers, flock.throttles, flock.tasks, results, flock.workspaces, flock.workers);
  std::copy(flock.rewards.begin(), flock.rewards.end(), rewards->typed_data());
  std::transform(results.terminated, results.terminated + flock.tasks.size(), flock.tasks.begin(),
                 [](bool ended) { return ended ? Task::kBegin : Task::kStep; });
  return ffi::Error::Success();
}

}  // namespace

extern "C" {

void* make_flock(std::int64_t count, std::int64_t threads) {
  auto* const flock = new Flock(static_cast<std::size_t>(count), static_cast<std::size_t>(threads));
  for (std::uint32_t i = 0; i < flock->landers.size(); ++i) {
    seed(flock->landers[i], std::vector<std::uint32_t>{i});
  }
  return flock;
}

XLA_FFI_DEFINE_HANDLER_SYMBOL(advance_flock, advance,
                              ffi::Ffi::Bind()
                                  .Attr<std::int64_t>("address")
                                  .Arg<ffi::Buffer<ffi::S32>>()
                                  .Ret<ffi::Buffer<ffi::F32>>()
                                  .Ret<ffi::Buffer<ffi::F32>>()
                                  .Ret<ffi::Buffer<ffi::PRED>>());
}
