// Threads that wait for work, so that a step does not have to start any.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
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

  // How many threads `run` may use for so many pieces of work; fewer if the system gives no more.
  std::size_t used_for(std::size_t pieces) {
    if (forked() || pieces <= 1 || count_ == 1) return 1;
    start();
    return std::min(pieces, threads_.size() + 1);
  }

  // Calls `work` with each number below `used`, all at once, and returns when all have. `used` is at
  // most what `used_for` gave; `work` must not throw.
  void run(std::size_t used, const std::function<void(std::size_t)>& work) {
    if (used == 1) {
      work(0);
      return;
    }
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

 private:
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
  std::vector<std::thread> threads_;
  pid_t owner_ = 0;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::size_t helpers_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint32_t> round_{0};
  std::atomic<std::size_t> busy_{0};
};

}  // namespace touchdown
