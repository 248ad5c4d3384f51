// Waiting for an atomic value without giving up the core.
#pragma once

#include <atomic>

namespace touchdown::engine {

// Spins until the value fulfils `wish`, for a third of a millisecond or so, and returns the last
// value seen. To sleep and to be woken takes longer than the usual pause between two steps.
template <typename T, typename Wish>
T spin_until(const std::atomic<T>& value, const Wish& wish) {
  constexpr int max_loads = 20000;
  T now = value.load();
  for (int loads = 0; loads < max_loads && !wish(now); ++loads) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
    now = value.load();
  }
  return now;
}

}  // namespace touchdown::engine
