// Threads that wait for work, so that a step does not have to start any.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <system_error>
#include <thread>
#include <vector>

namespace touchdown {

// To sleep and to be woken takes longer than the pause between two steps mostly lasts. Gives the value
// once it is the one wished for, or as it is after a third of a millisecond or so.
template <typename T, typename Wish>
T wait_a_little(const std::atomic<T>& value, const Wish& wish) {
  constexpr int looks = 20000;
  T now = value.load();
  for (int look = 0; look < looks && !wish(now); ++look) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
    now = value.load();
  }
  return now;
}

// Whether threads gain anything. Where another process is at work on their cores, all of them wait for
// the one that has to wait for its turn, some twenty times as long as a step takes.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  // Counts down the pause after runs together that were slower than alone. The first runs are alone
  // too, for later ones to be compared with.
  bool is_better_alone() {
    if (pause_ == 0) return false;
    --pause_;
    return true;
  }

  // How long a run took that threads could have shared, with so much work and so many of them.
  void took(Clock::duration time, std::size_t size, std::size_t used) {
    const double each = std::chrono::duration<double>(time).count() / static_cast<double>(size);
    if (alone_ == 0.0) {
      alone_ = together_ = each;
    } else if (used == 1) {
      // One that had to wait for its turn while alone is no measure.
      if (each < kWaited * alone_) alone_ += (each - alone_) * kNewest;
    } else {
      together_ += (each - together_) * kNewest;
      ++runs_;
      if (together_ > alone_) rest();
    }
  }

 private:
  // A try that did well for long was not in vain: what disturbed it may be over soon.
  void rest() {
    if (runs_ > kLong) next_pause_ = kShortestPause;
    pause_ = next_pause_;
    next_pause_ = std::min(2 * next_pause_, kLongestPause);
    together_ = alone_;
    runs_ = 0;
  }

  static constexpr double kNewest = 1.0 / 64.0;
  static constexpr double kWaited = 5.0;
  static constexpr std::size_t kLong = 256;
  static constexpr std::size_t kFirst = 16;
  static constexpr std::size_t kShortestPause = 64;
  static constexpr std::size_t kLongestPause = 8192;

  double alone_ = 0.0;     // seconds a unit of work, by one thread
  double together_ = 0.0;  // the same by all threads
  std::size_t pause_ = kFirst;
  std::size_t next_pause_ = kShortestPause;
  std::size_t runs_ = 0;
};

class Workers {
 public:
  // The calling thread works too: one less is started, and only when there is work.
  explicit Workers(std::size_t count) : count_(count) {}
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  ~Workers() {
    if (threads_.empty()) return;
    if (forked()) {
      // A fork copies their handles but not the threads.
      for (std::thread& thread : threads_) thread.detach();
      return;
    }
    stopping_ = true;
    announce();
    for (std::thread& thread : threads_) thread.join();
  }

  // How many threads `run` may use for so many pieces of work; fewer if the system gives no more, or
  // if others are at work on its cores.
  std::size_t used_for(std::size_t pieces) {
    can_share_ = !forked() && pieces > 1 && count_ > 1;
    if (!can_share_ || pace_.is_better_alone()) return 1;
    start();
    return std::min(pieces, threads_.size() + 1);
  }

  // Calls `work` with each number below `used`, all at once, and returns when all have. `used` is at
  // most what `used_for` gave, `size` how much work there is in all; `work` must not throw.
  void run(std::size_t used, std::size_t size, const std::function<void(std::size_t)>& work) {
    const auto began = Pace::Clock::now();
    if (used == 1) {
      work(0);
    } else {
      run_together(used, work);
    }
    if (can_share_) pace_.took(Pace::Clock::now() - began, size, used);
  }

 private:
  void run_together(std::size_t used, const std::function<void(std::size_t)>& work) {
    work_ = &work;
    helpers_ = used - 1;
    busy_.store(threads_.size(), std::memory_order_relaxed);
    announce();
    work(0);
    const auto is_zero = [](std::size_t left) { return left == 0; };
    for (std::size_t left = wait_a_little(busy_, is_zero); left > 0; left = busy_.load()) {
      busy_.wait(left);
    }
  }

  bool forked() const { return !threads_.empty() && owner_ != getpid(); }

  void announce() {
    ++round_;
    round_.notify_all();
  }

  void start() {
    if (!threads_.empty()) return;
    owner_ = getpid();
    try {
      while (threads_.size() + 1 < count_) {
        threads_.emplace_back(&Workers::help, this, threads_.size() + 1, round_.load());
      }
    } catch (const std::system_error&) {
      count_ = threads_.size() + 1;
    }
  }

  void help(std::size_t number, std::uint32_t seen) {
    for (;;) {
      const auto is_new = [seen](std::uint32_t round) { return round != seen; };
      if (!is_new(wait_a_little(round_, is_new))) round_.wait(seen);
      seen = round_.load();
      if (stopping_) return;
      if (number <= helpers_) (*work_)(number);
      if (--busy_ == 0) busy_.notify_one();
    }
  }

  std::size_t count_;
  Pace pace_;
  bool can_share_ = false;
  std::vector<std::thread> threads_;
  pid_t owner_ = 0;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::size_t helpers_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint32_t> round_{0};
  std::atomic<std::size_t> busy_{0};
};

}  // namespace touchdown
