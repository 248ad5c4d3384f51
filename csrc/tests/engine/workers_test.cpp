#include "engine/workers.hpp"

#include <atomic>
#include <chrono>
#include <vector>

#include "engine/pace.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::engine;
using std::chrono::milliseconds;

TEST("every number is worked on once, however often the workers run") {
  Workers workers(3);
  for (int repeat = 0; repeat < 200; ++repeat) {
    std::vector<std::atomic<int>> calls(3);
    const std::size_t used = workers.used_for(3);
    CHECK(used >= 1 && used <= 3);
    workers.run(used, 3, [&](std::size_t number) { ++calls[number]; });
    for (std::size_t i = 0; i < 3; ++i) CHECK_EQUAL(calls[i].load(), i < used ? 1 : 0);
  }
}

TEST("one piece of work uses one thread") {
  Workers workers(8);
  CHECK_EQUAL(workers.used_for(1), 1u);
}

TEST("the first runs are alone, so that later ones have a measure") {
  Pace pace;
  int alone = 0;
  while (pace.is_better_alone()) ++alone;
  CHECK_EQUAL(alone, 16);
}

TEST("a run together that is slower than alone is followed by runs alone, and then by a new try") {
  Pace pace;
  while (pace.is_better_alone()) pace.took(milliseconds(1), 100, 1);
  pace.took(milliseconds(500), 100, 2);
  int alone = 0;
  while (pace.is_better_alone()) ++alone;
  CHECK_EQUAL(alone, 16);
  pace.took(milliseconds(500), 100, 2);
  while (pace.is_better_alone()) ++alone;
  CHECK_EQUAL(alone, 16 + 32);  // the pause doubles
}

TEST("runs together that are faster go on together") {
  Pace pace;
  while (pace.is_better_alone()) pace.took(milliseconds(10), 100, 1);
  for (int i = 0; i < 100; ++i) {
    pace.took(milliseconds(6), 100, 2);
    CHECK(!pace.is_better_alone());
  }
}

TEST("a single run that had to wait does not stop threads that do well") {
  Pace pace;
  while (pace.is_better_alone()) pace.took(milliseconds(10), 100, 1);
  for (int i = 0; i < 300; ++i) {
    pace.took(milliseconds(i % 100 == 50 ? 300 : 6), 100, 2);
    CHECK(!pace.is_better_alone());
  }
}

TEST("after a start that was cheaper than the rest, threads are used again soon") {
  Pace pace;
  while (pace.is_better_alone()) pace.took(milliseconds(3), 100, 1);
  int alone = 0;
  for (int i = 0; i < 1000; ++i) {
    if (pace.is_better_alone()) {
      ++alone;
      pace.took(milliseconds(10), 100, 1);
    } else {
      pace.took(milliseconds(6), 100, 2);
    }
  }
  CHECK(alone >= 16 && alone <= 16 + 32);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
