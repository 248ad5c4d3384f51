// Whether it pays to use several threads just now.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>

namespace touchdown::engine {

// Decides whether a run uses several threads, by the times of earlier runs. Where another process
// uses the same cores, all threads wait for the one that waits for its turn, some twenty times as
// long as a step takes.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  // True during the pause that follows when runs together were slower than runs alone; counts it
  // down. The first runs are alone too, so that later ones can be compared with them.
  bool is_better_alone() {
    if (runs_alone_ == 0) return false;
    --runs_alone_;
    return true;
  }

  // Records how long a run of `size` units of work took with `used` threads.
  void took(Clock::duration time, std::size_t size, std::size_t used) {
    const double each = std::chrono::duration<double>(time).count() / static_cast<double>(size);
    if (alone_ == 0.0) {
      alone_ = together_ = each;
    } else if (used == 1) {
      // A run that had to wait for its turn while alone is no measure.
      if (each < kWaited * alone_) alone_ += (each - alone_) * kNewestAlone;
    } else {
      // One run that had to wait is no reason to stop, many are.
      together_ += (std::min(each, kWaited * alone_) - together_) * kNewest;
      ++runs_;
      if (together_ > alone_) pause();
    }
  }

 private:
  // After threads have done well for long, the pause is short: the disturbance may be over soon.
  void pause() {
    if (runs_ > kLong) next_pause_ = kShortestPause;
    runs_alone_ = next_pause_;
    next_pause_ = std::min(2 * next_pause_, kLongestPause);
    together_ = alone_;
    runs_ = 0;
  }

  static constexpr double kNewest = 1.0 / 64.0;
  static constexpr double kNewestAlone = 1.0 / 8.0;  // so that a short pause suffices for a measure
  static constexpr double kWaited = 5.0;
  static constexpr std::size_t kLong = 256;
  static constexpr std::size_t kFirst = 16;
  static constexpr std::size_t kShortestPause = 16;
  static constexpr std::size_t kLongestPause = 8192;

  double alone_ = 0.0;     // seconds per unit of work, by one thread
  double together_ = 0.0;  // the same by all threads
  std::size_t runs_alone_ = kFirst;
  std::size_t next_pause_ = kShortestPause;
  std::size_t runs_ = 0;
};

}  // namespace touchdown::engine
